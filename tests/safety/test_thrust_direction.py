"""The angle between thrust and acceleration: known in motion, silent in gusts, wind and drag."""

from cmath import exp
from math import degrees, pi, radians
from random import Random

import pytest

from companion.control.measured_acceleration import MeasuredAcceleration
from companion.safety.thrust_direction import ThrustDirection

DT = 0.02


def swaying(t):
    """Acceleration by thrust in a hover that swings along two axes, m/s²."""
    return 6.0 * (exp(1.7j * t) + exp(-2.3j * t)) / 2.0


def circling(t):
    """The thrust's acceleration in a circle, 1.2 rad/s, m/s²."""
    return 4.0 * exp(1.2j * t)


def angle_after(thrust, *, turn=0.0, drag=0.0, wind=lambda t: 0j, seconds=6.0, obeys=True):
    """The angle, degrees, when the vehicle has moved for `seconds`; None: not known.

    Attitude (so the thrust that is told) is turned by `turn` degrees against the truth.
    """
    found, velocity = ThrustDirection(), 0j
    for step in range(round(seconds / DT)):
        t = step * DT
        force = thrust(t) if obeys else 0.0
        acceleration = force + wind(t) - drag * velocity
        told = thrust(t) * exp(1j * radians(turn))
        found.observe(
            MeasuredAcceleration(
                DT,
                (told.real, told.imag),
                (acceleration.real, acceleration.imag),
                (velocity.real, velocity.imag),
                0.0,
            )
        )
        velocity += DT * acceleration
    return None if found.angle is None else degrees(found.angle)


@pytest.mark.parametrize("thrust", [swaying, circling])
@pytest.mark.parametrize("turn", [60.0, -60.0, 90.0, -90.0, 135.0, 180.0])
def test_the_angle_is_that_by_which_the_attitude_is_turned(thrust, turn):
    """A heading told too large by 90° lets the vehicle accelerate 90° to the left of the thrust."""
    angle = angle_after(thrust, turn=turn, wind=lambda t: 2.0 - 1.0j)
    assert angle is not None
    # Up to atan(1.5 / 1.2) of one sign may be drag, which is not known.
    error = (angle + turn + 180.0) % 360.0 - 180.0
    assert abs(error) < 45.0
    assert abs(angle) > 50.0 or abs(turn) == 60.0


@pytest.mark.parametrize("drag", [0.0, 0.3, 1.4])
@pytest.mark.parametrize("thrust", [swaying, circling])
def test_drag_and_wind_turn_nothing(thrust, drag):
    angle = angle_after(thrust, drag=drag, wind=lambda t: 4.0 + 3.0j, seconds=12.0)
    assert angle is not None
    assert abs(angle) < 12.0


def test_without_motion_nothing_is_known():
    assert ThrustDirection().angle is None
    assert angle_after(lambda t: 0.3 * circling(t), turn=180.0) is None
    assert angle_after(lambda t: 5.0 + 1.0j, turn=180.0) is None, "it leans against the wind"


def test_a_thrust_that_gusts_balance_tells_no_direction():
    """The vehicle leans against each gust and stays: no acceleration, or a little of any angle."""
    assert angle_after(swaying, wind=lambda t: -swaying(t)) is None
    assert angle_after(swaying, wind=lambda t: -1.3 * swaying(t)) is None
    assert angle_after(swaying, wind=lambda t: swaying(t) * (0.3j - 1.0)) is None


def test_a_vehicle_that_stands_or_is_pushed_about_at_random_tells_no_direction():
    random = Random(3)
    pushes = [complex(random.gauss(0.0, 12.0), random.gauss(0.0, 12.0)) for _ in range(40)]
    assert angle_after(swaying, obeys=False) is None
    pushed = angle_after(swaying, wind=lambda t: pushes[int(t / 0.3)], obeys=False)
    assert pushed is None or abs(pushed) < 50.0


def test_what_was_before_a_heading_reset_does_not_count():
    found = ThrustDirection()
    for step in range(200):
        thrust, resets = circling(step * DT), 0.0 if step < 150 else pi / 2.0
        told = thrust * (1j if step < 150 else 1.0)
        pair = (thrust.real, thrust.imag)
        found.observe(MeasuredAcceleration(DT, (told.real, told.imag), pair, (0.0, 0.0), resets))
        if step == 149:
            assert found.angle is not None
            assert abs(degrees(found.angle)) > 50.0
        assert step < 150 or found.angle is None or abs(degrees(found.angle)) < 1.0
