"""The configuration: defaults, and each kind of mistake told in one sentence, exit code 2."""

import os

import pytest

from sitl_mock.__main__ import main
from sitl_mock.config.section import ConfigError
from sitl_mock.settings import MockSettings, load_settings

MISTAKES = {
    "prot: 3": ("mock.prot", "did you mean port?"),
    "wind: {speed: 3}": ("mock.wind.speed", "did you mean speed_m_s?"),
    "lockstep: {enable: true}": ("mock.lockstep.enable", "did you mean enabled?"),
    "parameters: {COM_OBL_RC_AC: 3}": ("COM_OBL_RC_AC", "did you mean COM_OBL_RC_ACT?"),
    "parameters: {COM_OBL_RC_ACT: 3.5}": ("COM_OBL_RC_ACT must be an integer",),
    "parameters: {MPC_XY_VEL_MAX: 1.0e+300}": (
        "1e+300 does not fit into the 32 bits of MPC_XY_VEL_MAX",
    ),
    "parameters: {NAV_RCL_ACT: 1.0e+12}": ("1e+12 does not fit into the 32 bits of NAV_RCL_ACT",),
    "mass_kg: 2": ("line 2: mock.mass_kg is in the wrong section; write mock.airframe.mass_kg",),
    "prearm_delay_s: 5 s": ("line 2: mock.prearm_delay_s must be a number: write 5 without 's'",),
    "wind:\n    speed_m_s: fast": ("line 3: mock.wind.speed_m_s must be a number: write digits",),
    "wind:\n\tspeed_m_s: 2": ("line 3: a tab is used where YAML requires spaces",),
    "speed: fast": ("mock.speed", "number"),
    "speed: -1": ("mock.speed", "at least 0.01"),
    "faults: [{kind: drop, probabilty: 1}]": ("did you mean probability?",),
    "faults: [{kind: dropp}]": (
        "line 2: mock.faults.0: there is no kind 'dropp'; did you mean drop?; "
        "kinds are drop, delay, duplicate, reorder, corrupt, stop_telemetry, ",
    ),
    "faults: [{kind: 7}]": ("mock.faults.0: there is no kind '7'; kinds are drop, delay, ",),
    "faults: [{at_s: 3}]": ("mock.faults.0 needs a kind; kinds are drop, delay, ",),
    "faults: [drop]": ("mock.faults.0 must be a mapping of keys to values (got 'drop')",),
    "faults: {kind: drop}": ("mock.faults must be a list (got {'kind': 'drop'})",),
    "lockstep: {bundle: maybe}": ("mock.lockstep.bundle must be true or false (got 'maybe')",),
    "signing: {passphrase_file: 5}": ("mock.signing.passphrase_file must name a file (got 5)",),
    "signing: {link_id: 5}": ("mock.signing.passphrase_file is missing",),
    "seed: 1.5": ("mock.seed must be a whole number (got 1.5)",),
    "wind: {speed_m_s: [1]}": ("mock.wind.speed_m_s must be a number (got [1])",),
    "autopilot: px5": ("mock.autopilot must be px4 or ardupilot (got 'px5')",),
    "airframe: {inertia_kg_m2: [1]}": ("the list has 1 values and needs 3 (got [1])",),
    "airframe: {inertia_kg_m2: [1, 1, 1, 1]}": ("mock.airframe.inertia_kg_m2 has 4 values",),
    "battery: 5": ("mock.battery must be a mapping of keys to values (got 5)",),
    "lockstep: 5": ("mock.lockstep",),
    "airframe: heavy": ("mock.airframe", "sih, unlike-axes"),
    "rate_loop: {roll: {proportional: 1}}": ("mock.rate_loop.roll",),
}


@pytest.mark.parametrize(("text", "words"), MISTAKES.items(), ids=MISTAKES)
def test_mistakes(text, words, tmp_path, capsys):
    path = tmp_path / "mock.yaml"
    path.write_text(f"mock:\n  {text}\n")
    assert main(["--config", str(path), "--check"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert "nput " not in errors, "the words of pydantic"
    assert str(path) in errors
    for word in words:
        assert word in errors


@pytest.mark.parametrize("text", ["mock: [1]", "mock: [", "- 1", "\x00"])
def test_what_is_no_mapping(text, tmp_path):
    path = tmp_path / "mock.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"mock\.yaml"):
        load_settings(path, {})


def test_a_file_that_is_no_text_file(tmp_path):
    (tmp_path / "binary.yaml").write_bytes(b"mock: \xff")
    (tmp_path / "large.yaml").write_bytes(b"#" * 250_001)
    os.mkfifo(tmp_path / "pipe.yaml")
    for name, words in (
        ("pipe.yaml", "is not a regular file"),
        ("binary.yaml", "is not text in UTF-8"),
        ("large.yaml", "is larger than 250 kB"),
    ):
        with pytest.raises(ConfigError, match=f"{name}: {words}$"):
            load_settings(tmp_path / name, {})


def test_a_missing_file(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_settings(tmp_path / "none.yaml", {})


@pytest.mark.parametrize("text", ["", "mock:", "other: {x: 1}", "mock: {lockstep: }"])
def test_other_sections_are_ignored_and_defaults_hold(text, tmp_path):
    path = tmp_path / "mock.yaml"
    path.write_text(text)
    assert load_settings(path, {}) == MockSettings()


def test_the_command_line_goes_before_the_file(tmp_path):
    path = tmp_path / "mock.yaml"
    path.write_text("mock: {port: 1000, seed: 3, lockstep: {period_ms: 5}}")
    settings = load_settings(path, {"port": 2000, "lockstep": {"enabled": True}})
    assert (settings.port, settings.seed) == (2000, 3)
    assert (settings.lockstep.enabled, settings.lockstep.period_ms) == (True, 5)


def test_each_vehicle_has_its_own_ports_and_luck():
    settings = MockSettings(port=14540, gcs_port=14550, control_port=9000, seed=7)
    third = settings.for_vehicle(2)
    assert (third.port, third.gcs_port, third.control_port, third.seed) == (14542, 14552, 9002, 9)
    assert MockSettings(gcs_port=0).for_vehicle(2).gcs_port == 0


def test_check_reads_the_passphrase(tmp_path, capsys):
    path = tmp_path / "mock.yaml"
    path.write_text("mock: {signing: {passphrase_file: none.txt}}\n")
    assert main(["--config", str(path), "--check"]) == 2
    assert "mock.signing.passphrase_file: " in capsys.readouterr().err


def test_check_says_so(capsys):
    assert main(["--check"]) == 0
    assert "valid" in capsys.readouterr().out
