"""What a flight leaves behind besides its figures: events in the log, motion, phases, its end."""

import errno
import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from pymavlink import mavutil

from companion.flight.observer import SilentObserver
from companion.recording.closing_words import Invocation, closing_words
from companion.recording.flight_record import read_flight
from companion.recording.folder import space_warning
from companion.testing import fly
from tests.flight.fly import QUICK_FLIGHT, QuickVehicle, merged

SHORT = {
    "flight": {"maneuvers": ["hover", "steps"]},
    "hover": {"duration_s": 2.0},
    "steps": {"duration_s": 0.3, "settle_s": 0.5},
}
LOG = mavutil.mavlink.MAV_COMP_ID_LOG


class Watching(SilentObserver):
    """Keeps the states and the events that are shown."""

    def __init__(self):
        self.states, self.events = [], []

    def status(self, status):
        self.states.append(status)

    def event(self, time, text):
        self.events.append(text)


def flown(folder, **changes):
    observer = Watching()
    config = merged(merged(QUICK_FLIGHT, SHORT), changes)
    return fly(config, QuickVehicle(), folder, observer), observer


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("good"))


def logged(summary):
    """All messages of the log, as pymavlink reads them."""
    log = mavutil.mavlink_connection(str(summary.log / "flight.tlog"))
    return list(iter(log.recv_match, None))


@pytest.fixture(scope="module")
def log_of_good(good):
    return logged(good[0])


def own_texts(messages):
    """(time, text) of our STATUSTEXTs among the messages, with their pieces joined."""
    texts, times = [], []
    for message in messages:
        times.append(message._timestamp)
        if message.get_type() != "STATUSTEXT" or message.get_srcComponent() != LOG:
            continue
        if message.chunk_seq:
            texts[-1] = texts[-1][0], texts[-1][1] + message.text
        else:
            texts.append((message._timestamp, message.text))
    assert times == sorted(times)
    return texts


def test_every_event_and_phase_is_in_the_log_at_its_time(good, log_of_good):
    summary, _ = good
    texts = own_texts(log_of_good)
    began = texts[0][0]
    phases = [text for _, text in texts if text.startswith("phase: ")]
    assert phases == [f"phase: {each['name']}" for each in summary.as_dict()["phases"]]
    events = [(time - began, text) for time, text in texts if not text.startswith("phase: ")]
    assert [text for _, text in events] == [text for _, text in summary.events]
    assert [time for time, _ in events] == pytest.approx(
        [time for time, _ in summary.events], abs=0.01
    )
    assert any(len(text) > 100 for _, text in events)  # in several pieces


def test_the_vehicle_receives_no_text_of_ours(log_of_good):
    sent = {message.get_type() for message in log_of_good if message.get_srcComponent() == 191}
    assert "SET_ATTITUDE_TARGET" in sent
    assert "STATUSTEXT" not in sent


def test_the_summary_tells_each_maneuver_and_keeps_the_old_keys(good):
    summary, _ = good
    told = json.loads((summary.log / "summary.json").read_text())
    hover, steps = told["maneuvers"]
    assert (hover["name"], hover["open_loop"], steps["name"]) == ("hover", False, "steps")
    assert hover["level_rms_m"] < 0.1
    assert (steps["level_rms_m"], steps["open_loop"]) == (None, True)
    assert steps["begin_s"] - hover["begin_s"] == pytest.approx(2.0, abs=0.05)
    assert told["tracking"].keys() == {"position_rms_m", "position_max_m", "height_rms_m"}
    assert told["verdict"]["good"] == all(check["good"] for check in told["verdict"]["checks"])
    assert told["lockstep"]
    assert told["early_end"] is None


def test_the_motion_is_recorded_from_the_ground_to_the_ground(good):
    summary, _ = good
    rows = read_flight(summary.log).rows("motion")
    assert np.diff(rows["time_s"]) == pytest.approx(0.1, abs=0.03)
    heights = rows["height_m"][~np.isnan(rows["height_m"])]
    assert heights[0] == pytest.approx(0.0, abs=0.2)
    assert heights.max() == pytest.approx(2.0, abs=0.2)
    assert heights[-1] == pytest.approx(0.0, abs=0.2)
    assert summary.extent()["tilt_max_deg"] > 5.0
    takeoff_time = summary.facts.takeoff_time
    begun = {name: time for time, name in summary.facts.phases}
    assert begun["takeoff"] < takeoff_time < begun["offboard"]


def test_the_state_is_shown_in_every_phase(good):
    _summary, observer = good
    shown = {state.phase for state in observer.states}
    assert {"checks", "takeoff", "maneuvers", "land"} <= shown
    flying = [state for state in observer.states if state.maneuver == "hover"]
    assert len(flying) == pytest.approx(20, abs=3)
    assert all(state.monitored and state.alarms == () for state in flying)
    assert flying[-1].setpoint_rate == pytest.approx(100.0, rel=0.05)
    assert {state.latency for state in observer.states} == {None}  # in lockstep
    times = [state.time for state in observer.states]
    assert np.diff(times) == pytest.approx(0.1, abs=0.05)


def test_a_flight_that_a_monitor_ends_says_when_where_and_why(tmp_path):
    summary, observer = flown(tmp_path, safety={"max_body_rate_deg_s": 15.0})
    end = summary.facts.early_end
    assert (end.phase, end.maneuver, end.monitor) == ("maneuvers", "steps", "body rate")
    steps = summary.maneuvers()[1]
    assert end.time_in_maneuver == pytest.approx(steps.duration, abs=0.1)
    assert end.time_in_maneuver > 1.0  # the rest before the first step
    assert end.since_takeoff == pytest.approx(end.time - summary.facts.takeoff_time)
    words = closing_words(summary.as_dict(), None)
    assert "safety.max_body_rate_deg_s" in "\n".join(words.lines)
    assert "s into steps" in words.lines[0]
    # It is still at the state when an alarm is raised.
    assert observer.states[-1].phase in ("hand back", "maneuvers")


def test_a_wrong_hover_thrust_is_advised_once_and_not_among_the_events_shown(tmp_path):
    summary, observer = flown(
        tmp_path, thrust={"hover_thrust": 0.35}, flight={"maneuvers": ["hover"]}
    )
    (sentence,) = summary.facts.advice
    assert sentence not in observer.events
    assert [text for _, text in summary.events].count(sentence) == 1
    assert any(text == sentence for _, text in own_texts(logged(summary)))
    value = float(summary.facts.settings["thrust.hover_thrust"])
    assert value == pytest.approx(0.49, abs=0.02)
    assert f"set it to {value:.2f}" in sentence
    assert not summary.as_dict()["verdict"]["good"]


def test_a_fault_in_what_is_shown_does_not_end_the_flight(tmp_path):
    class Broken(SilentObserver):
        def status(self, status):
            raise ZeroDivisionError("the screen")

    config = merged(QUICK_FLIGHT, {"hover": {"duration_s": 1.0}})
    summary = fly(config, QuickVehicle(), tmp_path, Broken())
    assert summary.result == "ok"
    faults = [time for time, text in summary.events if "ZeroDivisionError('the screen')" in text]
    assert len(faults) == 1
    motion = summary.trace.motion.rows()  # still recorded after the fault
    assert motion[-1, 0] > faults[0] + 10.0


def test_a_fault_in_the_report_of_the_state_is_an_event_and_does_not_end_the_flight(monkeypatch):
    def broken(_):
        raise ZeroDivisionError("the report")

    monkeypatch.setattr("companion.flight.status.StatusReporter.record", broken)
    summary = fly(merged(QUICK_FLIGHT, {"hover": {"duration_s": 0.5}}), QuickVehicle())
    assert summary.result == "ok"
    faults = [text for _, text in summary.events if "the report" in text]
    assert faults == ["internal error: ZeroDivisionError('the report')"]


def test_a_failure_of_the_recording_at_its_close_is_an_event(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("companion.recording.recorder.FlightRecorder._finish_file", full)
    config = merged(QUICK_FLIGHT, {"hover": {"duration_s": 1.0}})
    summary = fly(config, QuickVehicle(), tmp_path)
    written = json.loads((tmp_path / "summary.json").read_text())
    for texts in (
        [text for _, text in summary.events],
        [each["text"] for each in written["events"]],
    ):
        assert [text for text in texts if "recording stopped: No space left" in text] == texts[-1:]


def test_a_folder_that_was_removed_in_flight_is_not_named_at_the_end(tmp_path):
    vehicle, folder = QuickVehicle(), tmp_path / "flight"
    vehicle.when(lambda: vehicle.state()["armed"], lambda: shutil.rmtree(folder))
    summary = fly(merged(QUICK_FLIGHT, {"hover": {"duration_s": 0.5}}), vehicle, folder)
    assert (summary.result, summary.log) == ("ok", None)
    invocation = Invocation("companion", ["fly"], None)
    assert closing_words(summary.as_dict(), invocation).next_command is None


def test_height_and_speed_are_unknown_when_no_position_comes():
    """Shown or drawn on, the last ones would say that a vehicle on the ground is in the air."""
    vehicle, observer = QuickVehicle(), Watching()
    silent = {"kind": "stop_telemetry", "messages": ["LOCAL_POSITION_NED"]}
    vehicle.when(lambda: vehicle.state()["mode"] == "LAND", lambda: vehicle.inject(silent))
    short = merged(QUICK_FLIGHT, {"hover": {"duration_s": 0.5}})
    summary = fly(short, vehicle, None, observer)
    last = observer.states[-1]
    assert last.height is None
    assert last.speed is None
    assert last.tilt is not None
    assert np.isnan(summary.trace.motion.rows()[-1, 2:4]).all()


def test_a_nearly_full_disk_is_told_before_take_off(tmp_path, monkeypatch):
    def told(free):
        monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
        vehicle = QuickVehicle()
        vehicle.when(lambda: vehicle.state()["armed"], vehicle.take_over)
        summary = fly(QUICK_FLIGHT, vehicle, tmp_path / str(free))
        arming = next(at for at, text in summary.events if text == "armed")
        return [text for at, text in summary.events if "MB left" in text and at < arming]

    assert told(100_000_000_000) == []
    (warning,) = told(8_000_000)
    assert "the disk has 8 MB left, enough to record about 50 s; then the recording" in warning


def test_a_disk_that_does_not_say_how_full_it_is_is_no_error(tmp_path, monkeypatch):
    def unknown(_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(shutil, "disk_usage", unknown)
    assert space_warning(tmp_path) is None
