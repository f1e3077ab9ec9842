"""The prediction model against a rigid body on SciPy rotations, by finite differences."""

import numpy as np
import pytest

from companion.nmpc.coefficient_model import coefficient_model
from companion.nmpc.model import integrator
from companion.nmpc.settings import Settings
from tests.nmpc import rigid
from tests.nmpc.rigid import POSITION, VELOCITY

SETTINGS = Settings(gravity=rigid.GRAVITY)


def test_it_falls_as_a_rigid_body():
    model, thrust = coefficient_model(SETTINGS), 12.0
    for r in rigid.attitudes():
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        found = rigid.derivative(model, state, (0.1, 0.2, 0.3, thrust))
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))


def test_it_is_second_order_in_the_coefficients():
    model = coefficient_model(Settings(gravity=rigid.GRAVITY, gain=4.0, lag=0.1))
    advance, target = integrator(model), np.array([0.3, -0.2])
    state = np.array([*POSITION, *VELOCITY, -0.2, 0.4, 0.1, 0.5, -0.6])
    constants = [*rigid.CONDITIONS, 0.7]
    after = state
    for _ in range(40):
        after = np.array(advance(after, [*target, 0.1, 9.0], constants, 0.005)).ravel()
    roots = np.roots([0.1, 1.0, 4.0])  # of τ·s² + s + p
    for axis in (0, 1):
        distance, speed = state[6 + axis] - target[axis], state[9 + axis]
        shares = np.linalg.solve([[1.0, 1.0], roots], [distance, speed])
        wanted = np.real(shares @ np.exp(0.2 * roots))
        assert after[6 + axis] == pytest.approx(target[axis] + wanted, abs=1e-6)


@pytest.mark.parametrize("time", [0.7, 3.0, 7.9])
def test_on_its_reference_it_stays_there(time):
    # The control leads the first-order response; the lag of ċ is not led.
    rigid.assert_stays_on_its_reference(coefficient_model(SETTINGS), SETTINGS, time, states=9)


def test_the_heading_error_is_the_heading_left():
    assert rigid.heading_error(coefficient_model(SETTINGS)) == pytest.approx(0.1, abs=1e-4)


def test_the_longest_target_is_the_tilt_limit_or_the_tilt_at_the_start():
    model = coefficient_model(Settings(max_tilt=0.5))
    level = rigid.motion(POSITION, VELOCITY, rigid.Rotation.identity())
    assert model.constants_of(rigid.CONDITIONS, level)[-1] == pytest.approx(np.sin(0.5))
    tilted = level._replace(north=0.6, east=-0.3)
    assert model.constants_of(rigid.CONDITIONS, tilted) == pytest.approx(
        (*rigid.CONDITIONS, np.hypot(0.6, 0.3))
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lag": 0.01}, "half a step of the horizon"),
        ({"yaw_gain": 0.0}, "yaw_gain must be positive"),
        ({"min_thrust": 0.0}, "min_thrust must be positive"),
        ({"max_thrust": 9.0}, "gravity must lie between"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Settings(**changes)
