"""Body-rate responses of the shaped rate loop against those measured on ArduPilot."""

from functools import cache
from itertools import pairwise
from math import degrees, inf, isfinite, nan, radians
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.optimize import curve_fit
from scipy.spatial.transform import Rotation

from sitl_mock.__main__ import main
from sitl_mock.ardupilot.defaults import RATE_LAG_MS
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import AxisShaping, RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor
from sitl_mock.physics.multirotor_step import (
    Conditions,
    at_rest,
    drive,
    empty_rings,
    initial_actuation,
    move,
    multirotor_constants,
    steady_throttle,
)
from sitl_mock.physics.rate_shaping import (
    INACTIVE_SHAPING,
    shape,
    shaping_constants,
    sqrt_controller,
)
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle
from sitl_mock.settings import MockSettings, load_settings

LEVEL = (1.0, 0.0, 0.0, 0.0)
REST = (0.0, 0.0, 0.0)
GRAVITY = 9.80665
DT = 1e-3
ROLL, PITCH, YAW = range(3)
TILT_LIMIT, YAW_LIMIT = 1100.0, 270.0  # measured, deg/s^2
GYRO = RATE_LAG_MS  # in the measured rates, not in the body's, ms
# Measured fits of the answer to a step of so many rad/s: first-order lag and dead time, ms.
MEASURED = {
    ROLL: {0.5: (18, 27 - GYRO), 1.0: (28, 34 - GYRO), 2.0: (48, 46 - GYRO)},
    PITCH: {0.5: (18, 27 - GYRO), 1.0: (28, 34 - GYRO), 2.0: (48, 46 - GYRO)},
    YAW: {0.5: (87, 184 - GYRO), 1.0: (101, 229 - GYRO), 2.0: (164, 293 - GYRO)},
}
# Lag and dead time together, with the slew separated, ms.
SEPARATED = {ROLL: 36.0 - GYRO, PITCH: 36.0 - GYRO, YAW: 205.0 - GYRO}
OVERSHOOT = {ROLL: (1.0, 1.04), PITCH: (1.0, 1.04), YAW: (1.05, 1.22)}


def vector(axis, value):
    return tuple(value if each == axis else 0.0 for each in range(3))


def hovering(rate_loop=None, airframe=None):
    rate_loop = rate_loop or RateLoopConfig.ardupilot()
    return Multirotor(airframe or AirframeConfig(), rate_loop, LEVEL, GRAVITY)


def fly(multirotor, setpoint, seconds):
    """Body rates before each step, (n, 3); lift holds what the level hover needs."""
    throttle = multirotor.throttle(GRAVITY)
    rates = []
    for _ in range(round(seconds / DT)):
        rates.append(multirotor.body_rates)
        multirotor.move(multirotor.drive(setpoint, throttle))
    return np.array(rates)


def rotation(q):
    return Rotation.from_quat([*q[1:], q[0]])


@cache
def response(axis, rate, of=hovering):
    """Times in s and rates per setpoint; a roll of 2 rad/s comes to 57 degrees in its time."""
    y = fly(of(), vector(axis, rate), 1.0 if axis == YAW else 0.5)[:, axis] / rate
    return np.arange(len(y)) * DT, y


def first_order(t, lag, dead_time):
    return 1.0 - np.exp(-np.maximum(t - dead_time, 0.0) / lag)


def first_order_of_a_ramp(t, lag, dead_time, ramp):
    """The answer of a first-order lag to a setpoint that rises for `ramp` seconds."""

    def since(start):
        s = np.maximum(t - start, 0.0)
        return s - lag * (1.0 - np.exp(-s / lag))

    return (since(dead_time) - since(dead_time + ramp)) / ramp


def fitted(model, t, y, start):
    return curve_fit(model, t, y, p0=start, bounds=([1e-3, 0.0], [0.5, 0.5]))[0] * 1e3


STEPS = [(axis, rate) for axis, steps in MEASURED.items() for rate in steps]


def arducopter():
    """The vehicle that `autopilot: ardupilot` brings along: other rotors, the same answer."""
    settings = MockSettings(autopilot="ardupilot")
    return hovering(settings.rate_loop, settings.airframe)


@pytest.mark.parametrize("vehicle", [hovering, arducopter])
@pytest.mark.parametrize(("axis", "rate"), STEPS)
def test_the_answer_to_a_step_is_as_measured(axis, rate, vehicle):
    t, y = response(axis, rate, vehicle)
    measured = MEASURED[axis][rate]
    lag, dead_time = fitted(first_order, t, y, np.array(measured) * 1e-3)
    assert lag + dead_time == pytest.approx(sum(measured), rel=0.08, abs=6.0)
    assert lag == pytest.approx(measured[0], abs=9.0)
    least, most = OVERSHOOT[axis]
    assert least <= y.max() < most


@pytest.mark.parametrize(("axis", "rate"), STEPS)
def test_with_the_slew_separated_it_does_not_depend_on_the_step(axis, rate):
    t, y = response(axis, rate)
    ramp = rate / radians(YAW_LIMIT if axis == YAW else TILT_LIMIT)
    start = np.array([0.3, 0.7]) * SEPARATED[axis] * 1e-3
    together = fitted(
        lambda t, lag, dead: first_order_of_a_ramp(t, lag, dead, ramp), t, y, start
    ).sum()
    assert together == pytest.approx(SEPARATED[axis], rel=0.07, abs=2.5)


def test_a_step_back_answers_as_the_step_did():
    assert fly(hovering(), vector(PITCH, -1.0), 0.5)[:, PITCH] == pytest.approx(
        -response(PITCH, 1.0)[1], abs=1e-6
    )


@pytest.mark.parametrize("axis", [ROLL, PITCH, YAW])
def test_the_shaped_rate_never_changes_faster_than_the_limit(axis):
    axes = RateLoopConfig.ardupilot().shaping
    constants = shaping_constants(
        tuple(a.model_copy(update={"attitude_gain_1_s": 0.0}) for a in axes), DT
    )
    rng = np.random.default_rng(4)
    shaped, state = [0.0], INACTIVE_SHAPING
    for _ in range(100):
        goals = vector(axis, rng.uniform(-4.0, 4.0))
        for _ in range(rng.integers(1, 300)):
            setpoint, state = shape(constants, state, goals, LEVEL)
            shaped.append(setpoint[axis])
    fastest = max(abs(np.diff(shaped))) / DT
    assert fastest == pytest.approx(radians(YAW_LIMIT if axis == YAW else TILT_LIMIT), rel=1e-6)


@pytest.mark.parametrize("axis", [ROLL, PITCH, YAW])
@pytest.mark.parametrize("rate", [0.5, -1.0, 2.0])
def test_the_angle_reached_is_the_integral_of_the_command(axis, rate):
    multirotor = hovering()
    seconds = 1.0 if axis == YAW else 0.4  # longer than the slew, less than a half turn
    fly(multirotor, vector(axis, rate), seconds)
    fly(multirotor, REST, 2.0)
    assert rotation(multirotor.q).as_rotvec()[axis] == pytest.approx(seconds * rate, rel=0.04)


def test_the_attitude_target_and_what_it_asks_of_the_body_about_all_axes():
    """Against SciPy: the setpoints integrated, and seen from a body that does not move."""
    axis = AxisShaping(acceleration_limit_rad_s2=1e6)  # so that angles are closed in proportion
    constants, state = shaping_constants((axis, axis, axis), DT), INACTIVE_SHAPING
    body = Rotation.from_euler("ZYX", [0.7, -0.3, 0.2])
    x, y, z, w = body.as_quat()
    target = body
    for setpoint in np.random.default_rng(7).uniform(-2.0, 2.0, (20, 3)):
        for _ in range(50):
            rates, state = shape(constants, state, tuple(setpoint), (w, x, y, z))
            target = target * Rotation.from_rotvec(setpoint * DT)
        ahead = body.inv() * target
        expected = ahead.apply(setpoint) + axis.attitude_gain_1_s * ahead.as_rotvec()
        assert np.array(rates) == pytest.approx(expected, abs=1e-5)


def test_the_body_follows_a_correction_of_the_estimated_attitude():
    """The attitude target stays in the frame of the estimate, as recorded on ArduPilot."""
    constants = multirotor_constants(AirframeConfig(), RateLoopConfig.ardupilot())
    throttle = steady_throttle(constants, GRAVITY)
    rings, body = empty_rings(constants), at_rest(LEVEL)
    actuation = initial_actuation(constants, throttle)
    for step in range(4000):
        error = (0.0, 0.0, 0.0) if step < 1000 else (0.004, -0.003, 0.02)
        conditions = Conditions(1.0, REST, error)
        load, actuation = drive(
            constants, rings, actuation, body, step, REST, throttle, True, conditions
        )
        body, _ = move(constants, body, load)
    w, x, y, z = body[0][3:7]
    turn = Rotation.from_quat([x, y, z, w]).as_rotvec()
    assert turn == pytest.approx([-0.004, 0.003, -0.02], abs=1e-4)


def test_angles_are_closed_in_proportion_then_as_they_can_be_stopped():
    """ArduPilot's sqrt_controller: the slope goes on steadily, the rate grows with the root."""
    assert sqrt_controller(0.1, 4.5, 2.356) == pytest.approx(0.45)
    edge = 2.356 / 4.5**2
    assert sqrt_controller(edge + 1e-6, 4.5, 2.356) == pytest.approx(
        sqrt_controller(edge, 4.5, 2.356), abs=1e-5
    )
    assert sqrt_controller(-1.0, 4.5, 2.356) == -sqrt_controller(1.0, 4.5, 2.356)
    assert sqrt_controller(1.0, 4.5, 2.356) == pytest.approx(
        np.sqrt(2.0 * 2.356 * (1.0 - edge / 2.0))
    )
    assert sqrt_controller(1.0, 0.0, 2.356) == 0.0


RECORDED = Path(__file__).parent / "recordings" / "ardupilot-attitude-target.npz"
"""7 s of ArduCopter flying corners, 100 Hz: rows of time (s), attitude (w, x, y, z), rates (rad/s)
of ATTITUDE_TARGET (`target`) and of ATTITUDE_QUATERNION (`body`), a cut-out of a recording."""


def lead(targets, bodies):
    """Rotation vectors, deg, from each body's attitude to its target's."""
    bodies, targets = (Rotation.from_quat(np.roll(each, -1, axis=1)) for each in (bodies, targets))
    return np.degrees((bodies.inv() * targets).as_rotvec())


def test_the_body_lags_its_attitude_target_as_recorded():
    """The recorded target is flown again; the lead in yaw agrees within 20 %, in tilt as nearly."""
    log = np.load(RECORDED)
    recorded_lead = lead(log["target"][:, 1:5], log["body"][:, 1:5])
    loop = RateLoopConfig.ardupilot()
    ready = {
        name: getattr(loop, name).model_copy(
            update={"shaping": loop.roll.shaping.model_copy(update={"delay_ms": 0.0})}
        )
        for name in ("roll", "pitch", "yaw")
    }  # what is recorded is already delayed and slewed
    multirotor = hovering(RateLoopConfig(**ready))
    multirotor.body = at_rest(tuple(map(float, log["body"][0, 1:5])))
    rows = []
    for before, after in pairwise(log["target"]):
        for share in (np.arange(10) + 0.5) / 10:
            setpoint = before[5:8] + share * (after[5:8] - before[5:8])
            fly(multirotor, tuple(map(float, setpoint)), DT)
        rows.append((*multirotor.actuation[3].target, *multirotor.q))
    rows = np.array(rows)
    mock_lead = lead(rows[:, :4], rows[:, 4:])
    left = np.sqrt(np.mean((mock_lead - recorded_lead[1:]) ** 2, axis=0))
    recorded_size = np.sqrt(np.mean(recorded_lead**2, axis=0))
    assert left[YAW] < 0.2 * recorded_size[YAW]
    assert max(left[ROLL], left[PITCH]) < 0.5
    assert abs(mock_lead[:, YAW]).max() == pytest.approx(abs(recorded_lead[:, YAW]).max(), rel=0.15)


def left_of_a_push(rate_loop):
    """Angle in degrees, 2 s after something turned the vehicle at rest by 20 degrees."""
    multirotor = hovering(rate_loop)
    fly(multirotor, REST, 0.1)
    x, y, z, w = Rotation.from_rotvec([20.0, 0.0, 0.0], degrees=True).as_quat()
    multirotor.body = at_rest((w, x, y, z))
    fly(multirotor, REST, 2.0)
    return degrees(rotation(multirotor.q).magnitude())


def test_after_a_push_the_attitude_returns_unlike_that_of_px4():
    assert left_of_a_push(RateLoopConfig.ardupilot()) < 0.1
    assert left_of_a_push(RateLoopConfig()) == pytest.approx(20.0, abs=0.1)


@pytest.mark.parametrize("axis", [ROLL, PITCH, YAW])
def test_a_rate_that_is_no_number_holds_the_present_rate(axis):
    multirotor = hovering()
    fly(multirotor, vector(axis, 0.5), 2.0)
    held = fly(multirotor, vector(axis, nan), 0.5)
    assert held == pytest.approx(np.tile(vector(axis, 0.5), (len(held), 1)), abs=0.01)
    fly(multirotor, REST, 2.0)
    assert multirotor.body_rates == pytest.approx(REST, abs=0.01)


@pytest.mark.parametrize(("odd", "sign"), [(inf, 1.0), (-inf, -1.0)])
def test_an_infinite_rate_makes_it_spin_away(odd, sign):
    multirotor = hovering()
    rates = fly(multirotor, vector(ROLL, odd), 0.5)[:, ROLL]
    assert sign * rates[-1] > 6.0
    assert np.isfinite(rates).all()


def test_the_shaping_acts_only_after_its_delay():
    multirotor = hovering()
    delay = RateLoopConfig.ardupilot().roll.shaping.delay_ms * 1e-3
    fly(multirotor, vector(ROLL, 1.0), delay)
    assert len(set(multirotor.actuation[0].throttles)) == 1
    fly(multirotor, vector(ROLL, 1.0), DT)
    assert len(set(multirotor.actuation[0].throttles)) > 1


@pytest.mark.parametrize("armed", [True, False])
def test_nothing_is_shaped_while_standing_or_disarmed(armed):
    """A target that had gone on turning would throw the vehicle as it lifts off."""
    vehicles = [Vehicle(rate_loop=RateLoopConfig.ardupilot(), seed=0) for _ in range(2)]
    for vehicle, rate in zip(vehicles, (2.0, 0.0), strict=True):
        for _ in range(1000):
            vehicle.step(ActuatorCommand(armed, rate, -rate, rate, 0.0))
        for _ in range(500):  # longer than any delay
            vehicle.step(ActuatorCommand(armed, 0.0, 0.0, 0.0, 0.0))
        for _ in range(500):
            vehicle.step(ActuatorCommand(True, 0.0, 0.0, 0.0, 0.6))
    assert not vehicles[0].on_ground
    assert vehicles[0].truth == vehicles[1].truth


def test_it_stays_upright_in_gusty_commands_about_all_axes():
    multirotor = hovering()
    rng = np.random.default_rng(11)
    for setpoint in rng.uniform(-1.0, 1.0, (40, 3)):
        fly(multirotor, tuple(setpoint), 0.2)
        fly(multirotor, tuple(-setpoint), 0.2)
        assert max(map(abs, multirotor.body_rates)) < 3.0
    fly(multirotor, REST, 2.0)
    assert all(map(isfinite, multirotor.body[0]))
    assert multirotor.body_rates == pytest.approx(REST, abs=1e-3)


def test_one_word_in_the_configuration_chooses_it(tmp_path):
    path = tmp_path / "mock.yaml"
    path.write_text("mock: {rate_loop: ardupilot}")
    assert load_settings(path, {}).rate_loop == RateLoopConfig.ardupilot()
    path.write_text("mock: {rate_loop: px4}")
    assert load_settings(path, {}) == MockSettings()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ardupiolt", ("mock.rate_loop", "px4, ardupilot")),
        (
            "{roll: {proportional_n_m_s: 1, shaping: {acceleration_limit_rad_s2: 1}}}",
            ("mock.rate_loop", "all three axes"),
        ),
        (
            "{yaw: {proportional_n_m_s: 1, shaping: {acceleration_rad_s2: 1}}}",
            ("mock.rate_loop.yaw.shaping",),
        ),
    ],
)
def test_mistakes_are_told(text, words, tmp_path, capsys):
    path = tmp_path / "mock.yaml"
    path.write_text(f"mock:\n  rate_loop: {text}\n")
    assert main(["--config", str(path), "--check"]) == 2
    errors = capsys.readouterr().err
    assert all(word in errors for word in words)


def test_part_of_the_axes_shaped_is_refused():
    shaped = RateLoopConfig.ardupilot()
    with pytest.raises(ValidationError, match="all three axes"):
        RateLoopConfig(roll=shaped.roll)
