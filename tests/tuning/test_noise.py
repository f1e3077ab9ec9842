"""Disturbances in a log whose noise is known, because it was made here."""

import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from companion.mavlink.errors import LogError
from companion.tuning.expectation import Disturbances
from companion.tuning.noise import measured_disturbances

USUAL = Disturbances()
RATE = 50.0
SECONDS = 64.0


class Log:
    """A `.tlog` that is written message by message."""

    def __init__(self, path):
        self.path = path
        self._file = path.open("wb")

    def add(self, message, time, system=1):
        frame = message.pack(common.MAVLink(None, system, 1))
        self._file.write(struct.pack(">Q", round(1e6 * time)) + bytes(frame))

    def heartbeat(self, system=1, autopilot=common.MAV_AUTOPILOT_PX4):
        beat = common.MAVLink_heartbeat_message(2, autopilot, 0, 0, 4, 3)
        self.add(beat, 0.0, system)

    def closed(self):
        self._file.close()
        return self.path


def flown(log, position, velocity, *, height=5.0, seconds=SECONDS, system=1):
    """A level flight; `position` and `velocity` give (n, 2) at n times of telemetry."""
    times = np.arange(0.0, seconds, 1.0 / RATE)
    place, speed = position(len(times)), velocity(len(times))
    ground = common.MAVLink_local_position_ned_message(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    log.add(ground, 0.0, system)
    for time, (north, east), (v_north, v_east) in zip(times + 1.0, place, speed, strict=True):
        boot_ms = round(1e3 * time)
        level = common.MAVLink_attitude_quaternion_message(boot_ms, 1.0, 0, 0, 0, 0, 0, 0)
        log.add(level, time, system)
        at = (boot_ms, north, east, -height, v_north, v_east, 0.0)
        log.add(common.MAVLink_local_position_ned_message(*at), time, system)


def white(sd, seed):
    return lambda count: np.random.default_rng(seed).normal(0.0, sd, (count, 2))


def still(count):
    return np.zeros((count, 2))


@pytest.fixture
def log(tmp_path):
    return Log(tmp_path / "flight.tlog")


def test_the_noise_of_single_messages_is_found_and_is_no_wander(log):
    log.heartbeat()
    flown(log, white(0.01, 1), white(0.02, 2))
    found = measured_disturbances(log.closed(), 0.0, USUAL)
    assert found.position_noise == pytest.approx(0.01, rel=0.15)
    assert found.velocity_noise == pytest.approx(0.02, rel=0.15)
    assert found.velocity_density < 0.01
    assert found.source == log.path.parent.name


def test_a_position_that_moves_by_itself_wanders(log):
    """White noise of speed with a density of 0.03 m/s per √Hz, which the velocity does not tell."""
    density = 0.03
    steps = white(density * np.sqrt(RATE / 2.0), 3)
    log.heartbeat()
    flown(log, lambda count: np.cumsum(steps(count), axis=0) / RATE, still)
    found = measured_disturbances(log.closed(), 0.0, USUAL)
    assert found.velocity_density == pytest.approx(density, rel=0.2)
    assert found.acceleration_density == pytest.approx(0.0, abs=1e-6)


def test_pushes_that_the_tilt_does_not_explain_shake(log):
    """White noise of acceleration with a density of 0.2 m/s² per √Hz, on a level vehicle."""
    density = 0.2
    pushes = white(density * np.sqrt(RATE / 2.0), 4)

    def speed(count):
        return np.cumsum(pushes(count), axis=0) / RATE

    log.heartbeat()
    flown(log, lambda count: np.cumsum(speed(count), axis=0) / RATE, speed)
    assert measured_disturbances(log.closed(), 0.0, USUAL).acceleration_density == pytest.approx(
        density, rel=0.2
    )


@pytest.mark.parametrize(
    "change",
    [
        {"height": 0.5},  # it stood on the ground
        {"seconds": 6.0},
        {"system": 2},  # the heartbeat is of another system
    ],
)
def test_with_too_little_flight_the_usual_disturbances_stay(log, change):
    log.heartbeat()
    flown(log, white(0.01, 1), white(0.02, 2), **change)
    assert measured_disturbances(log.closed(), 0.0, USUAL) == USUAL


def test_a_ground_station_is_no_vehicle(log):
    log.heartbeat(system=255, autopilot=common.MAV_AUTOPILOT_INVALID)
    log.heartbeat()
    flown(log, white(0.01, 1), white(0.02, 2))
    assert measured_disturbances(log.closed(), 0.0, USUAL) != USUAL


def test_what_is_no_log_is_refused(tmp_path):
    path = tmp_path / "flight.tlog"
    path.write_text("north,east\n" * 100)
    with pytest.raises(LogError, match=r"flight\.tlog"):
        measured_disturbances(path, 0.0, USUAL)
