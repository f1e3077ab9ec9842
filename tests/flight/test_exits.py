"""How our program can end, and what the vehicle does then: over the command line, as users do.

Each row of docs/exits.md, on both autopilots where they differ.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from resource import RLIMIT_FSIZE, prlimit
from typing import NamedTuple

import pytest
import yaml

from companion.cli.signals import HOW_TO_LEAVE, MIN_CTRL_C_INTERVAL
from companion.control.guidance_loop import GuidanceLoop
from tests.flight import fly as memory
from tests.flight import sockets, tlog
from tests.flight.fly import OTHER_VEHICLES, QUICK_FLIGHT, merged
from tests.flight.others import When
from tests.flight.programs import Program


class Ways(NamedTuple):
    """What an autopilot does without us: `left` holds some seconds after the last setpoint."""

    autopilot: str
    parameters: dict
    held: str
    left: Callable[[dict], bool]

    def mock(self, folder, **settings):
        """In a process of its own."""
        known = {"autopilot": self.autopilot, "parameters": self.parameters}
        return sockets.mock_vehicle(folder, **known, **settings)

    def in_memory(self):
        return memory.mock_vehicle(autopilot=self.autopilot, parameters=self.parameters)


def lands(state):
    return state["landed"] and not state["armed"] and not state["crashed"]


def levels(state):
    """Level, at its height, in the mode in which it obeyed, and not holding any place."""
    level = max(map(abs, state["q"][1:3])) < 0.02 and abs(state["velocity"][2]) < 0.1
    late = state["time"] > state["last_setpoint"] + 5.0
    return level and late and (state["mode"], state["armed"]) == ("GUIDED", True)


PX4 = Ways("px4", {"COM_OBL_RC_ACT": 4}, "LOITER", lands)
PATIENT_PX4 = PX4._replace(parameters=PX4.parameters | {"COM_OF_LOSS_T": 5.0})
ARDUPILOT = Ways("ardupilot", {}, "BRAKE", levels)
PAGE = {"report": True}
"""Section `recording`: the flight also ends with its page, which takes a third of a second."""
BOTH = pytest.mark.parametrize("ways", [PX4, ARDUPILOT], ids=lambda ways: ways.autopilot)


def start(mock, folder, *options, as_users_do=False, **changes):
    """`companion fly` in real time against the mock, in a process of its own."""
    config = folder / "fly.yaml"
    quick = merged(QUICK_FLIGHT, OTHER_VEHICLES.get(mock.autopilot, {}))
    quick = merged(quick, {"hover": {"duration_s": 60.0}})
    places = {
        "link": {"endpoint": f"udpin://127.0.0.1:{mock.port}"},
        "recording": {"directory": str(folder / "flights"), "report": False},
    }
    config.write_text(yaml.safe_dump(merged(merged(quick, places), changes)))
    arguments = ["fly", "--config", str(config), "--json", *options]
    if not as_users_do:
        return Program("companion.cli.main", *arguments, environment={"COLUMNS": "200"})
    return subprocess.Popen(
        [sys.executable, "-m", "companion", *arguments],
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


def in_offboard(state):
    """On ArduPilot the first setpoint takes over."""
    obeys = state["mode"] == "OFFBOARD" or (state["mode"] == "GUIDED" and state["setpoints"] > 50)
    return obeys and state["armed"]


def test_ctrl_c_hands_back_and_leaves_the_vehicle_holding(tmp_path):
    with PX4.mock(tmp_path, in_lockstep=False, speed=1.0) as mock:
        process = start(mock, tmp_path, as_users_do=True, recording=PAGE)
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
    ("ways", "number"),
    [
        (PX4, signal.SIGTERM),
        pytest.param(PX4, signal.SIGHUP, marks=pytest.mark.slow),
        (ARDUPILOT, signal.SIGINT),
    ],
)
def test_other_signals_hand_back_too(tmp_path, ways, number):
    with ways.mock(tmp_path) as mock:
        process = start(mock, tmp_path, "--lockstep")
        mock.until(in_offboard)
        process.send_signal(number)
        assert "interrupted by" in finish(process, 1)["result"]
        state = mock.state()
        assert (state["mode"], state["armed"], state["crashed"]) == (ways.held, True, False)


def test_a_terminal_that_goes_away_does_not_end_the_flight(tmp_path):
    """As `companion fly | head -1`: nobody reads any more, and every line fails."""
    with PX4.mock(tmp_path) as mock:
        short = {"hover": {"duration_s": 0.5}, "recording": PAGE}
        process = start(mock, tmp_path, "--lockstep", as_users_do=True, **short)
        process.stderr.close()
        out = process.stdout.read()
        assert process.wait(timeout=30) == 0
        assert not mock.state()["armed"]
    assert json.loads(out.splitlines()[-1])["result"] == "ok"


@pytest.mark.parametrize(
    "ways",
    [PATIENT_PX4, pytest.param(ARDUPILOT, marks=pytest.mark.slow)],
    ids=lambda ways: ways.autopilot,
)
def test_a_second_ctrl_c_leaves_at_once_and_keeps_the_record(tmp_path, ways):
    # The uplink is cut, so that handing back cannot succeed and takes its time.
    with ways.mock(tmp_path, in_lockstep=False, speed=1.0) as mock:
        accepted = {"accept": ["COM_OF_LOSS_T"]}
        process = start(mock, tmp_path, flight=accepted, recording=PAGE)
        mock.until(in_offboard)
        mock.inject({"kind": "drop", "direction": "from_companion"})
        time.sleep(0.1)  # faults begin with the vehicle's next step
        for number in (signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            process.send_signal(number)  # none of these leaves
            time.sleep(0.1)
        time.sleep(MIN_CTRL_C_INTERVAL)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        result = finish(process, 1)
        assert result["result"] == "stopped at once by the user"
        assert [event["text"] for event in result["events"]].count(HOW_TO_LEAVE) == 1
        mock.until(ways.left)


@BOTH
def test_killed_the_autopilot_does_what_it_does_without_us(tmp_path, ways):
    with ways.mock(tmp_path) as mock:
        process = start(mock, tmp_path, "--lockstep")
        mock.until(in_offboard)
        process.kill()
        process.communicate()
        state = mock.until(ways.left, seconds=40)
        # The quick vehicle still brakes from 3 m/s when it lands: 1.7 m/s, or less if it bounced.
        assert state["touchdown_speed"] is None or state["touchdown_speed"] < 2.0


def test_a_disk_that_takes_no_more_ends_the_recording_and_not_the_flight(tmp_path):
    with sockets.mock_vehicle(tmp_path) as mock:
        process = start(mock, tmp_path, "--lockstep", hover={"duration_s": 3.0}, recording=PAGE)
        prlimit(process.pid, RLIMIT_FSIZE, (150_000, 150_000))
        result = finish(process, 0)
        assert not mock.state()["armed"]
    assert result["result"] == "ok"
    told = [event["text"] for event in result["events"] if "recording stopped" in event["text"]]
    assert len(told) == 1
    assert "the flight goes on" in told[0]
    assert result["link"]["not_recorded"] > 500
    assert json.loads(next((tmp_path / "flights").glob("*/summary.json")).read_text()) == result


TAKEN, UNKNOWN = "failsafe took over", "its mode is not known any more"


@pytest.mark.parametrize(
    ("backend", "told"),
    # MAVSDK's thread reads what waited while we look already, so it may be either.
    [("direct", (TAKEN,)), pytest.param("mavsdk", (TAKEN, UNKNOWN), marks=pytest.mark.slow)],
    ids=["direct", "mavsdk"],
)
def test_frozen_in_flight_the_failsafe_takes_it_and_thawed_it_is_not_taken_back(
    tmp_path, backend, told
):
    """Stopped as a stuck event loop is; PX4 would let one setpoint in again.

    In real time: in lockstep our clock would stand still with us. Stopped between two samples: an
    answer that is on its way at that moment, for 0.1 ms, nobody could call back.
    """
    if backend == "mavsdk":
        pytest.importorskip("mavsdk")
    with PX4.mock(tmp_path, in_lockstep=False, speed=1.0) as mock:
        process = start(mock, tmp_path, link={"backend": backend})
        mock.until(in_offboard)
        mock.inject({"kind": "stop_telemetry", "duration_s": 0.1})
        time.sleep(0.03)  # faults begin with the vehicle's next step
        process.send_signal(signal.SIGSTOP)
        frozen = mock.until(lambda state: state["mode"] == "LAND")
        process.send_signal(signal.SIGCONT)
        result = finish(process, 1)
        state = mock.until(lambda state: state["landed"])
    assert frozen["time"] - frozen["last_setpoint"] < 1.3
    assert state["last_setpoint"] == frozen["last_setpoint"]
    # Disarmed, PX4 goes back to the mode that its user chose last.
    assert (state["crashed"], state["mode"]) == (False, "LAND" if state["armed"] else "OFFBOARD")
    texts = [event["text"] for event in result["events"]]
    assert any(reason in text for reason in told for text in [result["result"], *texts])


def test_frozen_and_thawed_it_does_not_take_the_vehicle_from_a_pilot_who_took_it_meanwhile(
    tmp_path,
):
    """What waited to be read says OFFBOARD, and looks new."""
    with PX4.mock(tmp_path, in_lockstep=False, speed=1.0) as mock:
        process = start(mock, tmp_path)
        mock.until(in_offboard)
        mock.inject({"kind": "delay", "delay_ms": 40.0})
        process.send_signal(signal.SIGSTOP)
        stopped = mock.state()["time"]
        mock.until(lambda state: state["time"] > stopped + 0.8)
        mock.inject({"kind": "pilot_takeover", "mode": "POSCTL"})
        mock.until(lambda state: state["time"] > stopped + 2.0)
        process.send_signal(signal.SIGCONT)
        finish(process, 1)
        assert mock.state()["mode"] == "POSCTL"


@pytest.mark.slow
def test_frozen_in_flight_ardupilot_levels_and_thawed_it_is_asked_to_hold(tmp_path):
    """It stays in the mode in which it obeyed; nobody took it, so our hand back is right."""
    with ARDUPILOT.mock(tmp_path, in_lockstep=False, speed=1.0) as mock:
        process = start(mock, tmp_path)
        mock.until(in_offboard)
        process.send_signal(signal.SIGSTOP)
        frozen = mock.until(levels)
        process.send_signal(signal.SIGCONT)
        result = finish(process, 1)
        state = mock.state()
    assert re.fullmatch(r"this program did not run for \d+\.\d s \(.+\)", result["result"])
    assert state["last_setpoint"] == frozen["last_setpoint"]
    assert (state["crashed"], state["mode"]) == (False, "BRAKE")


@BOTH
def test_frozen_guidance_is_noticed_and_the_vehicle_handed_back(tmp_path, monkeypatch, ways):
    flown = GuidanceLoop.step

    def freezing(guidance_loop):
        if not (
            guidance_loop.flown_source.begun_at is not None
            and guidance_loop._clock() > guidance_loop.flown_source.begun_at + 1.0
        ):
            flown(guidance_loop)

    monkeypatch.setattr(GuidanceLoop, "step", freezing)
    with ways.in_memory() as mock:
        summary = memory.fly(mock, tmp_path / "log")
        state = mock.state()
    assert summary.result == "guidance makes no commands any more"
    assert (state["mode"], state["armed"], state["crashed"]) == (ways.held, True, False)
    words = {"px4": "mode OFFBOARD", "ardupilot": "mode GUIDED (body rates)"}[ways.autopilot]
    began = next(at for at, text in summary.events if text == words)
    assert setpoints(summary)[-1]._timestamp < began + 1.2 + 1.0 + 0.2


@BOTH
def test_an_unplugged_cable_is_let_go_and_left_to_the_autopilot(tmp_path, ways):
    with ways.in_memory() as mock:
        left_at = []

        def cut():
            mock.inject({"kind": "drop"})
            mock.when(lambda: ways.left(mock.state()), lambda: left_at.append(mock.time))

        observer = When("maneuvers", cut, after=1.0)
        summary = memory.fly(mock, tmp_path / "log", observer)
        state = mock.until(ways.left, seconds=40)
    assert "no attitude" in summary.result
    assert "releasing control" in summary.events[-2][1]
    assert summary.events[-1][1].startswith("waited 10 s for the vehicle to be heard")
    assert not state["crashed"]
    assert setpoints(summary)[-1]._timestamp < summary.events[-2][0] - 0.4
    assert left_at[0] < setpoints(summary)[-1]._timestamp + 8.0


@BOTH
@pytest.mark.parametrize("maneuver", ["hover", "circle"])
def test_a_vehicle_heard_again_is_asked_to_hold_without_setpoints(ways, maneuver):
    """ArduPilot would stay in GUIDED, and drift."""
    with ways.in_memory() as mock:
        cut = {"kind": "drop", "direction": "to_companion", "duration_s": 0.7}
        observer = When("maneuvers", lambda: mock.inject(cut), after=1.0)
        summary = memory.fly(mock, None, observer, flight={"maneuvers": [maneuver]})
        assert mock.state()["mode"] == ways.held
        released, heard = (
            next(at for at, text in summary.events if words in text)
            for words in ("releasing control", "is heard again, still in")
        )
        assert heard - released < 0.4
        assert mock.time - mock.setpoints[-1].time > 0.7
    assert "no attitude" in summary.result


def test_interrupted_in_full_tilt_it_streams_until_the_autopilot_holds(tmp_path):
    with memory.mock_vehicle() as mock:
        observer = When("maneuvers", lambda: session.interrupt("enough"), after=1.0)
        steps = {"flight": {"maneuvers": ["steps"]}}
        session = memory.session_for(mock, tmp_path / "log", observer, **steps)
        summary = memory.run(mock, session.fly())
        assert mock.state()["mode"] == "LOITER"
    interrupted = next(at for at, text in summary.events if text == "enough")
    held = next(at for at, t in summary.events if at > interrupted and t == "mode AUTO.LOITER")
    last = setpoints(summary)[-1]
    assert interrupted < held <= last._timestamp + 0.03


def setpoints(summary):
    return list(tlog.messages(summary, "SET_ATTITUDE_TARGET"))
