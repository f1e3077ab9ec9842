"""The navigation filter's errors against those measured on the real autopilots (with truth).

Figures are of 22 Nov 2026, telemetry against truth: PX4's log with its ground truth, ArduPilot's
SIM2. Per axis, the error at the frequency flown is a complex share of the speed; of the position it
has the unit s: the real part is minus its lateness.
"""

from math import cos, radians, sin

import numpy as np
import pytest

from sitl_mock.config.sensors import EKFS
from sitl_mock.physics.navigation_error import error_at
from sitl_mock.physics.navigation_filter import NavigationFilter
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle
from sitl_mock.settings import MockSettings

DT = 0.02
SETTLED_S = 40.0
LEVEL = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def standing(_):
    return (0.0, 0.0, 0.0, *LEVEL, 0.0, 0.0, -5.0, 0.0, 0.0, 0.0)


def circle(speed, w):
    """As flown: beginning northwards, turning to the west."""

    def at(t):
        c, s = cos(w * t), sin(w * t)
        place = (speed / w * s, -speed / w * (1.0 - c), -5.0)
        velocity = (speed * c, -speed * s, 0.0, *LEVEL)
        return (*velocity, *place, -speed * w * s, -speed * w * c, 0.0)

    return at


def eight(size, w):
    def at(t):
        c, s, c2, s2 = cos(w * t), sin(w * t), cos(2 * w * t), sin(2 * w * t)
        place = (size * s, 0.5 * size * s2, -5.0)
        velocity = (size * w * c, size * w * c2, 0.0, *LEVEL)
        return (*velocity, *place, -size * w * w * s, -2 * size * w * w * s2, 0.0)

    return at


def errors(config, way, seconds, seed=1):
    """(n, 10): time, position, velocity and rotation, the time in which the filter settles cut."""
    navigation = NavigationFilter(config, way(0.0), seed)
    late = round(config.fix_delay_ms * 1e-3 / DT)
    rows = []
    for step in range(round((SETTLED_S + seconds) / DT)):
        now = step * DT
        if step >= late and navigation.is_due(now - late * DT):
            navigation.advance(way(now - late * DT), now - late * DT, way(now), now)
        error = error_at(navigation.constants, navigation.state, way(now), now)
        rows.append((now, *error.position, *error.velocity, *error.attitude))
    return np.array(rows)[round(SETTLED_S / DT) :]


def share(rows, column, way, axis, w):
    """Complex amplitude at w of an error, per that of the true speed along an axis."""
    t = rows[:, 0]
    speed = np.array([way(each)[axis] for each in t])
    waves = np.array([np.ones_like(t), np.cos(w * t), np.sin(w * t)]).T
    (_, ec, es), (_, vc, vs) = (
        np.linalg.lstsq(waves, x, rcond=None)[0] for x in (rows[:, column], speed)
    )
    return complex(ec, -es) / complex(vc, -vs)


def without_noise(name, yaw_deg):
    """The filter with a heading that is off by as much as it was in the flight measured."""
    config = EKFS[name].model_copy(
        update={
            "position_noise_m": 0.0,
            "velocity_noise_m_s": 0.0,
            "tilt_noise_deg": 0.0,
            "height_noise_m": 0.0,
            "sink_noise_m_s": 0.0,
            "yaw_time_s": 1e12,
            "yaw_error_deg": 1.0,
            "compass_error_deg": 0.0,
            "turn_yaw_ms": 0.0,
        }
    )
    drawn = NavigationFilter(config, standing(0.0), 1).state.yaw
    return config.model_copy(update={"yaw_error_deg": yaw_deg / np.degrees(drawn)})


@pytest.mark.parametrize(
    ("name", "way", "axis", "w", "yaw_deg", "place", "speed"),
    [
        ("ardupilot", circle(2.0, 0.667), 0, 0.667, 1.23, -0.0150 + 0.0036j, 0.0068 - 0.0118j),
        ("ardupilot", circle(5.0, 1.0), 1, 1.0, 1.38, -0.0155 + 0.0040j, 0.0033 - 0.0175j),
        ("ardupilot", circle(8.0, 1.0), 0, 1.0, 1.22, -0.0160 + 0.0054j, 0.0005 - 0.0152j),
        ("ardupilot", eight(3.1, 1.179), 0, 1.179, -0.12, -0.0100 + 0.0193j, -0.0104 + 0.0105j),
        ("ardupilot", eight(3.1, 1.179), 1, 2.357, -0.12, 0.0025 + 0.0186j, -0.0040 + 0.0164j),
        ("px4", circle(5.0, 1.0), 0, 1.0, -0.27, 0.0030 + 0.0024j, 0.0000 + 0.0055j),
        ("px4", circle(8.0, 1.0), 1, 1.0, -0.13, 0.0019 + 0.0023j, 0.0002 + 0.0041j),
    ],
)
def test_errors_in_motion_are_those_measured(name, way, axis, w, yaw_deg, place, speed):
    """In hundredths of a second, and in percent: within one."""
    rows = errors(without_noise(name, yaw_deg), way, 40.0)
    assert abs(share(rows, 1 + axis, way, axis, w) - place) < 0.0105
    assert abs(share(rows, 4 + axis, way, axis, w) - speed) < 0.0105


def quiet(name):
    noise = (
        "position_noise_m",
        "velocity_noise_m_s",
        "tilt_noise_deg",
        "height_noise_m",
        "sink_noise_m_s",
    )
    silent = dict.fromkeys((*noise, "yaw_error_deg"), 0.0)
    return EKFS[name].model_copy(update=silent)


def test_a_turn_teaches_a_wrong_heading():
    """Measured on ArduPilot: 0.9 to 1.4 degrees within 5 s of a circle; 0.6 in a figure-eight."""
    way = circle(5.0, 1.0)
    rows = errors(quiet("ardupilot"), way, 60.0)
    assert np.degrees(rows[[200, -1], 9]) == pytest.approx(1.15, abs=0.25)
    assert abs(share(rows, 1, way, 0, 1.0) - (-0.0155 + 0.0040j)) < 0.0055
    rows = errors(quiet("ardupilot"), eight(3.1, 1.179), 60.0)
    assert abs(np.degrees(rows[:, 9]).mean()) < 0.6


def test_after_a_calm_an_acceleration_corrects_the_heading():
    """Measured on ArduPilot: from 0.75 to -0.5 degrees within a second, after 20 s of hover."""

    def start(t):
        flown = max(0.0, t - SETTLED_S - 5.0)
        motion = (6.0 * flown, 0.0, 0.0, *LEVEL)
        return (*motion, 3.0 * flown**2, 0.0, -5.0, 6.0 * (flown > 0.0), 0.0, 0.0)

    heading = np.degrees(errors(quiet("ardupilot"), start, 7.0)[:, 9])
    calm, a_second_later = heading[round(5.0 / DT)], heading[round(6.0 / DT)]
    alone = EKFS["ardupilot"].compass_error_deg * (1.0 - np.exp(-2.25))
    assert calm == pytest.approx(alone, abs=0.02)
    assert a_second_later < 0.5
    assert np.abs(np.diff(heading)).max() < 0.1


def test_a_tilted_attitude_takes_a_turn_for_a_climb():
    """Measured on ArduPilot in circles: 11 mm and 15 mm/s at 5 m/s, 17 mm and 24 mm/s at 8 m/s."""
    for speed, height, climb in ((5.0, 0.011, 0.015), (8.0, 0.017, 0.024)):
        way = circle(speed, 1.0)
        rows = errors(quiet("ardupilot"), way, 40.0)
        assert abs(share(rows, 3, way, 0, 1.0)) * speed == pytest.approx(height, rel=0.3)
        assert abs(share(rows, 6, way, 0, 1.0)) * speed == pytest.approx(climb, rel=0.3)
    assert np.ptp(errors(quiet("ardupilot"), standing, 10.0)[:, 3]) < 1e-9


def test_the_lateness_of_fixes_slips():
    """Measured on ArduPilot in circles: by 10 ms within 14 s, as the mean of 3.5 s."""
    way = circle(5.0, 1.0)
    rows = errors(quiet("ardupilot"), way, 28.0)
    velocity = np.array([way(t)[:2] for t in rows[:, 0]])
    late = -1e3 * np.sum(rows[:, 1:3] * velocity, axis=1) / 25.0
    late = np.convolve(late, np.full(175, 1 / 175), "valid")
    assert np.ptp(late) == pytest.approx(10.0, abs=2.5)
    assert late.mean() == pytest.approx(17.0, abs=3.0)


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_a_fix_makes_no_step(name):
    """Between two positions the real ones change by less than 2 mm more than before and after."""
    position = errors(quiet(name), circle(8.0, 1.0), 5.0)[:, 1:3]
    assert np.linalg.norm(np.diff(position, n=2, axis=0), axis=1).max() <= 2e-3


@pytest.mark.parametrize(("speed", "lower", "sink"), [(5.0, 0.020, 0.022), (8.0, 0.055, 0.032)])
def test_px4s_height_and_climb_are_wrong_in_a_curve(speed, lower, sink):
    rows = errors(quiet("px4"), circle(speed, 1.0), 10.0)
    assert rows[:, 3].mean() == pytest.approx(lower, rel=0.25)
    assert rows[:, 6].mean() == pytest.approx(sink, rel=0.25)


def spreads(name):
    """Standard deviations in hover of position and velocity, over some flights of a minute."""
    flights = [errors(EKFS[name], standing, 60.0, seed)[:, 1:7] for seed in range(8)]
    return np.mean([np.std(flight, axis=0) for flight in flights], axis=0)


@pytest.mark.parametrize(
    ("name", "place", "height", "speed"),
    [("px4", 0.021, 0.034, 0.0185), ("ardupilot", 0.0052, 0.0115, 0.0033)],
)
def test_errors_in_hover_are_those_measured(name, place, height, speed):
    spread = spreads(name)
    assert spread[:2] == pytest.approx(place, rel=0.3)
    assert spread[2] == pytest.approx(height, rel=0.4)
    assert spread[3:5] == pytest.approx(speed, rel=0.3)


def test_errors_last_for_seconds():
    """Measured on PX4 in a hover: 0.78 after 1 s, 0.46 after 2 s, nothing left after 4 to 8 s."""
    rows = errors(EKFS["px4"], standing, 400.0)[:, 1:7]
    rows -= rows.mean(axis=0)

    def kept(seconds):
        late = round(seconds / DT)
        return (rows[:-late] * rows[late:]).mean(axis=0) / rows.var(axis=0)

    assert np.all(kept(DT) > 0.99)
    assert np.all((kept(1.0) > 0.6) & (kept(1.0) < 0.97))
    assert np.all(np.abs(kept(8.0)) < 0.4)


def test_height_is_off_by_a_constant():
    rows = errors(EKFS["ardupilot"], standing, 60.0)
    assert rows[:, 3].mean() == pytest.approx(0.10, abs=0.01)


def test_the_errors_are_a_function_of_the_seed():
    first, again, other = (errors(EKFS["px4"], standing, 1.0, seed) for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.allclose(first, other)


def flown(**sensors):
    settings = MockSettings.model_validate({"sensors": sensors})
    vehicle = Vehicle(sensors=settings.sensors, seed=5)
    for step in range(3000):
        vehicle.step(ActuatorCommand(True, 0.2 if step < 1500 else -0.2, 0.0, 0.0, 0.52))
        if step % 4 == 0:
            vehicle.estimate()
    return vehicle.truth, vehicle.estimate()


def test_each_autopilot_has_its_own_and_none_is_none():
    for autopilot in ("px4", "ardupilot"):
        settings = MockSettings.model_validate({"autopilot": autopilot})
        assert settings.sensors.ekf == EKFS[autopilot]
        assert settings.sensors.position_noise_m == settings.sensors.position_delay_ms == 0.0
    other = MockSettings.model_validate({"sensors": {"ekf": "ardupilot"}})
    assert other.sensors.ekf == EKFS["ardupilot"]
    white = MockSettings.model_validate({"sensors": {"ekf": "none"}}).sensors
    assert (white.ekf, white.position_noise_m, white.position_delay_ms) == (None, 0.01, 10.0)


def test_the_estimate_carries_the_errors_and_the_vehicle_does_not():
    truth, estimate = flown()
    exact, plain = flown(
        ekf="none", position_noise_m=0.0, velocity_noise_m_s=0.0, position_delay_ms=0.0
    )
    assert plain.position_ned == exact.position_ned == truth.position_ned
    off = np.subtract(estimate.position_ned, truth.position_ned)
    assert 1e-4 < np.abs(off).max() < 0.15
    wrong = np.subtract(estimate.velocity_ned, truth.velocity_ned)
    assert 1e-4 < np.abs(wrong).max() < 0.2
    assert 0.0 < abs(np.dot(estimate.q, truth.q) - 1.0) < radians(2.0) ** 2
