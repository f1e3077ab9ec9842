"""The tools of fuzzing notice what they are there to notice."""

import time
from itertools import repeat
from math import nan

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.config import Config
from tests.fuzz.family import PX4
from tests.fuzz.judge import Judge
from tests.fuzz.target import MEMORY_BYTES, HungError, bounded_memory, watchdog
from tests.fuzz.vehicle import Vehicle

COMPANION, AUTOPILOT = dialect.MAVLink(None, 1, 191), dialect.MAVLink(None, 1, 1)


class Flown:
    """A judge over an armed vehicle, told what passes between it and a flight."""

    def __init__(self):
        self.vehicle = Vehicle(PX4)
        self.vehicle.armed = True
        self.judge = Judge(self.vehicle, Config().model_dump(mode="json"))
        self.now = 50.0

    def sample(self, *, age=0.0):
        self.now += 0.004
        message = self.vehicle.message("ATTITUDE_QUATERNION")
        self.vehicle.boot_s += 0.004
        self.judge.arrives(message.pack(AUTOPILOT), self.now - age, self.now)
        return message.time_boot_ms

    def setpoint(self, stamp, rates=(0.1, 0.0, 0.0), thrust=0.5):
        message = dialect.MAVLink_set_attitude_target_message(
            stamp, 1, 1, 128, [1.0, 0.0, 0.0, 0.0], *rates, thrust
        )
        self.judge.sent(message.pack(COMPANION))

    def command(self, number):
        message = dialect.MAVLink_command_long_message(1, 1, number, 0, *(0.0,) * 7)
        self.judge.sent(message.pack(COMPANION))

    def heartbeat(self, mode):
        self.vehicle.mode = mode
        frame = self.vehicle.message("HEARTBEAT").pack(AUTOPILOT)
        self.judge.arrives(frame, self.now, self.now)


@pytest.fixture
def flown():
    flown = Flown()
    flown.command(dialect.MAV_CMD_NAV_TAKEOFF)
    flown.setpoint(flown.sample())
    assert flown.judge.faults == []
    return flown


@pytest.mark.parametrize(
    ("rates", "thrust", "words"),
    [
        ((nan, 0.0, 0.0), 0.5, "not finite"),
        ((0.0, 0.0, 0.0), nan, "not finite"),
        ((2.0, 0.0, 0.0), 0.5, "tilt rate"),
        ((0.0, 0.0, -2.0), 0.5, "yaw rate"),
        ((0.1, 0.0, 0.0), 0.95, "thrust"),
        ((0.1, 0.0, 0.0), 0.0, "thrust"),
        ((0.0, 0.0, 0.0), 0.0, "no thrust after the take-off"),
    ],
)
def test_a_setpoint_outside_the_limits_is_noticed(flown, rates, thrust, words):
    flown.setpoint(flown.sample(), rates, thrust)
    assert words in flown.judge.faults[0]


def test_a_second_answer_and_one_that_answers_nothing_are_noticed(flown):
    stamp = flown.sample()
    flown.setpoint(stamp)
    flown.setpoint(stamp)
    assert "again: True" in flown.judge.faults[0]
    flown.judge.delivered()
    flown.setpoint(stamp + 4)
    assert flown.judge.faults[-1] == "a setpoint that answers nothing"


def test_an_answer_to_an_old_sample_is_noticed(flown):
    flown.setpoint(flown.sample(age=0.3))
    assert "0.300 s old" in " ".join(flown.judge.faults)


def test_what_is_sent_after_a_takeover_or_the_flight_is_noticed(flown):
    flown.heartbeat(PX4.foreign[0])
    flown.setpoint(flown.sample())
    flown.command(dialect.MAV_CMD_NAV_LAND)
    assert [fault.split(" after")[0] for fault in flown.judge.faults] == [
        "a setpoint",
        "command 21",
    ]
    flown.judge.over = True
    flown.command(dialect.MAV_CMD_NAV_LAND)
    assert flown.judge.faults[-1] == "command 21 after the flight"


def _run_for_ever():
    for _ in repeat(None):
        pass


@pytest.mark.parametrize("what", [_run_for_ever, lambda: time.sleep(60)])
def test_what_runs_or_waits_for_ever_is_ended(what):
    with pytest.raises(HungError), watchdog(0.05):
        what()


def test_memory_is_bounded():
    """It is addresses that are bounded: nobody has to fill them."""
    part = MEMORY_BYTES // 16
    with bounded_memory():
        taken = [bytes(part) for _ in range(12)]
        with pytest.raises(MemoryError):
            taken += [bytes(part) for _ in range(12)]
