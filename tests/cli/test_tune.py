"""`companion tune`, as a user calls it; the flights are in `tests/tuning/test_flights.py`."""

import json
import shutil

import pytest
import yaml

from companion.cli import tune as command
from companion.cli.main import main
from companion.config.files import load, shipped
from companion.tuning.flights import TRIAL_FLIGHTS, TrialResult
from tests.tuning.test_noise import Log, flown, still, white


def run(capsys, *arguments):
    code = main(["tune", *(str(argument) for argument in arguments)])
    captured = capsys.readouterr()
    return code, captured.out, " ".join(captured.err.split())


@pytest.fixture
def vehicle(tmp_path):
    path = tmp_path / "flight" / "vehicle.yaml"
    path.parent.mkdir()
    shutil.copy(shipped("vehicle-px4.yaml"), path)
    return path


def test_it_writes_a_file_that_a_configuration_includes(vehicle, tmp_path, capsys):
    config = tmp_path / "my.yaml"
    config.write_text("guidance: {drag_per_s: 1.0}\nplanner: {gain_per_s: 4.0}\n")
    out = tmp_path / "tuned.yaml"
    code, told, _ = run(capsys, vehicle, "--config", config, "--out", out, "--no-flights", "--json")
    assert code == 0
    figures = json.loads(told.splitlines()[-1])
    tuned = load(out)
    assert tuned.vehicle.lag_ms == 74.8
    assert tuned.planner.gain_per_s == figures["proposed"]["planner"]["gain_per_s"]
    assert tuned.guidance.drag_per_s == 1.0
    assert figures["expected"]["after"]["gain_margin_db"] >= 6.0
    assert figures["expected"]["after"]["phase_margin_deg"] >= 30.0
    assert yaml.safe_load(out.read_text())["include"] == "flight/vehicle.yaml"
    including = tmp_path / "flown.yaml"
    including.write_text(f"include: {out.name}\n")
    assert load(including).guidance == tuned.guidance
    code, _, error = run(capsys, vehicle, "--output", out, "--no-flights")
    assert code == 2
    assert "exists; choose another file with --out," in error


def test_the_users_own_configuration_is_not_told_to_include_what_includes_it(vehicle, capsys):
    own = vehicle.with_name("my.yaml")
    own.write_text(f"include: {vehicle.name}\nlimits: {{max_tilt_deg: 20}}\n")
    code, told, _ = run(capsys, own, "--config", own, "--no-flights")
    tuned = vehicle.with_name("tuned.yaml")
    assert code == 0
    assert f"Fly it with --config {tuned}; do not include it in {own}." in told
    assert "Let your configuration include it" not in told
    assert load(tuned).limits.max_tilt_deg == 20.0  # so it can be flown itself
    code, told, _ = run(capsys, vehicle, "--config", own, "--no-flights", "--force")
    assert code == 0
    assert "Let your configuration include it" in told


def test_a_folder_gives_its_configuration_and_the_drag_that_was_learned(vehicle, tmp_path, capsys):
    folder = vehicle.parent
    (folder / "config.yaml").write_text(
        "planner: {name: first-order, gain_per_s: 3.0}\nflight: {maneuvers: [identify]}\n"
    )
    learned = {"drag_per_s": 0.7, "quadratic_drag_per_m": 0.01, "top_speed_m_s": 5.0}
    (tmp_path / "learned-1.json").write_text(json.dumps(learned))
    code, told, _ = run(capsys, folder, "--no-flights")
    assert code == 0, told
    text = (folder / "tuned.yaml").read_text()
    assert "# was 3; " in text
    assert load(folder / "tuned.yaml").guidance.drag_per_s == 0.7


def test_what_cannot_be_tuned_is_said_in_a_sentence(vehicle, tmp_path, capsys):
    code, _, error = run(capsys, tmp_path / "nowhere.yaml")
    assert code == 2
    assert "does not exist; name the file or the flight folder" in error
    vehicle.write_text("thrust: {hover_thrust: 0.4}\n")
    code, _, error = run(capsys, vehicle, "--no-flights")
    assert code == 2
    assert "are not known; run `companion identify`" in error
    code, _, error = run(capsys, vehicle, "--output", tmp_path / "missing" / "x.yaml")
    assert code == 2
    assert "there is no folder" in error


def test_the_noise_of_the_flight_in_the_folder_counts(vehicle, capsys):
    folder = vehicle.parent
    (folder / "config.yaml").write_text("guidance: {drag_per_s: 1.0}\n")
    expected = {}
    for name, noise in (("quiet", 0.002), ("loud", 0.2)):
        log = Log(folder / "flight.tlog")
        log.heartbeat()
        flown(log, white(noise, 1), white(noise, 2))
        log.closed()
        code, told, error = run(capsys, folder, "--no-flights", "--json", "--force")
        assert code == 0, error
        expected[name] = json.loads(told.splitlines()[-1])["expected"]["before"]
    noise = [expected[name]["error_by_noise_m"] for name in ("quiet", "loud")]
    assert noise[1] > 20.0 * noise[0]


def test_what_is_no_flight_folder_needs_a_vehicle_file(tmp_path, capsys):
    for source in (tmp_path, tmp_path / "nowhere"):
        code, _, error = run(capsys, source, "--config", shipped("px4.yaml"), "--no-flights")
        if source.exists():
            assert code == 0, error  # the configuration knows the vehicle
            assert "lag_ms: 74.8" in (tmp_path / "tuned.yaml").read_text()
            (tmp_path / "tuned.yaml").unlink()
        else:
            (tmp_path / "tuned.yaml").touch()  # an output that exists is not told before
            code, _, error = run(capsys, source, "--config", shipped("px4.yaml"), "--no-flights")
            assert code == 2
            assert "does not exist; name the file or the flight folder" in error
    (tmp_path / "empty").mkdir()
    code, _, error = run(capsys, tmp_path / "empty", "--no-flights")
    assert code == 2
    assert "vehicle.yaml does not exist" in error


def test_both_configurations_are_flown_on_each_course_and_told(vehicle, capsys, monkeypatch):
    asked = []

    def fly(config, trial, autopilot):
        asked.append((trial.name, autopilot, config.planner.gain_per_s))
        ok = len(asked) != 2
        return (
            TrialResult("ok", 0.2, 0.3, 0.1, 0.5, 0.0, 5.0)
            if ok
            else TrialResult("the fence was left")
        )

    monkeypatch.setattr(command, "fly_trial", fly)
    config = vehicle.with_name("my.yaml")
    config.write_text("guidance: {drag_per_s: 1.0}\nplanner: {gain_per_s: 4.0}\n")
    code, out, error = run(capsys, vehicle, "--config", config, "--json")
    assert code == 1  # a flight with the proposal failed
    figures = json.loads(out.splitlines()[-1])
    names = [trial.name for trial in TRIAL_FLIGHTS]
    assert [each[0] for each in asked] == [name for name in names for _ in range(2)]
    assert {each[1] for each in asked} == {"px4"}
    assert [each[2] == 4.0 for each in asked[:2]] == [True, False]
    first = figures["flights"][names[0]]
    assert first["before"]["reported"] == 0.2
    assert (first["after"]["result"], first["after"]["true"]) == ("the fence was left", None)
    assert f"flying the {names[0]} on the px4 mock vehicle…" in error


def test_damaged_records_of_the_flight_are_told(vehicle, capsys):
    folder = vehicle.parent
    (folder / "config.yaml").write_text("guidance: {drag_per_s: 1.0}\n")
    log = Log(folder / "flight.tlog")
    log.heartbeat()
    flown(log, still, still, seconds=9.0)
    data = bytearray(log.closed().read_bytes())
    data[9000] ^= 0xFF
    log.path.write_bytes(data)
    code, _, error = run(capsys, folder, "--no-flights", "--json")
    assert code == 0
    assert f"{log.path}: damaged at 1 place, the first after " in error


def test_a_configuration_with_a_mock_vehicle_gets_a_file_that_it_can_include(tmp_path, capsys):
    """It wrote a file that included the configuration, and then refused its own file."""
    out = tmp_path / "tuned.yaml"
    code, told, error = run(capsys, shipped("mock-px4.yaml"), "--out", out, "--no-flights")
    assert (code, error) == (0, "")
    assert "Let your configuration include it" in told
    own = tmp_path / "mine.yaml"
    own.write_text("include: tuned.yaml\nmock: {autopilot: px4}\n")
    assert load(own).vehicle == load(shipped("mock-px4.yaml")).vehicle
