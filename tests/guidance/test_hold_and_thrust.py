"""Position hold and thrust against a point mass that obeys them exactly."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import Coefficients
from companion.guidance import (
    HoldGains,
    HoverThrust,
    PositionHold,
    Reference,
    VehicleMotion,
    specific_thrust,
)
from companion.guidance.reference import GRAVITY

GAINS = HoldGains(0.9, 1.6, 1.5, 3.5, 0.0, 2.0, 1.0, 6.0)
REST = (0.0, 0.0, 0.0)
numbers = st.floats(-200, 200)


def acceleration(target, down):
    """World acceleration of a vehicle at the commanded tilt with the commanded height thrust."""
    sine = math.hypot(target.north, target.east)
    thrust = specific_thrust(down, math.sqrt(1 - sine * sine))
    return np.array([thrust * target.north, thrust * target.east, down])


def test_converges_without_overshooting_the_speed_limits():
    hold = PositionHold(GAINS)
    reference = Reference((4.0, -3.0, -20.0), heading=0.3)
    position, velocity = np.array([0.0, 0.0, -5.0]), np.zeros(3)
    for _ in range(3000):
        motion = VehicleMotion(tuple(position), tuple(velocity))
        target, down = hold.command(reference, motion)
        velocity = velocity + 0.01 * acceleration(target, down)
        position = position + 0.01 * velocity
        assert -2.05 <= velocity[2] <= 1.05
        assert target.heading == 0.3
    assert position == pytest.approx(reference.position_ned, abs=0.01)


@given(st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers, numbers))
def test_every_command_can_be_flown(position, velocity):
    target, down = PositionHold(GAINS).command(Reference(REST), VehicleMotion(position, velocity))
    a = acceleration(target, down)
    assert np.hypot(a[0], a[1]) <= GAINS.max_horizontal * (1 + 1e-9)
    assert abs(down) <= 0.5 * GRAVITY
    assert math.hypot(target.north, target.east) < 1.0


def test_feed_forward_gives_the_reference_acceleration_and_the_drag():
    gains = HoldGains(0.9, 1.6, 1.5, 3.5, 0.5, 2.0, 1.0, 6.0)
    reference = Reference((1.0, 2.0, -5.0), (2.0, -1.0, 0.0), (0.5, 0.7, 0.0))
    motion = VehicleMotion(reference.position_ned, reference.velocity_ned)
    target, down = PositionHold(gains).command(reference, motion)
    assert acceleration(target, down) == pytest.approx([1.5, 0.2, 0.0], abs=1e-9)


def test_open_loop_coefficients_pass_unchanged_while_height_is_held():
    reference = Reference((0.0, 0.0, -5.0), coefficients=Coefficients(0.2, -0.1))
    motion = VehicleMotion((7.0, 7.0, -4.0), (3.0, 3.0, 0.0))
    target, down = PositionHold(GAINS).command(reference, motion)
    assert (target.north, target.east) == (0.2, -0.1)
    assert down < 0.0


def test_thrust_grows_with_tilt_and_never_without_end():
    assert specific_thrust(0.0, 1.0) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, math.cos(0.6)) * math.cos(0.6) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, 0.5 - 1e-9) == pytest.approx(specific_thrust(0.0, 0.5))
    assert specific_thrust(0.0, 0.25) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, 0.0) == specific_thrust(0.0, -1.0) == 0.0
    assert specific_thrust(20.0, 1.0) == 0.0


@pytest.mark.parametrize("true_hover", [0.40, 0.49, 0.62])
def test_hover_thrust_is_learned_from_vertical_acceleration(true_hover):
    thrust = HoverThrust(0.5, 0.4, 1.5, 0.1, 0.9)
    rng = np.random.default_rng(3)
    velocity = 0.0
    for k in range(500):
        u = thrust.normalised(specific_thrust(0.5 * velocity, 0.95))
        thrust.sent(u * 0.95)
        velocity += 0.02 * (GRAVITY - u * GRAVITY / true_hover * 0.95)
        thrust.observe(k * 0.02, velocity + rng.normal(0.0, 0.02))
    assert thrust.hover == pytest.approx(true_hover, rel=0.02)


def test_hover_thrust_stays_in_its_bounds_and_learns_nothing_implausible():
    thrust = HoverThrust(0.5, 0.2, 0.5, 0.1, 0.9)
    for k in range(200):
        thrust.sent(0.9)
        thrust.observe(k * 0.05, 0.0)
    assert thrust.hover == pytest.approx(0.6)
    before = thrust.hover
    for k in range(200):  # free fall
        thrust.sent(0.9)
        thrust.observe(100.0 + k * 0.05, 9.8 * k * 0.05)
    assert thrust.hover == before
    assert thrust.normalised(1e9) == 0.9
    assert thrust.normalised(0.0) == 0.1


def test_a_pause_and_a_gap_are_not_learned_from():
    thrust = HoverThrust(0.5, 0.4, 0.5, 0.1, 0.9)
    thrust.sent(0.9)
    thrust.observe(0.0, 0.0)
    thrust.pause()
    thrust.sent(0.9)
    thrust.observe(0.3, 0.0)
    assert thrust.hover == 0.5
    thrust.sent(0.9)
    thrust.observe(9.0, 0.0)
    assert thrust.hover == 0.5
