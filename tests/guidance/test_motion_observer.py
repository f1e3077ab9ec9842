"""The observer on a vehicle in wind, sampled and noisy."""

import numpy as np
import pytest

from companion.guidance.motion_observer import MotionObserver, ObserverSettings
from companion.guidance.reference import VehicleMotion

SETTINGS = ObserverSettings(
    bandwidth=4.0, position_time=0.1, position_coupling=4.0, largest_disturbance=6.0
)


def flown(wind, seconds=4.0, dt=1.0 / 30.0, noise=0.0, drag=1.0, seed=1, settings=SETTINGS):
    """Thrust that swings, drag against the air: the observer knows thrust and drag on its speed."""
    rng, observer = np.random.default_rng(seed), MotionObserver(settings)
    p, v, rows = np.zeros(2), np.array([1.0, -0.5]), []
    sub = 40
    for n in range(round(seconds / dt)):
        knowns = []
        for k in range(sub):
            t = (n + k / sub) * dt
            thrust = np.array([2.0 * np.sin(2.0 * t), np.cos(1.3 * t)])
            air = np.asarray(wind(t))
            knowns.append(thrust - drag * v)
            v = v + dt / sub * (thrust - drag * (v - air))
            p = p + dt / sub * v
        seen_p, seen_v = p + noise * rng.normal(size=2), v + noise * rng.normal(size=2)
        time, known = (n + 1) * dt, tuple(np.mean(knowns, axis=0))
        measured = VehicleMotion((*seen_p, -3.0), (*seen_v, 0.2))
        observer.observe(time, measured, known)
        motion = observer.at(time, known)
        rows.append(
            (*observer.disturbance, *motion.position_ned[:2] - p, *motion.velocity_ned[:2] - v)
        )
    return np.array(rows)


def test_a_steady_wind_is_found():
    rows = flown(lambda _: (3.0, -1.0))
    assert rows[-1, :2] == pytest.approx((3.0, -1.0), abs=0.05)
    settled = np.abs(rows[:, 0] - 3.0) < 0.3
    assert settled[45:].all()  # 1.5 s, at 4 rad/s


def test_without_wind_it_sees_none_and_position_and_speed_are_right():
    rows = flown(lambda _: (0.0, 0.0))
    assert np.abs(rows).max() <= 0.02


def test_noise_makes_little_wind():
    rows = flown(lambda _: (0.0, 0.0), seconds=20.0, noise=0.01)
    assert rows[60:, :2].std() <= 0.1
    assert rows[60:, 2:4].std() <= 0.01


def test_the_disturbance_is_bounded():
    rows = flown(lambda _: (30.0, 0.0))
    assert np.hypot(*rows[:, :2].T).max() <= 6.0 + 1e-9
    assert rows[-1, 0] == pytest.approx(6.0, abs=0.1)


def test_it_moves_on_from_the_newest_measurement():
    observer = MotionObserver(SETTINGS)
    observer.observe(1.0, VehicleMotion((1.0, 2.0, 3.0), (0.5, 0.0, -0.1)), (0.0, 0.0))
    motion = observer.at(1.2, (2.0, -1.0))
    assert motion.position_ned == pytest.approx((1.0 + 0.1 + 0.04, 2.0 - 0.02, 3.0 - 0.02))
    assert motion.velocity_ned == pytest.approx((0.9, -0.2, -0.1))


def test_between_measurements_it_moves_by_velocity_and_half_the_acceleration():
    """An observer that believes no measurement: p + v·dt + ½·a·dt², v + a·dt."""
    observer = MotionObserver(ObserverSettings(1e-12, 1e12, 0.0, 6.0))
    observer.observe(1.0, VehicleMotion((1.0, 2.0, 3.0), (0.5, 0.0, 0.0)), (0.0, 0.0))
    observer.observe(1.5, VehicleMotion((9.0, 9.0, 9.0), (9.0, 9.0, 9.0)), (2.0, -1.0))
    motion = observer.at(1.5, (0.0, 0.0))
    assert motion.position_ned == pytest.approx((1.0 + 0.25 + 0.25, 2.0 - 0.125, 9.0))
    assert motion.velocity_ned == pytest.approx((1.5, -0.5, 9.0))


def test_after_a_gap_the_motion_is_the_measured_one():
    observer = MotionObserver(SETTINGS)
    assert observer.at(0.0, (0.0, 0.0)) is None
    for n in range(60):
        position, velocity = (1.5 * (n / 30) ** 2, 0.0, 0.0), (n / 10, 0.0, 0.0)
        observer.observe(n / 30, VehicleMotion(position, velocity), (0.0, 0.0))
    assert observer.disturbance[0] == pytest.approx(3.0, abs=0.1)
    after = VehicleMotion((9.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    observer.observe(10.0, after, (0.0, 0.0))
    assert observer.at(10.0, (0.0, 0.0)) == after


@pytest.mark.parametrize("hz", [2.0, 5.0, 8.0])
def test_with_rare_positions_a_strong_pull_is_still_stable(hz):
    quick = ObserverSettings(9.0, 0.1, position_coupling=13.0, largest_disturbance=6.0)
    rows = flown(lambda _: (1.0, 0.0), seconds=20.0, dt=1.0 / hz, settings=quick)
    assert np.abs(rows[len(rows) // 2 :, :2] - (1.0, 0.0)).max() <= 0.5
    assert np.abs(rows[len(rows) // 2 :, 2:]).max() <= 0.5


def test_a_gap_in_the_positions_makes_no_false_wind():
    quick, found = ObserverSettings(9.0, 0.1, position_coupling=13.0, largest_disturbance=6.0), []
    for gap in (0.02, 0.3):
        observer = MotionObserver(quick)
        observer.observe(0.0, VehicleMotion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.0, 0.0))
        moved = VehicleMotion((0.5 * gap**2, 0.0, 0.0), (gap, 0.0, 0.0))  # by a wind of 1 m/s²
        observer.observe(gap, moved, (0.0, 0.0))
        found.append(observer.disturbance[0])
    assert max(found) <= 1.25
