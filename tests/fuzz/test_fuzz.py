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

FOUND = [
    pytest.param(name, path, id=f"{name}-{path.stem}")
    for name, target in TARGETS.items()
    for path in target.corpus()
]


@pytest.mark.parametrize("name", TARGETS)
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
