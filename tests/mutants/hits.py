"""Which tests judge a mutant: also those that use what was made once, at import or for a module.

A pytest plugin for mutmut (`-p tests.mutants.hits`). mutmut notes which functions of the program
run during a test. What runs while the tests are collected, in a fixture that several tests share or
in a cached function of the tests, it counts for the first test only: the mutant would survive
though another test fails.
"""

import json
import os
from collections import defaultdict
from pathlib import Path

import pytest
from mutmut.state import state

_QUICK_S = 0.02
"""What runs at import is judged by tests that take at most so much CPU: all tests are too slow."""

_seconds: dict[str, float] = json.loads(Path("../seconds.json").read_text())
_at_import: set[str] = set()
_in_fixture: dict[object, set[str]] = defaultdict(set)


def pytest_collection_modifyitems(items):
    """The quickest file first: the first failure kills a mutant."""
    of_file = defaultdict(float)
    for item in items:
        of_file[item.path] += _seconds.get(item.nodeid, 0.0)
    items.sort(key=lambda item: of_file[item.path])


def pytest_collection_finish():
    _at_import.update(state()._stats)
    state()._stats.clear()


def pytest_runtest_setup(item):
    if os.environ["MUTANT_UNDER_TEST"] == "stats":
        for each in vars(item.module).values():
            if hasattr(each, "cache_clear"):
                each.cache_clear()


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    before = set(state()._stats)
    state()._stats.clear()
    try:
        return (yield)
    finally:
        if fixturedef.scope != "function":
            _in_fixture[fixturedef] |= state()._stats
        state()._stats.update(before)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_teardown(item):
    fixtures = item._fixtureinfo.name2fixturedefs.values()
    if _seconds.get(item.nodeid, 0.0) <= _QUICK_S:
        state()._stats.update(_at_import)
    state()._stats.update(*(_in_fixture[each[-1]] for each in fixtures))
