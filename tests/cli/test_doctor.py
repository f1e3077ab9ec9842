"""`companion doctor`, as a user calls it: on vehicles good and bad, silent and strange."""

import asyncio
import io
import json
import os
import pty
import socket
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from pymavlink.dialects.v20 import common as dialect
from rich.console import Console

from companion.cli import doctor as doctor_command
from companion.cli.main import main
from companion.config import Config
from companion.config.files import changed
from companion.config.known_drag import KnownDrag
from companion.mavlink import lockstep
from companion.mavlink.transport.free_port import free_port
from companion.preflight.finding import Finding, Key
from companion.preflight.parameter_fixes import Answer
from companion.vehicle.parameter_rules import CheckResult
from tests.cli.test_bad_input import run
from tests.mavlink.fakes import frames_of
from tests.preflight.vehicles import FAMILIES, config_file, configured, met, shipped_vehicle

WRONG = {
    "px4": {"COM_OF_LOSS_T": 5.0, "COM_OBL_RC_ACT": 7, "CBRK_SUPPLY_CHK": 894281},
    "ardupilot": {"GUID_OPTIONS": 1, "ATC_ANGLE_BOOST": 1, "FS_THR_ENABLE": 0},
}
MENDED = {
    "px4": {"COM_OF_LOSS_T": 0.75, "COM_OBL_RC_ACT": 5.0, "CBRK_SUPPLY_CHK": 0.0},
    "ardupilot": {"GUID_OPTIONS": 9.0, "ATC_ANGLE_BOOST": 0.0, "FS_THR_ENABLE": 1.0},
}
PLANE, PX4 = 1, 12
FINDING = Finding(Key.RESPONSE, CheckResult.UNSAFE, "found", "because")
NO_POSITION_YET = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "HOME_POSITION", "ODOMETRY")


def doctor(capsys, *arguments):
    return run(capsys, "doctor", *arguments)


def found(out):
    """The JSON object, and the results by key of what is not safe."""
    told = json.loads(out)
    keys = {f["key"]: f["result"] for f in told["findings"] if f["result"] != "safe"}
    return told, keys


def held(folder, mock, names):
    """What the vehicle holds now."""

    async def scene():
        async with met(configured(folder, mock)) as vehicle:
            return {name: float(await vehicle.link.read_parameter(name)) for name in names}

    return lockstep.run(scene())


@pytest.mark.parametrize("family", FAMILIES)
def test_it_finds_mends_and_undoes(capsys, tmp_path, family):
    wrong = {name: float(value) for name, value in WRONG[family].items()}
    with shipped_vehicle(tmp_path, family, parameters=WRONG[family]) as mock:
        config = config_file(tmp_path, mock)
        code, out, _ = doctor(capsys, "--config", config, "--fix", "--yes", "--json")
        told, keys = found(out)
        assert (code, told["result"], keys) == (0, "ok", {})
        changes = {c["parameter"]: (c["old"], c["new"], c["refusal"]) for c in told["changes"]}
        assert changes == {n: (wrong[n], MENDED[family][n], None) for n in wrong}
        assert held(tmp_path, mock, wrong) == MENDED[family]
        undo = yaml.safe_load(Path(told["undo"]).read_text())
        assert undo["parameters"] == wrong
        code, out, _ = doctor(capsys, "--config", config, "--undo", told["undo"], "--json")
        assert (code, len(json.loads(out)["changes"])) == (0, len(wrong))
        assert held(tmp_path, mock, wrong) == wrong
        code, out, _ = doctor(capsys, "--config", config, "--json")
        told, keys = found(out)
        assert (code, told["result"], set(keys)) == (1, "unsafe", set(wrong))
        accept = [key for key, verdict in keys.items() if verdict == "unsafe"]
        config = config_file(tmp_path, mock, flight={"accept": accept})
        code, out, _ = doctor(capsys, "--config", config)
        assert code == 0
        assert "accepted by flight.accept" in " ".join(out.split())
        undo["system"] = 7
        (tmp_path / "other.yaml").write_text(yaml.safe_dump(undo))
        code, _, err = doctor(capsys, "--config", config, "--undo", tmp_path / "other.yaml")
        assert code == 2
        assert "was written for another vehicle (" in err
        assert held(tmp_path, mock, wrong) == wrong


def test_it_asks_on_a_terminal(capsys, tmp_path, monkeypatch):
    """Some nonsense first, then yes to one of two, then no more."""
    ours, theirs = pty.openpty()
    os.write(ours, b"what?\ny\nq\n")
    with (
        os.fdopen(theirs) as terminal,
        shipped_vehicle(
            tmp_path, "px4", parameters={"COM_OF_LOSS_T": 5.0, "COM_OBL_RC_ACT": 7}
        ) as mock,
    ):
        monkeypatch.setattr(sys, "stdin", terminal)
        code, out, _ = doctor(capsys, "--config", config_file(tmp_path, mock), "--fix")
        values = held(tmp_path, mock, ("COM_OF_LOSS_T", "COM_OBL_RC_ACT"))
    os.close(ours)
    assert (code, values) == (1, {"COM_OF_LOSS_T": 0.75, "COM_OBL_RC_ACT": 7.0})
    assert out.count("Set COM_OF_LOSS_T from 5 to 0.75? [y]es, [n]o, [a]ll, [q]uit") == 2
    assert "COM_OF_LOSS_T: 5 → 0.75, read back" in out
    assert "Undo with: companion doctor --config FILE --undo" in out


class Neighbour(threading.Thread):
    """Says the same to a port until its block ends."""

    def __init__(self, port, *messages, signed=False):
        super().__init__(daemon=True)
        frames = map(signed_frame, messages) if signed else frames_of(*messages)
        self._frames, self._to = list(frames), ("127.0.0.1", port)
        self._over = threading.Event()

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not self._over.wait(0.05):
                for frame in self._frames:
                    sender.sendto(frame, self._to)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self.join()


def far_away(folder, port, **changes):
    path = folder / "my.yaml"
    link = {"endpoint": f"udpin://127.0.0.1:{port}", **changes}
    path.write_text(yaml.safe_dump({"link": link, "flight": {"connect_timeout_s": 0.5}}))
    return path


def signed_frame(message):
    mav = dialect.MAVLink(None, 1, 1)
    mav.signing.secret_key, mav.signing.sign_outgoing = bytes(32), True
    return message.pack(mav)


def beat(kind=2, autopilot=PX4, armed=0):
    return dialect.MAVLink_heartbeat_message(kind, autopilot, 29 | armed, 0, 3, 3)


def test_a_vehicle_that_cannot_be_flown_and_one_that_is_not_there_are_findings(capsys, tmp_path):
    port = free_port()
    config = far_away(tmp_path, port)
    for message, words in (
        (beat(kind=PLANE), "(MAV_TYPE 1) is no multirotor"),
        (beat(autopilot=18), "(MAV_AUTOPILOT 18) is not supported; this version flies PX4"),
    ):
        with Neighbour(port, message):
            code, out, _ = doctor(capsys, "--config", config, "--json")
        told, keys = found(out)
        assert (code, keys) == (1, {"vehicle.supported": "unsafe"})
        (finding,) = told["findings"]
        assert words in f"{finding['found']}; {finding['fix']}"
    code, out, _ = doctor(capsys, "--config", config, "--json")
    told, keys = found(out)
    assert (code, told["result"], told["unsafe"]) == (1, "not connected", 0)
    assert keys == {"vehicle.heartbeat": "not_connected"}
    assert told["findings"][0]["found"].startswith("no heartbeat from system 1 within 0.5 s")


def test_a_vehicle_that_does_not_sign_is_told_as_that(capsys, tmp_path):
    (tmp_path / "key").write_text("passphrase\n")
    port = free_port()
    config = far_away(tmp_path, port, signing_key_file=str(tmp_path / "key"))
    with Neighbour(port, beat()):
        code, out, _ = doctor(capsys, "--config", config, "--json")
    told, keys = found(out)
    silent = {"vehicle.heartbeat": "not_connected", "link.signing": "not_connected"}
    assert (code, keys) == (1, silent)
    assert "does not sign its frames" in told["findings"][0]["found"]


def test_nothing_connected_is_not_called_unsafe(capsys, tmp_path):
    code, out, _ = doctor(capsys, "--config", far_away(tmp_path, free_port()))
    assert code == 1
    assert "NOT CONNECTED\n" in out
    assert out.count("nothing was checked") == 1  # the last line alone
    assert "UNSAFE" not in out
    assert "hurt" not in out


SILENT = {"vehicle.answers": "not_connected"}
HINTED = {"link.signing": "not_connected", **SILENT}


@pytest.mark.parametrize(
    ("signed", "armed", "expected"),
    [(False, 0, SILENT), (True, 0, HINTED), (True, 128, {**HINTED, "vehicle.armed": "unsafe"})],
)
def test_a_vehicle_that_answers_nothing_is_told_with_its_cause_first(
    capsys, tmp_path, monkeypatch, signed, armed, expected
):
    """One that signs and obeys only what is signed times out; the hint is what mends it."""
    monkeypatch.setattr("companion.vehicle.streams._RETRIES", 0)
    monkeypatch.setattr("companion.vehicle.streams._TIMEOUT_S", 0.1)
    port = free_port()
    with Neighbour(port, beat(armed=armed), signed=signed):
        config = far_away(tmp_path, port)
        code, out, _ = doctor(capsys, "--config", config, "--json")
        told, keys = found(out)
        assert (code, told["result"], keys) == (1, "not connected", expected)
        assert [finding["key"] for finding in told["findings"]] == list(expected)
        answers = next(f for f in told["findings"] if f["key"] == "vehicle.answers")
        assert "MAV_CMD_SET_MESSAGE_INTERVAL: no answer" in answers["found"]
        code, out, _ = doctor(capsys, "--config", config)
        assert ("set link.signing_key_file" in " ".join(out.split())) is signed


@pytest.mark.parametrize("family", FAMILIES)
def test_a_booting_vehicle_is_not_ready_and_nothing_of_it_is_unsafe(capsys, tmp_path, family):
    with shipped_vehicle(tmp_path, family, prearm_delay_s=1000.0) as mock:
        mock.ask({"fault": {"kind": "stop_telemetry", "messages": list(NO_POSITION_YET)}})
        config = config_file(tmp_path, mock)
        code, out, _ = doctor(capsys, "--config", config, "--wait", "1", "--json")
        told, keys = found(out)
        assert (code, told["result"]) == (1, "not ready")
        assert set(keys.values()) == {"not_ready"}
        assert "vehicle.ready" in keys
        code, out, _ = doctor(capsys, "--config", config, "--wait", "1")
        assert "NOT READY" in out
        assert "UNSAFE" not in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--yes",), "needs --fix"),
        (("--fix",), "standard input is no terminal; add --yes"),
        (("--fix", "--undo", "x.yaml"), "not allowed with"),
        (("--undo", "/not/there.yaml"), "/not/there.yaml"),
        (("--wait", "-1"), "must be a number from 0.01 to 3600"),
    ],
)
def test_wrong_usage_is_told(capsys, tmp_path, monkeypatch, arguments, words):
    config = far_away(tmp_path, free_port())
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        code, _, err = doctor(capsys, "--config", config, *arguments)
    assert code == 2
    assert words in err


def test_a_missing_extra_is_named_before_anything_is_opened(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda *_: None)
    (tmp_path / "my.yaml").write_text("link: {backend: mavsdk}\n")
    assert main(["doctor", "--config", str(tmp_path / "my.yaml")]) == 2
    assert "[mavsdk]'" in capsys.readouterr().err


def test_an_undo_without_a_vehicle_is_a_finding_and_sets_nothing(capsys, tmp_path):
    undo = tmp_path / "undo.yaml"
    told = {"autopilot": "px4", "system": 1, "uid": "aa", "time": "2026-01-02"}
    undo.write_text(yaml.safe_dump(told | {"parameters": {"COM_OF_LOSS_T": 1.0}}))
    config = far_away(tmp_path, free_port())
    code, out, _ = doctor(capsys, "--config", config, "--undo", undo, "--json")
    told, keys = found(out)
    assert (code, keys) == (1, {"vehicle.heartbeat": "not_connected"})
    assert "changes" not in told


def run_of(config=None):
    shown = io.StringIO()
    console = Console(file=shown, highlight=False, width=200, markup=False)
    return doctor_command._DoctorRun(config or Config(), console), shown


@pytest.mark.parametrize(
    ("result", "code", "told"),
    [
        ("ok", 0, "`--fix` has no parameter to set."),
        ("unsafe", 1, "`--fix` has no parameter to set: the findings need other remedies."),
    ],
)
def test_without_a_change_to_propose_nothing_is_set(result, code, told):
    run, shown = run_of()
    run.result = {"result": result}
    vehicle = SimpleNamespace(link=None)
    assert asyncio.run(run._fix(vehicle, None, [FINDING], without_asking=True)) == code
    assert shown.getvalue() == f"{told}\n"


@pytest.mark.parametrize(
    ("lines", "answer", "asked"),
    [
        (["y\n"], Answer.YES, 1),
        ([" N \n"], Answer.NO, 1),
        (["\n", "what?\n", "All\n"], Answer.ALL, 3),
        (["q\n"], Answer.QUIT, 1),
        ([""], Answer.QUIT, 1),  # the end of the input
    ],
)
def test_each_answer_is_understood(monkeypatch, lines, answer, asked):
    async def read():
        return lines.pop(0)

    monkeypatch.setattr(doctor_command, "read_line", read)
    run, shown = run_of()
    change = SimpleNamespace(parameter="COM_OF_LOSS_T", old=5.0, new=0.75)
    assert asyncio.run(run._ask(replace(FINDING, change=change))) is answer
    question = "Set COM_OF_LOSS_T from 5 to 0.75? [y]es, [n]o, [a]ll, [q]uit "
    assert shown.getvalue().count(question) == asked


def test_maneuvers_that_cannot_be_flown_are_a_finding(tmp_path):
    told = {"flight": {"maneuvers": ["trajectory"], "trajectory": str(tmp_path / "gone.yaml")}}
    flown, (finding,) = doctor_command._maneuvers(
        changed(Config(), told, "t"), KnownDrag(None, None)
    )
    assert flown is None
    assert "gone.yaml" in finding.fact
    assert finding.result is CheckResult.INEFFECTIVE


def test_of_a_planner_of_another_package_no_response_is_expected():
    config = Config()
    other = config.planner.model_copy(update={"name": "theirs"})
    assert doctor_command._response_findings(config.model_copy(update={"planner": other})) == []
    (finding,) = doctor_command._response_findings(config)
    assert finding.result is CheckResult.SAFE
    too_quick = changed(
        config,
        {"planner": {"gain_per_s": 15.0}, "vehicle": {"lag_ms": 80.0, "dead_time_ms": 80.0}},
        "t",
    )
    assert doctor_command._response_findings(too_quick)[0].result is CheckResult.INEFFECTIVE


def test_ctrl_c_says_that_what_was_set_is_listed(capsys, tmp_path, monkeypatch):
    def interrupted(work, *, in_lockstep):
        work.close()
        raise KeyboardInterrupt

    monkeypatch.setattr(doctor_command, "run", interrupted)
    code, out, _ = doctor(capsys, "--config", far_away(tmp_path, free_port()))
    assert code == 1
    assert out == "Interrupted; every parameter that was set is listed above.\n"
    code, out, _ = doctor(capsys, "--config", far_away(tmp_path, free_port()), "--json")
    assert code == 1
    assert json.loads(out) == {"result": "interrupted", "changes": []}
