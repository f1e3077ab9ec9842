"""mavsdk-grpc flies, MAVProxy wins, and the live page and `--watch` run meanwhile; real time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from companion.config.files import load
from companion.recording.flight_record import read_flight
from companion.replay.replay import Replay
from tests.live.browser import CHROMIUM, chromium
from tests.serve.serving import free_ports, mock, serving
from tests.serve.test_programs import HOVER_AND_PARAMETER, PLAN, mavproxy, read_until

PROGRAM = Path(__file__).with_name("mavsdk_grpc_program.py")
CONFIGS = Path(__file__).parents[2] / "configs"
RETURN = {"px4": "long DO_SET_MODE 1 4 5\n", "ardupilot": "long DO_SET_MODE 1 6\n"}
WON = {"px4": "took over: mode AUTO.RTL", "ardupilot": "took over: mode RTL"}
LEAST_PARAMETERS = {"px4": 90, "ardupilot": 40}
_POSITION = "JSON.stringify(live.frames().slice(-1)[0])"


def look_at(url):
    """Open the live page in a browser: it shows the flight under the client's control, moving."""
    with chromium() as new_tab:
        tab = new_tab()
        tab.open(url)
        tab.wait("window.live && live.frames().length > 3", 60.0)
        before = tab.run(_POSITION)
        tab.wait(f"{_POSITION} !== {before!r}")
        tab.wait("document.body.innerText.includes('in control')")
        return tab.text()


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_station_wins_over_mavsdk_grpc_while_the_flight_is_watched(autopilot, tmp_path):
    vehicle, station, port, page = free_ports(4)
    edited = tmp_path / "served.yaml"
    edited.write_text(f"include: {CONFIGS / f'mock-{autopilot}.yaml'}\n")
    endpoints = f"udpout://127.0.0.1:{station}", f"udpin://127.0.0.1:{port}"
    options = ["--live", f"127.0.0.1:{page}", "--watch"]
    settings = [f"recording.directory={tmp_path / 'flights'}"]
    with (
        mock(vehicle, "--config", f"configs/mock-{autopilot}.yaml"),
        serving(vehicle, *endpoints, config=edited, settings=settings, options=options) as served,
        mavproxy(station, tmp_path) as proxy,
        subprocess.Popen(
            [sys.executable, PROGRAM, f"udpout://127.0.0.1:{port}",
             *HOVER_AND_PARAMETER[autopilot], "lose"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as run,
    ):  # fmt: skip
        said = read_until(proxy, "parameters\n")
        received = next(int(word) for word in said.split("Received ")[1].split() if word.isdigit())
        assert received >= LEAST_PARAMETERS[autopilot]
        assert run.stdout.readline() == "IN CONTROL\n", run.communicate()[1]
        shown = look_at(f"http://127.0.0.1:{page}/")
        assert "control" in shown
        edited.write_text(edited.read_text() + "planner: {gain_per_s: 4.5}\n")
        (tmp_path / "plan.txt").write_text(PLAN)
        proxy.stdin.write(f"wp load {tmp_path / 'plan.txt'}\n")
        read_until(proxy, "MISSION_ACK: TYPE_MISSION: ACCEPTED")
        proxy.stdin.write(RETURN[autopilot])
        read_until(proxy, "Mode RTL")
        out, errors = run.communicate(timeout=60)
        assert run.returncode == 0, out + errors
    report = json.loads(out.split("REPORT ")[1].splitlines()[0])
    assert report["lost"]
    assert report["strayed_m"] < 0.5
    assert WON[autopilot] in served.said
    counters = served.counters
    assert counters["routing"]["looped"] == counters["uplink"]["dropped"] == 0
    (folder,) = tmp_path.glob("flights/*/")
    assert (folder / "report.html").is_file()
    summary = json.loads((folder / "summary.json").read_text())
    (change,) = summary["changes"]
    assert change["by"] == "served.yaml"
    assert change["keys"] == {"planner.gain_per_s": [5.0, 4.5]}
    samples = Replay(read_flight(folder), load(folder / "config.yaml")).run()
    assert [each for each in samples if not each.same] == []
