"""A few cases of each target, the same each time, and all that ever failed.

`python -m tests.fuzz` tries more of them.
"""

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from tests.fuzz.target import read_case
from tests.fuzz.targets import TARGETS

EXAMPLES = {
    "configuration": 40,
    "trajectories": 40,
    "frames": 60,
    "telemetry": 12,
    "recordings": 12,
}
"""Some seconds of processor time in all."""

AWAITED: dict[str, str] = {
    "configuration": "the bounded YAML reader",
    "recordings": "the bounded YAML reader",
    "trajectories": "the bounded YAML reader",
}
"""Targets with cases that still fail, and what they wait for."""


def _marks(name):
    reason = AWAITED.get(name)
    return [] if reason is None else [pytest.mark.xfail(run=False, reason=reason)]


FOUND = [
    pytest.param(name, path, id=f"{name}-{path.stem}", marks=_marks(name))
    for name, target in TARGETS.items()
    for path in target.corpus()
]


@pytest.mark.parametrize("name", [pytest.param(name, marks=_marks(name)) for name in TARGETS])
def test_some_cases_of_each_target(name):
    @settings(
        max_examples=EXAMPLES[name],
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    @given(TARGETS[name].cases)
    def search(case):
        TARGETS[name].run(case)

    search()


@pytest.mark.parametrize(("name", "path"), FOUND)
def test_a_case_that_once_failed(name, path):
    TARGETS[name].run(read_case(path))
