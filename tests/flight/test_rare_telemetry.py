"""Telemetry that becomes rare in flight is asked for again; if it stays rare: hand back."""

from math import acos, degrees

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.flight.observer import SilentObserver
from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

ATTITUDE_QUATERNION, LOCAL_POSITION_NED = 31, 32
SET_MESSAGE_INTERVAL = 511
CIRCLE = {
    "flight": {"maneuvers": ["hover", "circle"]},
    "hover": {"duration_s": 1.0},
    "circle": {"radius_m": 4.0, "speed_m_s": 3.5, "laps": 1},
    "limits": {"fence_radius_m": 30.0},
}
SHORT = {"hover": {"duration_s": 0.5}}
HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}


class Lowers(SilentObserver):
    """A ground station that sets a message's rate once a second, the first time on the circle."""

    def __init__(self, mock, message, hz, times):
        self.mock, self.message, self.hz, self.left, self.tilt = mock, message, hz, times, 0.0

    def waiting(self, name, waiting_for, elapsed, timeout):
        if name == "maneuvers" and elapsed > 2.5 and self.left:
            self.left -= 1
            self.mock.command(SET_MESSAGE_INTERVAL, self.message, 1e6 / self.hz)


def asked_again(summary):
    return [text for _, text in summary.events if "comes too rarely" in text]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("hz", [5.0, 12.0])
def test_attitude_lowered_once_is_asked_for_again_and_flown_on(autopilot, hz):
    with mock_vehicle(autopilot=autopilot) as mock:
        summary = fly(mock, None, Lowers(mock, ATTITUDE_QUATERNION, hz, 1), **CIRCLE)
    assert summary.result == "ok", summary.events
    (told,) = asked_again(summary)
    assert told == "ATTITUDE_QUATERNION comes too rarely: requesting 100 Hz again"
    assert summary.tracking()["position_max_m"] < 1.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("message", "hz", "words"),
    [
        (ATTITUDE_QUATERNION, 5.0, "setpoints paused 3 times within 5 s"),
        (ATTITUDE_QUATERNION, 12.0, "below link.min_attitude_rate_hz"),
        (LOCAL_POSITION_NED, 2.0, "below link.min_position_rate_hz"),
    ],
)
def test_what_stays_rare_is_handed_back(tmp_path, autopilot, message, hz, words):
    with mock_vehicle(tmp_path, autopilot=autopilot) as mock:
        summary = fly(mock, tmp_path / "log", Lowers(mock, message, hz, 20), **CIRCLE)
        state = mock.until(lambda state: state["mode"] == HELD[autopilot])
        assert not state["crashed"]
    assert words in summary.result, summary.events
    assert len(asked_again(summary)) == 1
    assert steepest(summary) < 45.0  # 35° are allowed; 53° it was where nobody watched


def connects(mock, every=None):
    """QGroundControl connects to ArduPilot, and again `every` so many s."""
    for group, hz in ((1, 2), (2, 2), (3, 2), (6, 3), (10, 10), (11, 10), (12, 3)):
        mock.transmit(dialect.MAVLink_request_data_stream_message(1, 1, group, hz, 1))
    if every is not None:
        mock.at(mock.time + every, lambda: connects(mock, every))


def test_a_station_that_lowers_positions_every_11_s_does_not_end_the_flight():
    """QGroundControl does so while no BATTERY_STATUS comes; the second time was handed back."""
    with mock_vehicle(autopilot="ardupilot") as mock:
        begin = When("maneuvers", lambda: connects(mock, every=11.0), after=1.0)
        summary = fly(mock, None, begin, hover={"duration_s": 14.0})
    assert summary.result == "ok", summary.events
    assert len(asked_again(summary)) == 2


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_attitude_lowered_by_one_program_after_another_is_asked_for_each_time(autopilot):
    with mock_vehicle(autopilot=autopilot) as mock:

        def lower():
            mock.command(SET_MESSAGE_INTERVAL, ATTITUDE_QUATERNION, 1e6 / 5.0)

        begin = When("maneuvers", lambda: (lower(), mock.at(mock.time + 5.5, lower)), after=1.0)
        summary = fly(mock, None, begin, hover={"duration_s": 8.5})
    assert summary.result == "ok", summary.events
    assert len(asked_again(summary)) == 2


@pytest.mark.parametrize(("phase", "after"), [("arm", 0.0), ("takeoff", 0.0), ("takeoff", 2.5)])
def test_a_station_that_connects_before_the_takeover_does_not_end_the_flight(phase, after):
    """The vehicle was landed for positions at 3 Hz, as if its link were too slow."""
    hover = {"duration_s": 1.5}
    with mock_vehicle(autopilot="ardupilot") as mock:
        summary = fly(mock, None, When(phase, lambda: connects(mock), after), hover=hover)
    assert summary.result == "ok", summary.events
    (told,) = asked_again(summary)
    assert told == "LOCAL_POSITION_NED comes too rarely: requesting 50 Hz again"


STATUSES = {
    "px4": {"GPS_RAW_INT": 24, "ESTIMATOR_STATUS": 230, "EXTENDED_SYS_STATE": 245},
    "ardupilot": {
        "HEARTBEAT": 0,  # PX4's cannot be stopped
        "GPS_RAW_INT": 24,
        "EKF_STATUS_REPORT": 193,
        "EXTENDED_SYS_STATE": 245,
    },
}


@pytest.mark.parametrize("autopilot", STATUSES)
def test_each_status_that_a_station_stopped_is_asked_for_again_and_flown_on(autopilot):
    """Otherwise the flight was landed, or waited for a touchdown that nobody reported."""
    statuses = STATUSES[autopilot]

    def stop():
        for number in statuses.values():
            mock.command(SET_MESSAGE_INTERVAL, number, -1.0)

    with mock_vehicle(autopilot=autopilot) as mock:
        summary = fly(mock, None, When("maneuvers", stop, 1.0), hover={"duration_s": 6.0})
    assert summary.result == "ok", summary.events
    told = [text.split(" comes too rarely: requesting ")[0] for text in asked_again(summary)]
    assert sorted(told) == sorted(statuses)  # each once


@pytest.mark.parametrize("phase", ["takeoff", "land"])
def test_a_heartbeat_that_a_station_stopped_ends_neither_take_off_nor_landing(phase):
    """The vehicle was left to its pilot, and armed after the landing."""
    with mock_vehicle(autopilot="ardupilot") as mock:
        stop = When(phase, lambda: mock.command(SET_MESSAGE_INTERVAL, 0, -1.0), 1.0)
        summary = fly(mock, None, stop, **SHORT)
        assert not mock.state()["armed"]
    assert summary.result == "ok", summary.events


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("phase", ["takeoff", "land"])
def test_a_serial_link_that_restarts_ends_neither_take_off_nor_landing(autopilot, phase):
    """ArduPilot was left climbing in GUIDED, armed, after a silence of 0.8 s."""
    with mock_vehicle(autopilot=autopilot) as mock:

        def restart():
            for direction in ("to_companion", "from_companion"):
                mock.inject({"kind": "drop", "direction": direction, "duration_s": 1.5})

        high = {"flight": {"takeoff_height_m": 6.0}}
        summary = fly(mock, None, When(phase, restart, 0.8), **high, **SHORT)
        assert not mock.state()["armed"]
    assert summary.result == "ok", summary.events


def test_a_silence_of_the_whole_link_is_no_reason_to_ask_for_a_status_again():
    with mock_vehicle(autopilot="ardupilot") as mock:
        lose = lambda: mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 0.7})  # noqa: E731
        summary = fly(mock, None, When("land", lose, 1.0), **SHORT)
    assert summary.result == "ok", summary.events
    assert not asked_again(summary)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_status_that_is_kept_stopped_still_lands_the_vehicle(autopilot):
    with mock_vehicle(autopilot=autopilot) as mock:
        stop = When("maneuvers", lambda: mock.after_step.append(keep_stopped), 1.0)
        keep_stopped = lambda: mock.command(SET_MESSAGE_INTERVAL, 24, -1.0)  # noqa: E731
        summary = fly(mock, None, stop, hover={"duration_s": 10.0})
    assert summary.result == "GPS is not reported any more", summary.events
    first, *later = [at for at, text in summary.events if "comes too rarely" in text]
    assert all(at - first >= 5.0 for at in later)
    assert len(later) <= 1
    assert not mock.state()["armed"]


def steepest(summary):
    """Largest tilt that was flown, degrees; from the recording."""
    attitudes = tlog.messages(summary, "ATTITUDE_QUATERNION")
    return degrees(acos(min(1.0 - 2.0 * (m.q2**2 + m.q3**2) for m in attitudes)))
