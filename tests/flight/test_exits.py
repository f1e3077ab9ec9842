"""How our program can end, and what the vehicle does then: over the command line, as users do."""

import json
import os
import signal
import subprocess
import sys
import time
from resource import RLIMIT_FSIZE, prlimit

import pytest
import yaml
from pymavlink import mavutil

from companion.flight.guide import Guide
from companion.mavlink import lockstep
from tests.flight.fly import QUICK_FLIGHT, fly, merged, mock_vehicle, session_for
from tests.flight.test_authority import When

RETURN_LOW = {"parameters": {"COM_OBL_RC_ACT": 4}}


def start(mock, folder, *options, **changes):
    """`companion fly` in real time against the mock, in a process of its own."""
    config = folder / "fly.yaml"
    quick = merged(QUICK_FLIGHT, {"hover": {"duration_s": 60.0}})
    places = {
        "link": {"endpoint": f"udpin://127.0.0.1:{mock.port}"},
        "recording": {"directory": str(folder / "flights")},
    }
    config.write_text(yaml.safe_dump(merged(merged(quick, places), changes)))
    return subprocess.Popen(
        [sys.executable, "-m", "companion", "fly", "--config", str(config), "--json", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )


def finish(process, code):
    out, err = process.communicate(timeout=60)
    assert process.returncode == code, err
    assert "Traceback" not in err
    return json.loads(out.splitlines()[-1])


@pytest.fixture
def mock(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False, speed=1.0, **RETURN_LOW) as vehicle:
        yield vehicle


def in_offboard(state):
    return state["mode"] == "OFFBOARD" and state["armed"]


def test_ctrl_c_hands_back_and_leaves_the_vehicle_holding(mock, tmp_path):
    process = start(mock, tmp_path)
    mock.until(in_offboard)
    process.send_signal(signal.SIGINT)
    result = finish(process, 1)
    assert result["result"] == "interrupted by the user (Ctrl-C)"
    state = mock.state()
    assert (state["mode"], state["armed"]) == ("LOITER", True)
    count = state["setpoints"]
    time.sleep(0.2)
    assert mock.state()["setpoints"] == count


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.slow)]
)
def test_other_signals_hand_back_too(tmp_path, number):
    with mock_vehicle(tmp_path, **RETURN_LOW) as mock:
        process = start(mock, tmp_path, "--lockstep")
        mock.until(in_offboard)
        process.send_signal(number)
        assert f"interrupted by {number.name}" in finish(process, 1)["result"]
        assert mock.state()["mode"] == "LOITER"


def test_a_terminal_that_goes_away_does_not_end_the_flight(tmp_path):
    """As `companion fly | head -1`: nobody reads any more, and every line fails."""
    with mock_vehicle(tmp_path, **RETURN_LOW) as mock:
        process = start(mock, tmp_path, "--lockstep", hover={"duration_s": 3.0})
        process.stderr.close()
        out = process.stdout.read()
        assert process.wait(timeout=30) == 0
        assert not mock.state()["armed"]
    assert json.loads(out.splitlines()[-1])["result"] == "ok"


def test_a_second_ctrl_c_leaves_at_once_and_keeps_the_record(tmp_path):
    # The uplink is cut, so that handing back cannot succeed and takes its time.
    with mock_vehicle(tmp_path, in_lockstep=False, speed=1.0, **RETURN_LOW) as mock:
        process = start(mock, tmp_path)
        mock.until(in_offboard)
        mock.ask({"fault": {"kind": "drop", "direction": "from_companion"}})
        time.sleep(0.1)  # faults begin with the vehicle's next step
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        result = finish(process, 1)
        assert time.monotonic() - began < 3.0
        assert result["result"] == "left at once by the user"
        assert mock.until(lambda state: state["mode"] == "LAND")["armed"]


def test_killed_the_autopilots_failsafe_lands_it(tmp_path):
    with mock_vehicle(tmp_path, **RETURN_LOW) as mock:
        process = start(mock, tmp_path, "--lockstep")
        mock.until(in_offboard)
        process.kill()
        process.communicate()
        state = mock.until(lambda state: state["landed"] and not state["armed"], seconds=40)
        assert not state["crashed"]
        assert state["touchdown_speed"] < 1.5


def test_a_disk_that_takes_no_more_ends_the_recording_and_not_the_flight(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        process = start(mock, tmp_path, "--lockstep", hover={"duration_s": 3.0})
        prlimit(process.pid, RLIMIT_FSIZE, (300_000, 300_000))
        result = finish(process, 0)
        assert not mock.state()["armed"]
    assert result["result"] == "ok"
    told = [event["text"] for event in result["events"] if "recording stopped" in event["text"]]
    assert len(told) == 1
    assert "flight.tlog" in told[0]
    assert result["link"]["not_recorded"] > 1000
    assert json.loads(next((tmp_path / "flights").glob("*/summary.json")).read_text()) == result


def test_frozen_in_flight_the_failsafe_takes_it_and_thawed_it_is_not_taken_back(mock, tmp_path):
    """Stopped as a stuck event loop is; PX4 would let one setpoint in again.

    In real time: in lockstep our clock would stand still with us.
    """
    process = start(mock, tmp_path)
    mock.until(in_offboard)
    process.send_signal(signal.SIGSTOP)
    frozen = mock.until(lambda state: state["mode"] == "LAND")
    process.send_signal(signal.SIGCONT)
    result = finish(process, 1)
    state = mock.until(lambda state: state["landed"])
    assert frozen["time"] - frozen["last_setpoint"] < 1.3
    assert state["last_setpoint"] == frozen["last_setpoint"]
    assert (state["crashed"], state["mode"]) == (False, "LAND")
    assert any("failsafe took over" in event["text"] for event in result["events"])


def test_frozen_guidance_is_noticed_and_the_vehicle_handed_back(tmp_path, monkeypatch):
    flown = Guide.step

    def freezing(guide):
        if not (guide.begun_at is not None and guide._clock() > guide.begun_at + 1.0):
            flown(guide)

    monkeypatch.setattr(Guide, "step", freezing)
    with mock_vehicle(tmp_path) as mock:
        summary = fly(mock, tmp_path / "log")
        state = mock.state()
    assert summary.result == "guidance makes no commands any more"
    assert (state["mode"], state["armed"], state["crashed"]) == ("LOITER", True, False)
    began = next(at for at, text in summary.events if text == "mode OFFBOARD")
    assert setpoints(summary)[-1]._timestamp < began + 1.2 + 1.0 + 0.2


def test_an_unplugged_cable_is_let_go_and_the_failsafe_lands_it(tmp_path):
    with mock_vehicle(tmp_path, **RETURN_LOW) as mock:
        observer = When("programme", lambda: mock.ask({"fault": {"kind": "drop"}}), after=1.0)
        summary = fly(mock, tmp_path / "log", observer)
        state = mock.until(lambda state: state["landed"] and not state["armed"], seconds=40)
    assert "no attitude" in summary.result
    assert "letting go" in summary.events[-1][1]
    assert not state["crashed"]
    assert state["time"] < setpoints(summary)[-1]._timestamp + 8.0


def test_interrupted_in_full_tilt_it_streams_until_the_autopilot_holds(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = When("programme", lambda: session.interrupt("enough"), after=1.0)
        steps = {"flight": {"programme": ["steps"]}}
        session = session_for(mock, tmp_path / "log", observer, **steps)
        summary = lockstep.run(session.fly())
        assert mock.state()["mode"] == "LOITER"
    interrupted = next(at for at, text in summary.events if text == "enough")
    held = next(at for at, t in summary.events if at > interrupted and t == "mode AUTO.LOITER")
    last = setpoints(summary)[-1]
    assert interrupted < held <= last._timestamp + 0.03


def setpoints(summary):
    log = mavutil.mavlink_connection(str(summary.log / "flight.tlog"))
    return list(iter(lambda: log.recv_match(type=["SET_ATTITUDE_TARGET"]), None))
