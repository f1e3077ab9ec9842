"""The record of a flight flies again, from any working folder."""

import pytest
import yaml

from companion.cli.main import main
from companion.config import trajectory_file
from companion.config.files import load
from companion.flight import flown_config
from companion.flight.maneuvers import configured_maneuvers
from tests.flight.programs import checked_here

SHARES = [k / 120 for k in range(121)]
TABLE = "t,x,y,z\n" + "".join(
    f"{6 * u},{2 * u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)},0,0\n" for u in SHARES
)
FIGURES = {
    "path.csv": TABLE,
    "circle.yaml": "circle: {radius_m: 3, speed_m_s: 1}\n",
    "table.yaml": "csv: {file: ../tables/path.csv, frame: nwu}\n",
    "beside.yaml": "# mine\ncsv: {file: path.csv}\n",
}


@pytest.fixture
def home(tmp_path):
    """A user's folder: a configuration with an include, a vehicle file, paths and tables."""
    for folder in ("parts", "paths", "tables", "flight", "elsewhere"):
        (tmp_path / folder).mkdir()
    for name, text in FIGURES.items():
        (tmp_path / "paths" / name).write_text(text)
    (tmp_path / "tables" / "path.csv").write_text(TABLE)
    (tmp_path / "parts" / "vehicle.yaml").write_text("vehicle: {lag_ms: 47, dead_time_ms: 40}\n")
    (tmp_path / "parts" / "key").write_text("sesame\n")
    return tmp_path


def configured(home, name):
    path = home / "my.yaml"
    path.write_text(
        "include: parts/vehicle.yaml\n"
        f"flight: {{maneuvers: [trajectory], trajectory: paths/{name}}}\n"
        "link: {signing_key_file: parts/key}\n"
        "mock: {signing: {passphrase_file: parts/key}}\n"
    )
    return path


@pytest.mark.parametrize("name", FIGURES)
def test_a_record_describes_the_same_flight_from_any_folder(home, monkeypatch, name):
    monkeypatch.chdir(home / "paths")
    # A process is started by test_configs.
    monkeypatch.setattr("companion.cli.config.check_mock", checked_here)
    config = load(configured(home, name))
    before = configured_maneuvers(config).parts[0]
    flown_config.record(config, home / "flight")
    for folder in ("paths", "tables", "parts/vehicle.yaml"):
        (home / folder).rename(home / f"{folder}.away")
    monkeypatch.chdir(home / "elsewhere")
    again = load(home / "flight" / "config.yaml")
    after = configured_maneuvers(again).parts[0]
    for time in (0.0, 0.5, 1.3):
        assert after.trajectory.at(time) == before.trajectory.at(time)
    assert again.vehicle == config.vehicle
    assert again.link.signing_key_file == home / "parts" / "key"
    assert not (home / "flight" / "key").exists()
    assert again.mock == {"signing": {"passphrase_file": str(home / "parts" / "key")}}
    assert main(["check-config", str(home / "flight" / "config.yaml")]) == 0


def test_a_record_of_a_record_is_the_same(home):
    config = load(configured(home, "table.yaml"))
    flown_config.record(config, home / "flight")
    first = home / "flight" / "config.yaml"
    flown_config.record(load(first), home / "elsewhere")
    assert (home / "elsewhere" / "config.yaml").read_text() == first.read_text()


def test_a_file_that_needs_no_change_is_copied_as_it_is(home):
    flown_config.record(load(configured(home, "beside.yaml")), home / "flight")
    assert (home / "flight" / "trajectory" / "beside.yaml").read_text() == FIGURES["beside.yaml"]


def test_a_trajectory_that_is_not_flown_is_not_copied(home):
    path = configured(home, "circle.yaml")
    path.write_text(path.read_text().replace("[trajectory]", "[hover]"))
    flown_config.record(load(path), home / "flight")
    assert not (home / "flight" / "trajectory").exists()
    kept = yaml.safe_load((home / "flight" / "config.yaml").read_text())["flight"]["trajectory"]
    assert kept == str(home / "paths" / "circle.yaml")


def test_the_table_may_have_the_name_of_the_file_that_names_it(home):
    (home / "paths" / "odd.yaml").write_text("csv: {file: ../tables/odd.yaml}\n")
    (home / "tables" / "odd.yaml").write_text(TABLE)
    flown_config.record(load(configured(home, "odd.yaml")), home / "flight")
    copy = home / "flight" / "trajectory" / "odd.yaml"
    original = trajectory_file.load(home / "paths" / "odd.yaml")
    assert trajectory_file.load(copy).at(1.0) == original.at(1.0)


def test_the_command_line_names_files_relative_to_the_working_folder(home, monkeypatch, capsys):
    path = configured(home, "none.yaml")
    monkeypatch.chdir(home / "tables")
    words = "path.csv: the column"
    (home / "tables" / "path.csv").write_text("t,x,y\n0,0,0\n1,0,0\n2,0,0\n3,0,0\n")
    for option in (["--trajectory", "path.csv"], ["--set", "flight.trajectory=path.csv"]):
        assert main(["fly", "--config", str(path), *option]) == 2
        assert f"companion: {words}" in capsys.readouterr().err
