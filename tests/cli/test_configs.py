"""The shipped configurations: complete, correct, and described by the shipped schema."""

import errno
import itertools
import os
import shlex
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from companion.cli.main import main
from companion.cli.tool_options import STARTING_FILES
from companion.config import Config
from companion.config.files import json_schema, load, with_assignments
from companion.config.flight import CircleConfig
from companion.config.reference import changed_keys, keys
from companion.config.vehicle import VehicleConfig
from companion.files.yaml_file import parse
from sitl_mock.settings import MockSettings, load_settings

CONFIGS = Path(__file__).parents[2] / "configs"
DOCS = Path(__file__).parents[2] / "docs"
VEHICLES = sorted(CONFIGS.glob("vehicle-*.yaml"))
FILES = [CONFIGS / f"{name}.yaml" for name in ("mock-px4", "px4", "mock-ardupilot", "ardupilot")]


@pytest.mark.parametrize("path", FILES, ids=[p.name for p in FILES])
def test_a_shipped_configuration_is_right_and_short(path, capsys):
    assert main(["check-config", str(path)]) == 0
    assert main(["check-config", str(path), "--set", "limits.max_tilt_deg=99"]) == 2
    *told, end = capsys.readouterr().out.splitlines()
    assert end == f"{path}: ok"
    doubts = [line for line in told if line.startswith("warning: ")]
    assert len(doubts) == (0 if "mock" in path.stem else 1)
    assert all("were not measured on this vehicle" in line for line in doubts)
    assert len(path.read_text().splitlines()) <= 40


@pytest.mark.parametrize("path", FILES, ids=[p.name for p in FILES])
def test_a_shipped_configuration_holds_only_what_differs(path):
    """But for the maneuvers, arming and what the vehicle's file says."""
    told = yaml.safe_load(path.read_text())
    differ = {(key.section, key.name) for key in changed_keys(load(path))}
    for section, values in told.items():
        if section not in ("include", "mock"):
            assert {(section, name) for name in values} <= differ, section


@pytest.mark.parametrize("path", VEHICLES, ids=[p.name for p in VEHICLES])
def test_a_shipped_vehicle_is_one_that_can_be_planned_with(path):
    data = yaml.safe_load(path.read_text())
    assert list(data) == ["vehicle"]
    assert set(data["vehicle"]) <= set(VehicleConfig.model_fields)
    assert load(path).planner_name == "model-following"


def test_a_real_vehicle_is_not_armed_by_default():
    assert Config().flight.arm is False
    assert load(CONFIGS / "px4.yaml").flight.arm is False
    assert load(CONFIGS / "ardupilot.yaml").flight.arm is False


def test_the_schema_is_the_one_that_is_printed(capsys):
    assert (CONFIGS / "companion.schema.json").read_text() == json_schema()
    assert main(["config", "--schema"]) == 0
    assert capsys.readouterr().out == json_schema()


def test_every_key_is_described():
    for section, field in Config.model_fields.items():
        model = field.annotation
        if isinstance(model, type) and issubclass(model, BaseModel):
            for key, inner in model.model_fields.items():
                assert inner.description, f"{section}.{key}"


def test_the_page_of_the_mock_vehicle_shows_every_key_with_its_default():
    page = (DOCS / "mock-vehicle.md").read_text()
    shown = yaml.safe_load(
        page.split("## The section `mock`")[1].split("```yaml\n")[1].split("```")[0]
    )["mock"]
    assert list(shown) == list(MockSettings.model_fields)
    safer = MockSettings(parameters={"COM_LOW_BAT_ACT": 3, "COM_OF_LOSS_T": 0.75})
    assert load_settings(CONFIGS / "mock-px4.yaml", {}) == safer
    assert MockSettings.model_validate(shown) == safer


def test_the_whole_configuration_is_printed_as_yaml_that_means_the_defaults(capsys):
    assert main(["config"]) == 0
    assert parse(capsys.readouterr().out, "printed", Config) == Config()


@pytest.mark.parametrize("path", FILES, ids=[p.name for p in FILES])
def test_what_a_file_changes_is_printed_as_yaml_that_means_the_same(path, capsys):
    assert main(["config", "--diff", str(path)]) == 0
    printed = parse(capsys.readouterr().out, "printed", Config)
    told = load(path)
    assert printed == told.model_copy(update={"mock": None, "include": printed.include})


@pytest.mark.parametrize("path", FILES[1:2], ids=["px4"])
def test_a_file_is_printed_whole(path, capsys):
    assert main(["config", str(path)]) == 0
    out = capsys.readouterr().out
    in_flight = "changeable in flight up to its value at the start"
    assert f"max_tilt_deg: 25.0  # °, at least 5, at most 60, {in_flight}; default: 35.0" in out


def test_one_key_or_one_section_is_printed(capsys):
    assert main(["config", "--get", "limits.max_tilt_deg"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == {"limits": {"max_tilt_deg": 35.0}}
    assert main(["config", "--get", "circle"]) == 0
    assert list(yaml.safe_load(capsys.readouterr().out)["circle"]) == list(
        CircleConfig.model_fields
    )


def test_one_key_of_a_file_is_printed(tmp_path, capsys):
    own = tmp_path / "own.yaml"
    own.write_text("limits: {max_tilt_deg: 21}\n")
    assert main(["config", str(own), "--get", "limits.max_tilt_deg"]) == 0
    assert "max_tilt_deg: 21.0" in capsys.readouterr().out
    assert main(["config", str(own), "--schema"]) == 2
    assert "--schema and --markdown take none" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "hint"),
    [
        ("max_tilt", "did you mean limits.max_tilt_deg, limits.max_tilt_rate_deg_s?"),
        ("limits.max_tilt_dg", "did you mean limits.max_tilt_deg?"),
        ("max_tlt_deg", "did you mean limits.max_tilt_deg?"),
        ("limit.max_tilt_deg", "did you mean limits.max_tilt_deg?"),
        ("laops", "did you mean circle.laps?"),
        ("fence_acton", "did you mean safety.fence_action?"),
        ("take_off_timeout_s", "did you mean flight.takeoff_timeout_s?"),
        ("settel_s", "did you mean steps.settle_s, corners.settle_s, identify.settle_s?"),
        ("circel", "did you mean circle?"),
        ("xyzzy", "`companion config` prints them all"),
    ],
)
def test_a_mistyped_key_is_answered_with_the_nearest(capsys, typed, hint):
    assert main(["config", "--get", typed]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert told == f"companion: --get: there is no key `{typed}`; {hint}"


def test_a_key_whose_name_ends_in_a_unit_shows_it():
    units = {key.name: key.unit for key in keys(Config())}
    assert units["max_jerk_m_s3"] == "m/s³"
    assert [name for name, unit in units.items() if name[-1].isdigit() and not unit] == []


def test_the_page_of_the_configuration_is_the_one_that_is_printed(capsys):
    assert main(["config", "--markdown"]) == 0
    printed = capsys.readouterr().out
    assert printed in (DOCS / "configuration.md").read_text()


@pytest.mark.parametrize("name", STARTING_FILES)
def test_a_starting_file_can_be_checked_and_is_never_replaced(name, tmp_path, capsys):
    out = tmp_path / "mine.yaml"
    assert main(["init", name, "--out", str(out)]) == 0
    assert main(["check-config", str(out)]) == 0
    shipped = load(CONFIGS / f"{STARTING_FILES[name]}.yaml")
    assert load(out).model_copy(update={"include": shipped.include}) == shipped
    before = out.read_text()
    assert main(["init", name, "--out", str(out)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert out.read_text() == before


def test_a_full_disk_leaves_no_half_of_a_starting_file(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    out = tmp_path / "mine.yaml"
    assert main(["init", "px4", "--out", str(out)]) == 2
    assert "mine.yaml: No space left on device" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "key"),
    [("link: {endpoint: /dev/x}", "link.endpoint"), ("serve: {clients: [x]}", "serve.clients")],
)
def test_a_wrong_endpoint_is_told_with_its_file_and_key(text, key, tmp_path, capsys):
    path = tmp_path / "c.yaml"
    path.write_text(text)
    assert main(["check-config", str(path)]) == 2
    assert f"{path}: {key}: endpoint '" in " ".join(capsys.readouterr().err.split())


def test_a_file_that_changes_nothing_says_so(tmp_path, capsys):
    path = tmp_path / "c.yaml"
    path.write_text("# nothing yet\n")
    assert main(["config", "--diff", str(path)]) == 0
    assert capsys.readouterr().out == f"# {path} changes no default\n"


def test_a_file_that_changes_nothing_is_told_when_it_is_checked(tmp_path, capsys):
    """An editor that had not saved left an empty file, which was called ok."""
    path = tmp_path / "c.yaml"
    told = f"warning: {path} changes no default; is this the file that you meant?"
    for text, warned in (("", True), ("# nothing yet\n", True), ("link: {lockstep: true}", False)):
        path.write_text(text)
        assert main(["check-config", str(path)]) == 0
        assert (told in capsys.readouterr().out.splitlines()) == warned


def test_a_command_to_copy_has_its_path_in_quotes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "px4", "--out", "my drone.yaml"]) == 0
    monkeypatch.setattr("sys.argv", [".venv/bin/companion"])
    assert main(["init", "px4", "--out", "my other drone.yaml"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert second.startswith("Wrote my other drone.yaml. Check it with: .venv/bin/companion ")
    for told in (first, second):
        assert main(["check-config", *shlex.split(told.partition(" check-config ")[2])]) == 0


def test_a_refused_path_names_the_key_that_every_command_takes(tmp_path, capsys):
    """`replay` has no --slow-down, but takes --set flight.slow_down=true."""
    (tmp_path / "path.csv").write_text("t,x,y,z\n0,0,0,0\n1,4,0,0\n2,4,4,0\n3,4,4,2\n")
    path = tmp_path / "a.yaml"
    path.write_text("flight: {trajectory: path.csv, maneuvers: [trajectory]}\n")
    assert main(["check-config", str(path)]) == 2
    assert "(--slow-down, or flight.slow_down: true, finds how" in capsys.readouterr().err
    assert main(["check-config", str(path), "--set", "flight.slow_down=true"]) == 0


def test_a_table_whose_speed_jumps_may_be_smoothed_more(tmp_path, capsys):
    """With the default cutoff the corners of this square take 20 times the allowed rate."""
    legs = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0)]
    points = [(0, 0)] * 20
    for (x, y), (next_x, next_y) in itertools.pairwise(legs):
        shares = [step / 20 for step in range(1, 21)]
        points += [(x + s * (next_x - x), y + s * (next_y - y)) for s in shares]
        points += [(next_x, next_y)] * 20
    rows = [f"{0.1 * row:.1f},{x},{y},0" for row, (x, y) in enumerate(points)]
    (tmp_path / "square.csv").write_text("\n".join(["t,x,y,z", *rows]))
    (tmp_path / "smooth.yaml").write_text("csv: {file: square.csv, cutoff_hz: 1}")
    config = tmp_path / "a.yaml"
    check = ["check-config", str(config), "--set", "flight.maneuvers=[trajectory]", "--set"]
    config.write_text("vehicle: {lag_ms: 75, dead_time_ms: 8}")
    assert main([*check, f"flight.trajectory={tmp_path}/square.csv"]) == 2
    assert "°/s of roll and pitch" in (told := capsys.readouterr().err)
    assert "smooth it more instead: name it in a YAML file with csv.cutoff_hz: 1 (" in told
    assert main([*check, f"flight.trajectory={tmp_path}/smooth.yaml"]) == 0
    capsys.readouterr()
    slow_down = ["--set", "flight.slow_down=true"]
    assert main([*check, f"flight.trajectory={tmp_path}/square.csv", *slow_down]) == 0
    told = capsys.readouterr().out
    assert "square: if the table's speed jumps, as at a corner, smooth it more instead: " in told
    assert "(-0.0 m" not in told


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("max_tilt_deg=20", "name the section, as in `limits.max_tilt_deg`"),
        ("steepness=20", "write SECTION.KEY=VALUE"),
        ("limits.max_tilt_deg", "write SECTION.KEY=VALUE"),
        ("limit.max_tilt_deg=20", "there is no section `limit`; did you mean limits?"),
        ("mock.wind.speed_m_s=5", "section `mock`, because the mock vehicle reads it from the"),
        ("limits.max_tild_deg=20", "did you mean `max_tilt_deg`?"),
        ("limits.max_tilt_deg=[", "not valid YAML"),
        ("limits.max_tilt_deg=99", "at most 60"),
    ],
)
def test_a_wrong_set_is_refused_in_a_sentence(text, words, capsys):
    assert main(["demo", "--set", text]) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_set_changes_keys_and_the_last_one_wins():
    assignments = ["limits.max_tilt_deg=20", "limits.max_tilt_deg=21", "flight.arm=true"]
    config = with_assignments(Config(), assignments)
    assert (config.limits.max_tilt_deg, config.flight.arm) == (21.0, True)


def test_a_path_that_is_not_flown_and_a_table_for_a_configuration_are_told(tmp_path, capsys):
    table = tmp_path / "path.csv"
    table.write_text("t,x,y,z\n0,0,0,0\n3,4,0,0\n6,4,4,0\n9,4,4,2\n")
    path = tmp_path / "a.yaml"
    path.write_text("flight: {trajectory: path.csv}\n")
    assert main(["check-config", str(path)]) == 0
    assert "flight.trajectory is not flown; add trajectory to" in capsys.readouterr().out
    assert main(["check-config", str(path), "--set", "flight.maneuvers=[trajectory]"]) == 0
    assert "not flown" not in capsys.readouterr().out
    assert main(["check-config", str(table)]) == 2
    assert "is a table of a trajectory, not a configuration" in capsys.readouterr().err
