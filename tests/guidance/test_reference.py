"""What a reference says about the height."""

import pytest

from companion.guidance.reference import Reference, ThrustCommand, VerticalMode


@pytest.mark.parametrize(
    ("vertical", "height", "steady"),
    [
        (VerticalMode.HEIGHT, True, True),
        (VerticalMode.HEIGHT_IN_STEPS, True, False),
        (VerticalMode.ACCELERATION, False, True),
        (ThrustCommand(0.5), False, False),
    ],
)
def test_a_commanded_thrust_or_acceleration_holds_no_height(vertical, height, steady):
    reference = Reference((1.0, 2.0, -3.0), vertical=vertical)
    assert (reference.holds_height, reference.thrust_is_steady) == (height, steady)
