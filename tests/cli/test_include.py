"""`include` in a configuration: which key wins, and which file is blamed."""

import json

import pytest
import yaml

from companion.cli.main import main
from companion.config import Config
from companion.config.files import changed, json_schema, load, with_assignments
from companion.files.yaml_file import ConfigError


@pytest.fixture
def files(tmp_path):
    """Writes files by name, a `/` in it making a folder."""

    def write(**texts):
        for name, text in texts.items():
            path = tmp_path / (name + ".yaml")
            path.write_text(text)
        return tmp_path / "main.yaml"

    return write


def test_included_keys_stand_below_own_ones_and_beside_them(files):
    main_file = files(
        main="include: vehicle.yaml\nvehicle: {lag_ms: 11}\nlimits: {max_tilt_deg: 30}\n",
        vehicle="vehicle: {lag_ms: 50, dead_time_ms: 40}\nthrust: {hover_thrust: 0.4}\n",
    )
    config = load(main_file)
    assert (config.vehicle.lag_ms, config.vehicle.dead_time_ms) == (11.0, 40.0)
    assert config.thrust.hover_thrust == 0.4
    assert config.limits.max_tilt_deg == 30.0


def test_a_later_include_wins_over_an_earlier_one(files):
    one = "vehicle: {lag_ms: 1, dead_time_ms: 2}\n"
    main_file = files(main="include: [a.yaml, b.yaml]\n", a=one, b="vehicle: {lag_ms: 3}\n")
    vehicle = load(main_file).vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms) == (3.0, 2.0)
    main_file.write_text("include: [b.yaml, a.yaml]\n")
    assert load(main_file).vehicle.lag_ms == 1.0


def test_it_is_relative_to_the_including_file(files, tmp_path, monkeypatch):
    (tmp_path / "flights").mkdir()
    (tmp_path / "flights" / "vehicle.yaml").write_text("vehicle: {lag_ms: 5}\n")
    main_file = files(main="include: flights/vehicle.yaml\n")
    monkeypatch.chdir("/")
    assert load(main_file).vehicle.lag_ms == 5.0


def test_a_tilde_is_the_home_folder(files, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    main_file = files(
        main="include: ~/home.yaml\nrecording: {directory: ~/flights}\n",
        home="flight: {trajectory: ~/eight.yaml}\nlink: {signing_key_file: ~/key}\n",
    )
    config = load(main_file)
    assert config.recording.directory == tmp_path / "flights"
    assert config.flight.trajectory == tmp_path / "eight.yaml"
    assert config.link.signing_key_file == tmp_path / "key"
    set_by_hand = with_assignments(config, ["recording.directory=~/other"])
    assert set_by_hand.recording.directory == tmp_path / "other"


def test_an_empty_included_file_or_section_changes_nothing(files):
    main_file = files(main="include: [a.yaml, b.yaml]\nvehicle:\n", a="", b="vehicle:\n")
    assert load(main_file) == Config(include=("a.yaml", "b.yaml"))


def test_the_command_line_and_the_record_of_a_flight_see_the_merged_keys(files):
    main_file = files(main="include: a.yaml\n", a="vehicle: {lag_ms: 5}\n")
    config = changed(load(main_file), {"planner": {"name": "exact"}}, "the command line")
    assert (config.vehicle.lag_ms, config.planner.name) == (5.0, "exact")
    flown = yaml.safe_load(yaml.safe_dump(config.model_dump(mode="json")))
    assert flown["vehicle"]["lag_ms"] == 5.0
    assert "include" not in flown


@pytest.mark.parametrize(
    ("included", "words"),
    [
        (
            "vehicle: {lag: 5}",
            "a.yaml, line 1: `vehicle.lag` is not a known key; did you mean `lag_ms`?",
        ),
        (
            "vehicel: {lag_ms: 5}",
            "a.yaml, line 1: `vehicel` is not a known key; did you mean `vehicle`?",
        ),
        ("vehicle: {lag_ms: -5}", "a.yaml, line 1: `vehicle.lag_ms` must be at least 0"),
        ("vehicle: 3", "a.yaml: `vehicle` must hold keys, not 3"),
        ("- vehicle", "a.yaml: expected keys such as"),
        ("vehicle: {lag_ms: 1, lag_ms: 2}", "a.yaml, line 1: not valid YAML"),
        ("include: 3", "a.yaml: `include` must be a file or a list of files, not 3"),
        ("mock: {seed: 3}", "a.yaml: `mock` is not allowed in an included file"),
    ],
)
def test_what_is_wrong_in_an_included_file_is_told_of_that_file(files, included, words):
    main_file = files(main="include: a.yaml\nvehicle: {dead_time_ms: 30}\n", a=included)
    with pytest.raises(ConfigError) as raised:
        load(main_file)
    assert str(main_file.with_name("a.yaml")) in str(raised.value)
    assert words in str(raised.value)
    assert "main.yaml" not in str(raised.value)


def test_faults_of_several_files_are_told_each_of_its_own(files):
    main_file = files(main="include: a.yaml\nlimits: {tilt: 3}\n", a="vehicle: {lag: 5}\n")
    words = r"a\.yaml, line 1: `vehicle\.lag`.*main\.yaml, line 2: `limits\.tilt`"
    with pytest.raises(ConfigError, match=words):
        load(main_file)


def test_a_missing_included_file_is_named_with_the_file_that_includes_it(files):
    main_file = files(main="include: a.yaml\n", a="include: b.yaml\n")
    words = r"b\.yaml: cannot read it: No such file.*\(included by .*a\.yaml\)"
    with pytest.raises(ConfigError, match=words):
        load(main_file)


def test_an_included_file_may_include_and_its_own_keys_win(files, tmp_path):
    (tmp_path / "parts").mkdir()
    main_file = files(
        main="include: parts/a.yaml\nvehicle: {lag_ms: 1}\n",
        **{
            "parts/a": "include: [b.yaml, b.yaml]\nvehicle: {lag_ms: 2, dead_time_ms: 2}\n",
            "parts/b": "vehicle: {lag_ms: 3, dead_time_ms: 3, yaw_lag_ms: 3}\n",
        },
    )
    vehicle = load(main_file).vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms, vehicle.yaw_lag_ms) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ({"main": "include: main.yaml"}, "main.yaml: a file must not include itself"),
        (
            {"main": "include: a.yaml", "a": "include: ./main.yaml"},
            r"include itself: .*main\.yaml includes .*a\.yaml includes .*main\.yaml",
        ),
        (
            {"main": "include: a0.yaml"} | {f"a{n}": f"include: a{n + 1}.yaml" for n in range(9)},
            "a3.yaml: includes may be nested at most 4 files deep",
        ),
        ({"main": f"include: [{'a.yaml, ' * 33}]", "a": ""}, "more than 32 files are included"),
        (
            {
                "main": f"include: [{'a.yaml, ' * 30}]",
                "a": f"include: [{'b.yaml, ' * 30}]",
                "b": "",
            },
            "more than 32 files are included",
        ),
    ],
)
def test_includes_that_never_end_are_refused_in_one_sentence(files, texts, words):
    with pytest.raises(ConfigError, match=words):
        load(files(**texts))


@pytest.mark.parametrize("value", ["3", "[3]", "{a: b}", "", '""', "[' ']"])
def test_what_is_not_a_file_name_cannot_be_included(files, value):
    main_file = files(main=f"include: {value}\n")
    with pytest.raises(ConfigError, match="`include` must be a file or a list of files, not"):
        load(main_file)


def test_check_config_tells_it_as_usage(files, capsys):
    main_file = files(main="include: a.yaml\n", a="vehicle: {lag: 5}\n")
    assert main(["check-config", str(main_file)]) == 2
    assert "a.yaml, line 1: `vehicle.lag`" in " ".join(capsys.readouterr().err.split())


def test_the_schema_knows_include():
    include = json.loads(json_schema())["properties"]["include"]
    assert {kind["type"] for kind in include["anyOf"]} == {"string", "array"}
    assert "override keys of included files" in include["description"]
