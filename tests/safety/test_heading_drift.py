"""What counts as a drift of the heading; `tests/flight/test_heading_drift.py` flies with one."""

from math import degrees, radians
from types import SimpleNamespace

import pytest

from companion.safety.heading_drift import HeadingDrift


@pytest.mark.parametrize(
    ("drift", "turn", "seconds", "counted"),
    [
        (35.0, 0.0, 10.0, 35.0),
        (-35.0, 0.0, 10.0, 35.0),
        (35.0, 0.0, 100.0, 7.0),  # an error of the gyro that is constant
        (50.0, 1000.0, 20.0, 0.0),  # a scale error of the gyro in a fast turn
    ],
)
def test_errors_of_a_gyro_are_no_drift(drift, turn, seconds, counted):
    resets = SimpleNamespace()
    heading, steps = HeadingDrift(resets), 100
    for k in range(steps + 1):
        resets.heading_corrections = radians(drift) * k / steps
        resets.total_turn = radians(turn) * k / steps
        newest = heading.drift(seconds * k / steps)
    assert degrees(newest) == pytest.approx(counted, abs=1e-6)
    heading.begin()
    assert heading.drift(seconds + 1.0) == 0.0
