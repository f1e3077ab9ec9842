"""`companion identify`, as a user calls it: what is written, what is not, and what is told."""

import errno
import json
import os
import shutil
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from companion.cli import identify
from companion.cli.main import main
from companion.config.files import load
from companion.identification import IdentifiedVehicle, RateResponse
from companion.mavlink.transport.free_port import free_port
from tests.cli.test_bad_input import run as run_command
from tests.flight.fly import QUICK_FLIGHT, merged
from tests.flight.programs import Program
from tests.flight.sockets import mock_vehicle
from tests.identification.test_fragment import GOOD

RECORDINGS = Path(__file__).parents[1] / "mavlink" / "recordings"


def run(capsys, *arguments):
    code, out, err = run_command(capsys, "identify", *arguments)
    return code, " ".join(out.split()), err


def config_for(folder, endpoint, **changes):
    path = folder / "my.yaml"
    places = {
        "link": {"endpoint": endpoint, "lockstep": True, "attitude_rate_hz": 250.0},
        "recording": {"directory": str(folder / "flights"), "report": False},
        "planner": {"name": "model-following"},
        "identify": {"settle_s": 1.0},
        "vehicle": {"lag_ms": 20, "dead_time_ms": 900},  # not to be flown with
    }
    path.write_text(yaml.safe_dump(merged(merged(QUICK_FLIGHT, places), changes)))
    return path


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A folder with a configuration and one flight of `identify`, and what that printed."""
    folder = tmp_path_factory.mktemp("identify")
    with mock_vehicle(folder, seed=2) as mock:
        config = config_for(folder, f"udpin://127.0.0.1:{mock.port}")
        arguments = "identify", "--config", config, "--json"
        program = Program("companion.cli.main", *arguments, environment={"COLUMNS": "80"})
        out, err = program.communicate(timeout=100)
        assert not mock.state()["armed"]
    assert program.returncode == 0, err
    return folder, SimpleNamespace(stdout=out, stderr=err)


def test_it_flies_fits_writes_and_tells_how_to_include_it(flown):
    folder, done = flown
    (written,) = (folder / "flights").glob("*/vehicle.yaml")
    vehicle = yaml.safe_load(written.read_text())["vehicle"]
    assert vehicle["lag_ms"] == pytest.approx(74.8, rel=0.1)
    assert vehicle["dead_time_ms"] == pytest.approx(8.0, abs=5.0)
    assert vehicle["damping"] == pytest.approx(0.73, abs=0.05)
    assert vehicle["yaw_lag_ms"] == pytest.approx(370.0, rel=0.15)
    assert vehicle["yaw_dead_time_ms"] == pytest.approx(102.0, abs=5.0)
    words = " ".join(done.stderr.split())
    assert f"include: {written.relative_to(folder)}" in words
    assert "hovers at 0.49" in words
    result = json.loads(done.stdout)
    assert (result["result"], result["file"]) == ("ok", str(written))
    assert result["yaw"]["lag_ms"] == vehicle["yaw_lag_ms"]
    assert (written.parent / "config.yaml").is_file()


def test_it_flies_with_a_planner_that_needs_no_knowledge_of_the_vehicle(flown):
    (summary,) = (flown[0] / "flights").glob("*/summary.json")
    assert json.loads(summary.read_text())["planner"] == "first-order"


def test_what_it_wrote_can_be_included(flown, capsys):
    folder, _ = flown
    (written,) = (folder / "flights").glob("*/vehicle.yaml")
    path = folder / "with.yaml"
    path.write_text(f"include: {written.relative_to(folder)}\nplanner: {{name: model-following}}\n")
    assert main(["check-config", str(path)]) == 0
    capsys.readouterr()
    assert load(path).vehicle.lag_ms == yaml.safe_load(written.read_text())["vehicle"]["lag_ms"]
    assert load(path).thrust.hover_thrust == pytest.approx(0.49, abs=0.005)


def test_a_recorded_flight_gives_the_same_again_and_nothing_is_overwritten(flown, capsys, tmp_path):
    (folder,) = (flown[0] / "flights").iterdir()
    first = (folder / "vehicle.yaml").read_text()
    code, _, err = run(capsys, "--log", folder)
    assert code == 2
    assert f"{folder}/vehicle.yaml exists; choose another file with --out" in err
    again = tmp_path / "again.yaml"
    code, out, _ = run(capsys, "--log", folder / "flight.tlog", "--out", again)
    assert code == 0
    assert again.read_text() == first
    assert f"Written to {again}" in out
    again.write_text("mine")
    assert run(capsys, "--log", folder, "--out", again)[0] == 2
    assert again.read_text() == "mine"
    assert run(capsys, "--log", folder, "--out", again, "--force")[0] == 0
    assert again.read_text() == first


def test_a_bad_fit_is_not_written_and_says_why_of_each_axis(capsys, tmp_path):
    log = tmp_path / "flight.tlog"
    shutil.copy(RECORDINGS / "px4-rate-steps.tlog", log)
    code, out, _ = run(capsys, "--log", tmp_path)
    assert code == 1
    assert "Not written, because the fit is bad: yaw: too little excitation: the commands" in out
    assert "roll" not in out.partition("Not written")[2]  # roll and pitch are good
    assert list(tmp_path.iterdir()) == [log]
    code, out, _ = run(capsys, "--log", log, "--json")
    result = json.loads(out)
    assert (code, result["result"].startswith("yaw: too little")) == (1, True)


@pytest.mark.parametrize(
    ("size", "expected", "words"),
    [
        (20_000, 1, "pitch: too little excitation"),
        # No heartbeat follows the first: it is not certain that anything was obeyed.
        (2_000, 2, "no body rates that the vehicle obeyed"),
    ],
)
def test_a_log_that_broke_off_too_soon_is_refused(capsys, tmp_path, size, expected, words):
    log = tmp_path / "short.tlog"
    log.write_bytes((RECORDINGS / "px4-rate-steps.tlog").read_bytes()[:size])
    code, out, err = run(capsys, "--log", log)
    assert code == expected
    assert words in out + err
    assert list(tmp_path.iterdir()) == [log]


def test_a_file_that_is_no_log_is_refused_as_usage(capsys, tmp_path):
    path = tmp_path / "flight.csv"
    path.write_text("time,roll\n0.0,1.0\n")
    code, _, err = run(capsys, "--log", path)
    assert code == 2
    assert f"{path}: not a .tlog" in err


TAKES = "--log takes the folder of a flight, or a MAVLink log such as the flight.tlog in it"


def test_what_is_no_log_is_answered_with_the_log_that_would_do(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for k, name in enumerate(("older", "newest")):
        flight = Path("flights", name)
        flight.mkdir(parents=True)
        for file in ("flight.tlog", "flight.mcap"):
            (flight / file).write_bytes(b"")
            os.utime(flight / file, (k, k))
    Path("other").mkdir()
    for given, words in (
        ("flights", f"flights holds no flight.tlog: {TAKES}; write --log flights/newest"),
        (
            "flights/older/flight.mcap",
            f"is no MAVLink log: {TAKES}; write --log flights/older/flight.tlog",
        ),
        ("flights/newest/flight.log", f"does not exist: {TAKES}; write --log flights/newest/fl"),
        ("flight.mcap", f"flight.mcap does not exist: {TAKES}"),
        ("other", f"other holds no flight.tlog: {TAKES}"),
    ):
        code, out, err = run(capsys, "--log", given)
        assert (code, out) == (2, "")
        assert words in err
    Path("other", "a b.tlog").write_bytes(b"")
    _, _, err = run(capsys, "--log", "other")
    assert err.endswith("; write --log 'other/a b.tlog'")


@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("there.yaml", "exists; choose another file with --out"),
        ("no/v.yaml", "there is no folder"),
        ("folder", "folder is a folder; choose a file in it with --out"),
        ("locked/v.yaml", "locked cannot be written"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_flying(
    capsys, tmp_path, monkeypatch, out, words
):
    (tmp_path / "there.yaml").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "locked").mkdir()
    # Whoever tests as root may write to a locked folder.
    monkeypatch.setattr(os, "access", lambda path, _: Path(path).name != "locked")
    config = config_for(tmp_path, f"udpin://127.0.0.1:{free_port()}")
    code, _, err = run(capsys, "--config", config, "--out", tmp_path / out)
    assert code == 2
    assert words in err
    assert not (tmp_path / "flights").exists()


def test_a_log_in_a_folder_that_is_not_there_is_what_is_blamed(capsys, tmp_path):
    code, _, err = run(capsys, "--log", tmp_path / "no" / "x.tlog")
    assert code == 2
    assert f"{tmp_path}/no/x.tlog does not exist: {TAKES}" in err


TILT = RateResponse(0.018, 0.020, 1.0, None, GOOD)
YAW = RateResponse(0.06, 0.158, 1.0, 4.7, GOOD)


@pytest.fixture
def fitted(monkeypatch, tmp_path):
    """The folder of a log that gives a good fit, with a slew limit in yaw."""
    shutil.copy(RECORDINGS / "px4-rate-steps.tlog", tmp_path / "flight.tlog")
    vehicle = IdentifiedVehicle(TILT, TILT, YAW, None)
    monkeypatch.setattr(identify, "identify_vehicle", lambda *_: vehicle)
    return tmp_path


def test_fitting_is_announced_and_the_include_is_found_from_anywhere(capsys, fitted, monkeypatch):
    monkeypatch.chdir(fitted)
    code, out, _ = run(capsys, "--log", "flight.tlog")
    assert code == 0
    assert out.startswith("fitting…")
    assert f"include: {fitted}/vehicle.yaml" in out
    code, out, err = run(capsys, "--log", "flight.tlog", "--force", "--json")
    assert json.loads(out)["result"] == "ok"
    assert err.startswith("fitting…")


def test_a_folder_named_in_another_encoding_gives_a_file_that_can_be_read(capsys, fitted):
    log = fitted / os.fsdecode(b"caf\xe9.tlog")
    log.write_bytes((fitted / "flight.tlog").read_bytes())
    assert run(capsys, "--log", log, "--force")[0] == 0
    assert load(fitted / "vehicle.yaml").vehicle.identified == "caf?.tlog"
    assert load(fitted / "vehicle.yaml").vehicle.autopilot == "PX4"


def test_an_axis_that_is_not_good_is_kept_from_the_flights_configuration(capsys, tmp_path):
    shutil.copy(RECORDINGS / "px4-rate-steps.tlog", tmp_path / "flight.tlog")
    known = {"lag_ms": 18.0, "dead_time_ms": 19.0, "yaw_lag_ms": 370.0, "yaw_dead_time_ms": 102.0}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"vehicle": known}))
    code, out, err = run(capsys, "--log", tmp_path, "--json")
    assert code == 0, err
    result = json.loads(out)
    assert result["kept"] == {
        "yaw": "kept from the configuration (lag 370.0 ms, dead time 102.0 ms), because the "
        "fit is bad: too little excitation: the commands span 0.03 rad/s, 0.20 are needed"
    }
    assert f"yaw: {result['kept']['yaw']}" in err
    vehicle = yaml.safe_load((tmp_path / "vehicle.yaml").read_text())["vehicle"]
    assert (vehicle["yaw_lag_ms"], vehicle["yaw_dead_time_ms"]) == (370.0, 102.0)
    assert vehicle["lag_ms"] == pytest.approx(74.8, rel=0.1)
    assert result["roll"]["lag_ms"] == pytest.approx(47.0, rel=0.15)
    assert result["roll"]["second_order"]["damping"] == pytest.approx(vehicle["damping"], abs=0.05)


def test_a_disk_that_is_full_leaves_the_old_file_whole(capsys, fitted, monkeypatch):
    written = fitted / "vehicle.yaml"
    written.write_text("old")
    before = set(fitted.iterdir())

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    code, _, err = run(capsys, "--log", fitted, "--force")
    assert code == 1
    assert err == (
        f"companion: {written}: cannot write the identified response: No space left on device"
    )
    assert written.read_text() == "old"
    assert set(fitted.iterdir()) == before


def test_after_a_flight_a_full_disk_leaves_the_fit_for_another_place(capsys, fitted, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    flown = SimpleNamespace(result="ok", log=fitted)
    monkeypatch.setattr(identify, "_fly_doublets", lambda *_: flown)
    monkeypatch.setattr(os, "fsync", full)
    code, _, err = run(capsys, "--config", fitted / "my.yaml")
    assert code == 1
    assert err.endswith(
        "cannot write the identified response: No space left on device; the flight is recorded: "
        f"run `companion identify --log {fitted} --out FILE`"
    )


def test_an_interrupted_fit_says_where_the_flight_is(capsys, fitted, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    flown = SimpleNamespace(result="ok", log=fitted)
    monkeypatch.setattr(identify, "_fly_doublets", lambda *_: flown)
    monkeypatch.setattr(identify, "identify_vehicle", interrupted)
    code, out, err = run(capsys, "--config", fitted / "my.yaml", "--json")
    assert code == 1
    assert json.loads(out)["result"] == (
        f"interrupted while fitting; the flight is kept in {fitted}; "
        f"fit it with companion identify --log {fitted}"
    )
    assert f"the flight is kept in {fitted}" in err
    assert not (fitted / "vehicle.yaml").exists()


def test_a_flight_that_failed_is_not_fitted(capsys, tmp_path):
    endpoint = f"udpin://127.0.0.1:{free_port()}"
    config = config_for(
        tmp_path, endpoint, flight={"connect_timeout_s": 0.3}, link={"lockstep": False}
    )
    code, out, err = run(capsys, "--config", config, "--json")
    assert code == 1
    assert "no heartbeat" in json.loads(out)["result"]
    assert "Response to body rates" not in err
    assert not list((tmp_path / "flights").glob("*/vehicle.yaml"))


def test_an_interrupted_flight_is_not_fitted(tmp_path):
    with mock_vehicle(tmp_path, full_rate=True) as mock:
        config = config_for(tmp_path, f"udpin://127.0.0.1:{mock.port}")
        process = Program("companion.cli.main", "identify", "--config", config, "--json")
        mock.until(lambda state: state["mode"] == "OFFBOARD" and state["armed"])
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=30)
        assert mock.state()["mode"] == "LOITER"
    assert process.returncode == 1, err
    assert json.loads(out)["result"] == "interrupted by SIGTERM"
    assert "Response to body rates" not in err
    assert not list((tmp_path / "flights").glob("*/vehicle.yaml"))
