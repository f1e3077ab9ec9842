"""CPU time of each test, with the fixtures it needs: what is slow on no computer alone.

A pytest plugin (`-p tests.mutants.seconds`) that writes it to the file named by `_FILE`.
"""

import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from time import process_time

import pytest

_FILE = "SECONDS_OF_TESTS"


def measured_seconds(root: Path, tests: list[str], file: Path) -> dict[str, float]:
    """Run the tests of these folders once.

    Returns:
        Name of each test -> CPU seconds of its call and of all fixtures it uses, also of those
        that another test has set up.
    """
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", "-p", "no:cacheprovider"]
    command += ["-p", "tests.mutants.seconds", *tests]
    subprocess.run(command, cwd=root, check=True, env={**os.environ, _FILE: str(file)})
    return json.loads(file.read_text())


_calls: dict[str, float] = {}
_fixtures: dict[tuple[str, str], float] = defaultdict(float)
_used: dict[str, list[tuple[str, str]]] = {}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    begin = process_time()
    try:
        return (yield)
    finally:
        _calls[item.nodeid] = process_time() - begin
        _used[item.nodeid] = [(str(item.path), name) for name in item.fixturenames]


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request):
    begin = process_time()
    try:
        return (yield)
    finally:
        if fixturedef.scope != "session":
            key = (str(request.path), fixturedef.argname)
            _fixtures[key] = max(_fixtures[key], process_time() - begin)


def pytest_sessionfinish():
    seconds = {
        test: call + sum(_fixtures[fixture] for fixture in _used[test])
        for test, call in _calls.items()
    }
    Path(os.environ[_FILE]).write_text(json.dumps(seconds))
