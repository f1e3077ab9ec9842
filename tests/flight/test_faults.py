"""Every fault, in flight: a stated reason, the autopilot in charge, no setpoint out of turn."""

import pytest

from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

CONTROL = {"after_offboard_s": 2.0}
HANDED_BACK = {"LOITER", "LAND", "RTL"}


def setpoint_times(summary):
    return [message._timestamp for message in tlog.messages(summary, "SET_ATTITUDE_TARGET")]


FAULTS = [
    # name, fault, words in the result, modes the vehicle may be in afterwards, and how long after
    # the fault the last setpoint may leave, s
    ("silence", {"kind": "stop_telemetry"}, "no attitude from the vehicle", HANDED_BACK, 0.0),
    (
        "attitude silence",
        {"kind": "stop_telemetry", "messages": ["ATTITUDE_QUATERNION"]},
        "no attitude from the vehicle",
        HANDED_BACK,
        0.0,
    ),
    (
        "position silence",
        {"kind": "stop_telemetry", "messages": ["LOCAL_POSITION_NED"]},
        "no position from the vehicle",
        HANDED_BACK,
        0.45,
    ),
    ("drop all", {"kind": "drop"}, "no attitude from the vehicle", HANDED_BACK, 0.0),
    (
        "drop downlink",
        {"kind": "drop", "direction": "to_companion"},
        "no attitude from the vehicle",
        HANDED_BACK,
        0.0,
    ),
    (
        "drop uplink",
        {"kind": "drop", "direction": "from_companion"},
        "setpoints do not reach the vehicle",
        HANDED_BACK,
        1.3,
    ),
    (
        "delay",
        {"kind": "delay", "delay_ms": 400.0, "direction": "to_companion"},
        "attitude arrives, but older",
        HANDED_BACK,
        0.0,
    ),
    ("corrupt all", {"kind": "corrupt"}, "no attitude from the vehicle", HANDED_BACK, 0.0),
    ("freeze", {"kind": "freeze_clock"}, "the vehicle's clock stands still", HANDED_BACK, 0.0),
    (
        "nan attitude",
        {"kind": "nan_field", "message": "ATTITUDE_QUATERNION", "field": "q2"},
        "the vehicle's attitude is not finite",
        HANDED_BACK,
        0.0,
    ),
    (
        "nan rate",
        {"kind": "nan_field", "message": "ATTITUDE_QUATERNION", "field": "rollspeed"},
        "the vehicle's attitude is not finite",
        HANDED_BACK,
        0.0,
    ),
    (
        "nan position",
        {"kind": "nan_field", "message": "LOCAL_POSITION_NED", "field": "x"},
        "the vehicle's position is not finite",
        HANDED_BACK,
        0.45,
    ),
    (
        "pilot",
        {"kind": "pilot_takeover", "mode": "POSCTL"},
        "the pilot or another station took over: mode POSCTL",
        {"POSCTL"},
        0.12,
    ),
    (
        "pilot by hand",
        {"kind": "pilot_takeover", "mode": "STABILIZED"},
        "the pilot or another station took over: mode STABILIZED",
        {"STABILIZED"},
        0.12,
    ),
    (
        "estimator",
        {"kind": "estimator_reset", "yaw_deg": 30.0, "position_ned_m": [2.0, 0.0, 0.0]},
        "estimator was reset",
        HANDED_BACK,
        1.2,
    ),
    ("battery", {"kind": "low_battery", "remaining": 0.15}, "battery at 15 %", HANDED_BACK, 1.5),
    ("gps", {"kind": "gps_loss"}, "GPS position lost", HANDED_BACK, 0.5),
]


@pytest.mark.parametrize(
    ("fault", "words", "modes", "latest"),
    [row[1:] for row in FAULTS],
    ids=[row[0] for row in FAULTS],
)
def test_a_fault_in_flight_ends_in_its_stated_way(tmp_path, fault, words, modes, latest):
    with mock_vehicle(tmp_path, faults=[{**fault, **CONTROL}]) as mock:
        since_control = set()

        def note_mode():
            since_control.add(mock.state()["mode"])

        observer = When("maneuvers", lambda: mock.after_step.append(note_mode))
        summary = fly(mock, tmp_path / "log", observer, hover={"duration_s": 4.0})
        assert words in summary.result, summary.events
        assert summary.phase == "maneuvers"
        # Where nothing is heard nothing is commanded: the autopilot's own failsafe comes by itself.
        state = mock.until(lambda _: since_control & modes)
        assert not state["crashed"]
    times = setpoint_times(summary)
    began = next(at for at, text in summary.events if text == "mode OFFBOARD")
    struck = began + 2.0  # at the latest: the mode was told up to 0.1 s after it was entered
    assert times[-1] <= struck + latest + 0.02


MILD = [
    {"kind": "drop", "probability": 0.2},
    {"kind": "duplicate", "probability": 0.5},
    {"kind": "reorder", "probability": 0.3},
    {"kind": "corrupt", "probability": 0.05},
    {"kind": "delay", "probability": 0.1, "delay_ms": 30.0},
    {"kind": "stop_telemetry", "duration_s": 0.3},
]


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param(
            fault,
            id=fault["kind"],
            marks=() if fault["kind"] in ("drop", "delay") else pytest.mark.slow,
        )
        for fault in MILD
    ],
)
def test_a_mild_fault_is_flown_through_and_counted(fault):
    with mock_vehicle(faults=[{**fault, **CONTROL}]) as mock:
        summary = fly(mock)
        assert summary.result == "ok", summary.events
        assert not mock.state()["crashed"]
    link = summary.link
    counted = {
        "drop": link["lost"],
        "duplicate": link["repeated"],
        "reorder": link["repeated"],
        "corrupt": link["bad_crc"],
        "delay": link["repeated"],
        "stop_telemetry": summary.counts.stale,
    }
    assert counted[fault["kind"]] > 0
    assert summary.counts.setpoints <= summary.counts.samples


def test_refused_arming_says_why():
    """It was ready at the checks; its pre-arm checks fail before we arm, so we do not try."""
    refusal = {"kind": "refuse_arming", "reason": "system power unavailable", "at_s": 1.4}
    with mock_vehicle(faults=[refusal]) as mock:
        summary = fly(mock)
        assert not mock.state()["armed"]
    assert summary.phase == "arm"
    assert "not ready to be armed, it lacks the autopilot's pre-arm checks" in summary.result


def test_a_vehicle_that_never_gets_ready_is_left_alone():
    with mock_vehicle(faults=[{"kind": "refuse_arming"}]) as mock:
        summary = fly(mock, flight={"ready_timeout_s": 3.0})
        assert not mock.state()["armed"]
    assert summary.phase == "checks"
    assert "the autopilot's pre-arm checks" in summary.result


def test_a_flat_battery_is_not_armed():
    with mock_vehicle(faults=[{"kind": "low_battery", "remaining": 0.1}]) as mock:
        summary = fly(mock)
        assert not mock.state()["armed"]
    assert summary.phase == "checks"
    assert "battery at 10 %" in summary.result
