"""The motion carried on past dead time and lead, against SciPy's integration of a late response."""

from math import radians, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Coefficients, InvalidQuaternionError, attitude
from companion.nmpc import ControlInput, Settings, VehicleSnapshot
from companion.nmpc.prediction import Predictor, TiltedTooFarError, motion_of
from tests.nmpc import rigid

SETTINGS = Settings(gravity=rigid.GRAVITY, dead_time=0.05, gain=4.0, lag=0.08, yaw_gain=1.5)
INPUTS = (
    ControlInput(9.90, 0.3, 0.1, 0.2, 11.0),
    ControlInput(9.96, -0.2, 0.3, 0.1, 9.0),
    ControlInput(9.98, 0.1, -0.4, -0.3, 12.0),
    ControlInput(10.00, 0.4, 0.2, 0.5, 8.0),
)
VEHICLE = VehicleSnapshot(
    10.0,
    (1.0, -2.0, -5.0),
    (3.0, 1.0, -0.5),
    attitude(Coefficients(0.2, -0.1), 0.4),
    BodyRates(0.6, -0.4, 0.2),
    tuple(rigid.WIND),
    rigid.DRAG,
)


def late(time, x):
    """The whole of it again: position, velocity, c, heading, ċ."""
    acting = [one for one in INPUTS if one.time + SETTINGS.dead_time <= time][-1]
    c, speed = x[6:8], x[9:11]
    axis = np.array([c[0], c[1], -np.sqrt(1.0 - c @ c)])
    share = rigid.DRAG.linear + rigid.DRAG.quadratic * np.linalg.norm(x[3:6])
    fall = acting.thrust * axis + [0.0, 0.0, rigid.GRAVITY] - share * x[3:6] + rigid.WIND
    pull = SETTINGS.gain * (np.array([acting.north, acting.east]) - c)
    turn = SETTINGS.yaw_gain * (acting.heading - x[8])
    return np.concatenate([x[3:6], fall, speed, [turn], (pull - speed) / SETTINGS.lag])


def test_every_input_acts_one_dead_time_after_it_was_given():
    found = Predictor(SETTINGS).predict(VEHICLE, INPUTS, 10.07)
    start = motion_of(VEHICLE)
    exact = solve_ivp(late, (10.0, 10.07), start, rtol=1e-10, atol=1e-12, max_step=1e-3)
    assert found == pytest.approx(exact.y[:, -1], abs=2e-6)
    assert np.abs(np.array(found) - start).max() > 0.05


def test_the_motion_is_that_of_the_attitude_and_its_rates():
    r = Rotation.from_euler("ZYX", [0.4, -0.3, 0.5])
    q, rates, h = rigid.quaternion(r), (0.6, -0.4, 0.2), 1e-6
    motion = motion_of(VEHICLE._replace(q=q, body_rates=BodyRates(*rates)))
    later, before = (rigid.coefficients(rigid.turned(r, rates, dt)) for dt in (h, -h))
    assert (motion.north, motion.east) == pytest.approx(rigid.coefficients(r))
    assert motion.heading == pytest.approx(rigid.heading(r))
    assert (motion.speed_north, motion.speed_east) == pytest.approx(
        (later - before) / (2.0 * h), abs=1e-6
    )


def test_a_target_beyond_the_tilt_limit_acts_as_the_planner_shortens_it():
    settings = Settings(max_tilt=radians(30.0))
    level = VEHICLE._replace(q=(1.0, 0.0, 0.0, 0.0), body_rates=BodyRates(0.0, 0.0, 0.0))
    long, short = (
        Predictor(settings).predict(level, (ControlInput(9.0, length, 0.0, 0.0, 9.8),), 10.3)
        for length in (5.0, sin(radians(30.0)))
    )
    assert long == pytest.approx(short)


def test_without_inputs_the_attitude_is_taken_to_be_kept():
    still = VEHICLE._replace(body_rates=BodyRates(0.0, 0.0, 0.0))
    found = Predictor(SETTINGS).predict(still, (), 10.1)
    assert (found.north, found.east, found.heading) == pytest.approx((0.2, -0.1, 0.4))
    assert found.v_d == pytest.approx(
        -0.5 + 0.1 * (0.2 + rigid.DRAG.per_velocity(3.2) * 0.5), abs=0.005
    )


def test_what_the_models_do_not_reach_is_refused():
    with pytest.raises(TiltedTooFarError):
        motion_of(VEHICLE._replace(q=(0.0, 1.0, 0.0, 0.0)))
    with pytest.raises(InvalidQuaternionError):
        motion_of(VEHICLE._replace(q=(1.0, 1.0, 0.0, 0.0)))
    tumbling = VEHICLE._replace(body_rates=BodyRates(25.0, 0.0, 0.0))
    with pytest.raises(TiltedTooFarError):
        Predictor(SETTINGS).predict(tumbling, INPUTS, 10.1)
