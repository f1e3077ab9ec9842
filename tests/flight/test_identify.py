"""Maneuver `identify` flown against the mock, over a socket: what was configured is found again.

The judge is the mock's own physics, excited apart from any flight and fitted by SciPy.
"""

import numpy as np
import pytest
from scipy.optimize import least_squares

from companion.guidance.reference import GRAVITY
from companion.identification import identify_vehicle
from companion.vehicle.flight_log import read_flight_log
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor
from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle

SENSOR_DELAY = 0.005
"""`mock.sensors.rate_lag_ms`, s: a sample tells body rates of so much earlier."""
SIZES = {"roll": 1.05, "pitch": 1.05, "yaw": 0.87}
STEPS = {"roll": 0.25, "pitch": 0.25, "yaw": 1.2}
AXES = tuple(SIZES)

TILT_INERTIA, YAW_INERTIA, AIR_DAMPING = 0.025, 0.030, 0.025  # the mock's airframe


def first_order(inertia, lag, delay_ms):
    """Gains with which inertia·dω/dt = gain·(setpoint − ω), for rotors without a lag."""
    return {
        "proportional_n_m_s": inertia / lag - AIR_DAMPING,
        "feed_forward_n_m_s": AIR_DAMPING,
        "setpoint_delay_ms": delay_ms,
    }


FIRST_ORDER = {
    "airframe": {"rotor_lag_ms": 0.1},
    "rate_loop": {
        "roll": first_order(TILT_INERTIA, 0.03, 20.0),
        "pitch": first_order(TILT_INERTIA, 0.08, 45.0),
        "yaw": first_order(YAW_INERTIA, 0.3, 80.0),
    },
}
CHANGED = {
    "airframe": {"rotor_lag_ms": 70.0},
    "rate_loop": {
        "roll": {"proportional_n_m_s": 0.3, "damping_n_m_s2": 0.01, "setpoint_delay_ms": 25.0},
        "pitch": {"proportional_n_m_s": 0.35, "damping_n_m_s2": 0.01, "setpoint_delay_ms": 15.0},
        "yaw": {
            "proportional_n_m_s": 0.09,
            "feed_forward_n_m_s": 0.02,
            "torque_filter_ms": 40.0,
            "setpoint_delay_ms": 30.0,
        },
    },
}


IDENTIFY = {"flight": {"maneuvers": ["identify"]}, "identify": {"settle_s": 1.0}}


def identified(folder, **mock_settings):
    """The summary of a flight of the maneuver, and the vehicle found in its log."""
    with mock_vehicle(folder, seed=5, **mock_settings) as mock:
        summary = fly(mock, folder / "log", **IDENTIFY)
        assert not mock.state()["crashed"]
    log = read_flight_log(folder / "log" / "flight.tlog")
    return summary, identify_vehicle(log.setpoints, log.rates, log.specific_thrust)


def judged(axis, mock_settings):
    """Lag and dead time (s) of the mock's physics, nearest to the gain of 1 that a planner assumes.

    Doublets of the maneuver's sizes in still air without noise, and SciPy's filter and optimiser.
    """
    from scipy.signal import lfilter  # noqa: PLC0415  a second, which only this test needs

    vehicle = Multirotor(
        AirframeConfig(**mock_settings.get("airframe", {})),
        RateLoopConfig.model_validate(mock_settings.get("rate_loop", "px4")),
        (1.0, 0.0, 0.0, 0.0),
        GRAVITY,
    )
    hover, dt, number = vehicle.throttle(GRAVITY), vehicle.dt, AXES.index(axis)
    pieces = [(0.0, 1.0)]
    for size in (0.5 * SIZES[axis], SIZES[axis]):
        pieces += [(sign * size, n * STEPS[axis]) for sign, n in ((1, 1), (-1, 2), (1, 1))]
        pieces.append((0.0, 2.0))
    asked = np.concatenate([np.full(round(length / dt), rate) for rate, length in pieces])
    rates = np.empty(asked.size)
    for step, rate in enumerate(asked.tolist()):
        setpoint = [0.0, 0.0, 0.0]
        setpoint[number] = rate
        vehicle.move(vehicle.drive(tuple(setpoint), hover))
        rates[step] = vehicle.body_rates[number]
    times = dt * np.arange(asked.size)

    def residual(unknown):
        lag, dead_time = unknown
        late = np.interp(times - dead_time, times, asked)
        decay = np.exp(-dt / lag)
        return lfilter([1.0 - decay], [1.0, -decay], late) - rates

    # The dead time has to be near: SciPy finds the nearest minimum only.
    starts = [(0.1, 0.02), (0.1, 0.06), (0.3, 0.1)]
    fits = [least_squares(residual, s, x_scale=(0.05, 0.02), diff_step=1e-3) for s in starts]
    lag, dead_time = min(fits, key=lambda fit: fit.cost).x
    return lag, dead_time + SENSOR_DELAY


@pytest.fixture(scope="module")
def px4(tmp_path_factory):
    return identified(tmp_path_factory.mktemp("px4"))


@pytest.mark.parametrize("axis", AXES)
def test_px4s_response_is_found_as_the_judge_finds_it(px4, axis):
    summary, vehicle = px4
    assert summary.result == "ok", summary.events
    lag, dead_time = judged(axis, {})
    found = vehicle.axes[axis]
    assert found.lag == pytest.approx(lag, rel=0.05)
    assert found.dead_time == pytest.approx(dead_time, abs=0.003)
    assert found.slew is None
    assert found.flaw() is None


@pytest.mark.parametrize(
    ("axis", "lag", "dead_time"),
    [("roll", 0.047, 0.040), ("pitch", 0.047, 0.040), ("yaw", 0.370, 0.102)],
)
def test_px4s_response_is_the_one_that_the_shipped_configurations_hold(px4, axis, lag, dead_time):
    found = px4[1].axes[axis]
    assert found.lag == pytest.approx(lag, rel=0.15)
    assert found.dead_time == pytest.approx(dead_time, abs=0.005)


def test_the_thrust_map_is_found_and_learning_the_hover_thrust_is_not_disturbed(px4):
    summary, vehicle = px4
    assert vehicle.thrust.flaw(GRAVITY) is None
    assert vehicle.thrust.slope == pytest.approx(19.55, rel=0.1)
    assert vehicle.thrust.normalised(GRAVITY) == pytest.approx(0.490, abs=0.005)
    assert summary.tracking()["height_rms_m"] < 0.05
    assert summary.tracking()["position_max_m"] < 0.5


def test_no_doublet_tilts_it_far(px4):
    tilts = []
    for message in tlog.messages(px4[0], "ATTITUDE_QUATERNION"):
        cosine = 1.0 - 2.0 * (message.q2**2 + message.q3**2)
        tilts.append(np.degrees(np.arccos(min(cosine, 1.0))))
    assert 10.0 < max(tilts) < 20.0


@pytest.mark.slow
def test_a_first_order_rate_loop_gives_back_its_configured_numbers(tmp_path):
    summary, vehicle = identified(tmp_path, **FIRST_ORDER)
    assert summary.result == "ok", summary.events
    configured = {"roll": (0.03, 0.02), "pitch": (0.08, 0.045), "yaw": (0.3, 0.08)}
    for axis, (lag, delay) in configured.items():
        found = vehicle.axes[axis]
        assert found.lag == pytest.approx(lag, rel=0.1), axis
        assert found.dead_time == pytest.approx(delay + SENSOR_DELAY, abs=0.003), axis
        assert found.gain == pytest.approx(1.0, abs=0.02), axis
        assert found.slew is None
    assert vehicle.flaws() == {}


@pytest.mark.slow
def test_another_vehicle_is_found_as_the_judge_finds_it(tmp_path):
    summary, vehicle = identified(tmp_path, **CHANGED)
    assert summary.result == "ok", summary.events
    for axis in AXES:
        lag, dead_time = judged(axis, CHANGED)
        assert vehicle.axes[axis].lag == pytest.approx(lag, rel=0.1), axis
        assert vehicle.axes[axis].dead_time == pytest.approx(dead_time, abs=0.005), axis


@pytest.mark.slow
def test_gusts_and_a_noisy_gyroscope_hardly_move_what_is_found(px4, tmp_path):
    summary, vehicle = identified(
        tmp_path, wind={"speed_m_s": 1.5, "gust_m_s": 0.7}, sensors={"rate_noise_rad_s": 0.02}
    )
    assert summary.result == "ok", summary.events
    for axis in AXES:
        calm, found = px4[1].axes[axis], vehicle.axes[axis]
        # Of eight flights, seeds 1 to 8, the farthest: 4.0 % and 0.9 ms.
        assert found.lag == pytest.approx(calm.lag, rel=0.05), axis
        assert found.dead_time == pytest.approx(calm.dead_time, abs=0.0015), axis
    assert vehicle.flaws() == {}


@pytest.mark.slow
def test_ardupilots_acceleration_limits_are_told_from_its_lags(tmp_path):
    summary, vehicle = identified(tmp_path, rate_loop="ardupilot", sensors={"rate_lag_ms": 11.0})
    assert summary.result == "ok", summary.events
    for axis, slew in (("roll", 1100.0), ("pitch", 1100.0), ("yaw", 270.0)):
        assert np.degrees(vehicle.axes[axis].slew) == pytest.approx(slew, rel=0.05)
    # As identified on ArduCopter; there roll's lag is longer and its dead time shorter.
    assert vehicle.roll.lag + vehicle.roll.dead_time == pytest.approx(0.0363, abs=0.003)
    assert vehicle.roll.lag == pytest.approx(0.021, abs=0.009)
    assert vehicle.yaw.lag + vehicle.yaw.dead_time == pytest.approx(0.199, abs=0.015)
    assert vehicle.yaw.lag == pytest.approx(0.056, abs=0.009)
    assert vehicle.flaws() == {}


def test_a_doublet_that_tilts_too_far_is_given_up_and_the_vehicle_lands():
    wind = {"speed_m_s": 5.0}  # it leans by 27° against this wind, and a doublet adds 15°
    with mock_vehicle(wind=wind) as mock:
        summary = fly(mock, flight={"maneuvers": ["identify"]})
        assert "identify was ended, because the vehicle tilts by 3" in summary.result, (
            summary.events
        )
        assert "°, more than limits.max_tilt_deg" in summary.result
        assert summary.phase == "maneuvers"
        state = mock.until(lambda state: not state["armed"])
        assert not state["crashed"]
        assert state["touchdown_speed"] < 1.5


def test_silence_in_a_doublet_ends_setpoints_at_once(tmp_path):
    fault = {"kind": "stop_telemetry", "after_offboard_s": 2.7}  # 0.1 s into the first doublet
    with mock_vehicle(tmp_path, faults=[fault]) as mock:
        summary = fly(mock, tmp_path / "log", flight={"maneuvers": ["identify"]})
        assert "no attitude from the vehicle" in summary.result
        assert not mock.state()["crashed"]
    *_, last = tlog.messages(summary, "SET_ATTITUDE_TARGET")
    assert abs(last.body_roll_rate) == pytest.approx(np.radians(30.0), rel=1e-6)
    struck = next(at for at, text in summary.events if text == "mode OFFBOARD") + 2.7
    assert last._timestamp <= struck + 0.02
