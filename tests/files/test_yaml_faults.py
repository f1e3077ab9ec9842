"""What a configuration's commonest mistakes are told: one sentence with file, line and remedy."""

import re
from math import inf, nan

import pytest

from companion.campaign.campaign_file import CampaignFile, FaultScenario
from companion.config import Config
from companion.config.files import load, with_assignments
from companion.config.reference import keys
from companion.config.trajectory_file import TrajectoryFile
from companion.files import bounded_yaml
from companion.files.yaml_file import ConfigError, Section, validated


def told(tmp_path, text):
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"{path}, line ")
    return str(caught.value).removeprefix(f"{path}, ")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("limits:\n\tmax_tilt_deg: 20\n", "line 2: a tab is used where YAML requires spaces"),
        ("limits:\n  max_tilt_deg: 20 deg\n", "line 2: `limits.max_tilt_deg` must be a number: "),
        (
            "limits: {max_tilt_deg: 20 deg}",
            "write 20 without 'deg', because the key's name gives the",
        ),
        ("limits: {max_tilt_deg: 0.35 rad}", "must be a number: write 20.05 (got '0.35 rad')"),
        ("thrust: {hover_thrust: 49%}", "must be a number: write 0.49 (got '49%')"),
        ("limits: {max_tilt_deg: '20'}", "write 20 without quotation marks (got '20')"),
        ("limits: {max_tilt_deg: '20,5'}", "write 20.5, with a point for decimals"),
        ("limits: {max_tilt_deg: steep}", "write digits, with a point for decimals"),
        (
            "limits:\n\n  max_tilt_deg: 0.35\n",
            "line 3: `limits.max_tilt_deg` must be at least 5 (got",
        ),
        ("limits: {max_tilt_deg: 0.35}", "(got 0.35); if it is in rad, write 20.05"),
        ("deadman: {telemetry_stale_ms: 0.1}", "if it is in s, write 100"),
        ("thrust: {hover_thrust: 49}", "if it is in %, write 0.49"),
        ("guidance: {disturbance_bandwidth_rad_s: 100}", "if it is in °/s, write 1.745"),
        ("max_tilt_deg: 20", "is in the wrong section; write `limits.max_tilt_deg`"),
        ("limits: {gain_per_s: 4}", "is in the wrong section; write `planner.gain_per_s`"),
        ("duration_s: 4", "write `hover.duration_s` or `steps.duration_s` or `corners.duration_s`"),
        ("radius: 4", "did you mean `circle.radius_m`?"),
        ("max_tlt_deg: 4", "did you mean `limits.max_tilt_deg`?"),
        ("limits: {max_tilt: 4}", "did you mean `max_tilt_deg`?"),
        ("limits: {max_tilt_deg: }", "has no value; write one, or take the key out"),
        ("limits: 20", "`limits` is a section: write its keys on the lines below it, indented"),
        ("limits:\n  max_tilt_deg:20\n", "each as `key: value`"),
        ("flight: {maneuvers: hover}", "is a list: write `[hover]`"),
        ("flight: {maneuvers: []}", "`flight.maneuvers` has 0 values; it needs at least 1"),
        (
            "safety: {fence_polygon_m: [[0, 0], [5, 0], [5]]}",
            "_m.2` has 1 value; it needs 2 (got [5])",
        ),
        ("safety: {fence_polygon_m: [[0, 0, 0]]}", "_m.0` has 3 values; it needs 2 (got"),
        ("recording: {directory: 5}", "`recording.directory` must name a file or a folder (got 5)"),
        ("limits: {rate_limit: tigt}", "must be tight or paper (got 'tigt'); did you mean tight?"),
        ("limits: {max_tilt_deg: .nan}", "`limits.max_tilt_deg` must be a finite number (got nan)"),
        ("limits: {max_tilt_deg: [20]}", "`limits.max_tilt_deg` must be a number (got [20])"),
        ("thrust: {hover_thrust: 0.95}", "`thrust.hover_thrust` must be less than 0.95 (got 0.95)"),
        ("link: {target_system: 1.5}", "`link.target_system` must be a whole number (got 1.5)"),
        ("link: {endpoint: 5}", "`link.endpoint` must be a text (got 5)"),
        ("vehicle: {identified: ''}", "`vehicle.identified` must not be empty (got '')"),
        ("safety: {fence_polygon_m: [[0, 0], [5, 0]]}", "fence_polygon_m must have at least three"),
        ("safety: {fence_polygon_m: [5]}", "`safety.fence_polygon_m.0` is a list: write `[5]`"),
        ("safety: {fence_polygon_m: {a: 5}}", "_polygon_m` must be a list (got a section)"),
        ("limits.max_tilt_deg: 20", "contains a dot; write `limits: {max_tilt_deg: 20}`"),
        ("corners: {coefficient: 0.1}", "`steps.coefficient`, or here `north_coefficient`"),
        ("deadman: {stale_ms: 100}", "did you mean `telemetry_stale_ms`?"),
    ],
)
def test_a_mistake_is_told_with_its_line_and_its_remedy(tmp_path, text, sentence):
    assert sentence in told(tmp_path, text)


VALUES = (
    None, True, -1, 0, 1.5, 1e9, nan, inf, "", "x", "x" * 2000, "20 ms", [], [1], [[1]], [1, 2, 3],
    ["a"], [None], {}, {"a": 1}, [{}], [[1, 2], [3]], [[1, 2, 3]], 10**400,
)  # fmt: skip
PYDANTIC = re.compile(r"[Ii]nput |[Ff]ield required|valid|tuple|constrained|literal|pattern|pydant")


def sections(section=Section):
    for each in section.__subclasses__():
        yield each
        yield from sections(each)


SECTIONS = [Config, TrajectoryFile, CampaignFile, *sections()]


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_no_value_of_any_key_is_refused_in_the_words_of_pydantic(section):
    refused = 0
    for key in section.model_fields:
        for value in VALUES:
            try:
                validated({key: value}, "a file", section)
            except ConfigError as error:
                refused += 1
                said = str(error).replace(repr(value), "").replace("x" * 60, "")
                assert not PYDANTIC.search(said.replace("invalid", "")), said
    assert refused


def test_an_error_in_one_of_several_forms_is_told_once():
    """`ends` of a campaign's fault is a list, or a section by phase."""
    for value, words in (
        ("ok", "`ends` is a list: write `[ok]`"),
        (["okay"], "`ends.0` must be ground, ok, landed, held or pilot (got 'okay')"),
        ({"land": ["okay"]}, "`ends.land.0` must be ground, ok, landed, held or pilot"),
    ):
        with pytest.raises(ConfigError) as error:
            validated({"inject": [], "ends": value}, "a file", FaultScenario)
        assert words in str(error.value)
        assert str(error.value).count("`ends") == 1 + str(error.value).count("`ends: [")


def test_a_short_list_is_told_once_with_how_many_values_it_needs():
    with pytest.raises(ConfigError) as error:
        validated({"line": {"to_m": [1.0], "speed_m_s": 1.0}}, "a file", TrajectoryFile)
    assert str(error.value) == "a file: `line.to_m` has 1 value; it needs 3 (got [1.0])"


def test_what_is_no_share_of_1_is_no_percentage(tmp_path):
    assert told(tmp_path, "flight: {takeoff_height_m: 5000}").endswith("(got 5000)")


def test_two_faults_of_one_file_name_it_once(tmp_path):
    words = told(tmp_path, "max_tilt_deg: 20\nlimits:\n  fence_radius_m: 5 m\n")
    assert words.count("c.yaml") == 0
    assert "line 3: `limits.fence_radius_m`" in words or "line 1: `max_tilt_deg`" in words


@pytest.mark.parametrize("key", list(keys(Config())), ids=lambda key: key.name)
def test_every_key_in_the_wrong_section_is_told_its_own(tmp_path, key):
    wrong = "link" if key.section != "link" else "limits"
    if key.name in Config().model_dump()[wrong]:
        pytest.skip("both sections have such a key")
    sentence = told(tmp_path, f"{wrong}: {{{key.name}: 1}}\n")
    assert f"`{wrong}.{key.name}` is in the wrong section; write `" in sentence
    owners = [one.section for one in keys(Config()) if one.name == key.name]
    assert f"`{owners[0]}.{key.name}`" in sentence


def test_lines_are_those_of_keys_and_of_items():
    text = "a:\n  b: 1\n  c:\n    - 2\n    - d: 3\n      e: [4,\n        5]\nf: {g: 6}\n"
    document = bounded_yaml.read(text)
    assert document.root == {"a": {"b": 1, "c": [2, {"d": 3, "e": [4, 5]}]}, "f": {"g": 6}}
    assert document.lines == {
        ("a",): 1,
        ("a", "b"): 2,
        ("a", "c"): 3,
        ("a", "c", 0): 4,
        ("a", "c", 1): 5,
        ("a", "c", 1, "d"): 5,
        ("a", "c", 1, "e"): 6,
        ("a", "c", 1, "e", 0): 6,
        ("a", "c", 1, "e", 1): 7,
        ("f",): 8,
        ("f", "g"): 8,
    }


def test_a_key_on_the_command_line_without_its_section_is_told_it():
    with pytest.raises(ConfigError) as caught:
        with_assignments(Config(), ["max_tilt_deg=20"])
    assert str(caught.value) == (
        "--set max_tilt_deg=20: name the section, as in `limits.max_tilt_deg`"
    )
