"""`companion demo` and `companion plot`, as a user calls them, with the shortest maneuver."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from companion import demo
from companion.cli.main import main
from companion.config.files import shipped
from companion.mavlink.transport.free_port import free_port
from tests.flight.fly import LOOP_HZ, QUICK_MOCK, QUICK_PARAMETERS, merged
from tests.flight.programs import Program


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Flights go to a folder of their own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def quick_demo(folder: Path) -> str:
    """The configuration that ships, flown with short steps by a vehicle that wastes no time."""
    file = shipped("mock-px4.yaml")
    content = yaml.safe_load(file.read_text())
    mine = {
        "include": str(file.with_name(content["include"])),
        "steps": {"duration_s": 0.5, "settle_s": 0.5},
        "flight": {"takeoff_height_m": 2.0},
        "link": {"attitude_rate_hz": float(LOOP_HZ)},
        "mock": {**QUICK_MOCK, "parameters": QUICK_PARAMETERS["px4"]},
    }
    path = folder / "quick.yaml"
    path.write_text(yaml.safe_dump(merged(content, mine)))
    return str(path)


def test_the_demo_flies_shows_and_can_be_drawn(folder, capsys):
    options = ("--config", quick_demo(folder), "--lockstep", "--maneuvers", "steps", "--json")
    # test_terminal_encoding.py starts it as users do.
    process = Program("companion.cli.main", "demo", *options, folder=folder)
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert "The flight was good: steps" in err
    assert "time constant north" in err
    result = json.loads(out)
    assert (result["result"], result["phase"]) == ("ok", "disarm")
    assert main(["plot", result["log"]]) == 0, capsys.readouterr().err
    picture = folder / result["log"] / "flight.png"
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert picture.stat().st_size > 20_000
    assert main(["plot", result["log"], "--out", "flight.zzz"]) == 2
    said = capsys.readouterr().err
    assert "zzz" in said
    assert "Traceback" not in said


def test_a_vehicle_that_cannot_start_is_told_with_its_own_words(folder, monkeypatch, capsys):
    port = free_port(40)
    monkeypatch.setattr(demo, "free_port", lambda *_: port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as another:
        another.bind(("127.0.0.1", port + 40))
        assert main(["demo", "--lockstep"]) == 1
    assert f"UDP port {port + 40}" in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_lockstep_with_a_vehicle_that_is_not_in_lockstep_is_refused(folder, capsys):
    mock_px4, log = shipped("mock-px4.yaml"), folder / "log"
    with (
        demo.local_endpoints("udpin://0.0.0.0:14540") as endpoints,
        demo.bundled_vehicle(mock_px4, endpoints, log, lockstep=False),
    ):
        (folder / "mine.yaml").write_text(f"link: {{endpoint: '{endpoints.program}'}}")
        code = main(["fly", "--config", "mine.yaml", "--lockstep", "--arm"])
    assert code == 1
    assert "no lockstep beacon" in " ".join(capsys.readouterr().err.split())


def test_a_mock_vehicle_without_a_word_points_at_the_disk(tmp_path):
    log = tmp_path / "mock.log"
    log.write_bytes(b"")
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    with pytest.raises(demo.VehicleStoppedError, match="is the disk full"):
        demo._check_running(gone, log)


class Stubborn:
    """A vehicle that does not end when it is asked to."""

    stdin = None
    returncode = None

    def __init__(self):
        self.done = []

    def poll(self):
        return None

    def terminate(self):
        self.done.append("terminate")

    def wait(self, timeout=None):
        if timeout is not None:
            raise subprocess.TimeoutExpired("mock", timeout)
        self.done.append("wait")

    def kill(self):
        self.done.append("kill")


def test_a_mock_vehicle_that_does_not_end_is_killed(tmp_path):
    process = Stubborn()
    demo._end_vehicle(process, tmp_path / "mock.log")
    assert process.done == ["terminate", "kill", "wait"]


def test_a_mock_vehicle_that_is_never_ready_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(demo, "_START_TIMEOUT", 0.05)
    log = tmp_path / "mock.log"
    log.write_text("still booting")
    with pytest.raises(demo.VehicleStoppedError, match=r"did not start within 0\.05 s, see .*mock"):
        demo._await_ready(Stubborn(), log)
