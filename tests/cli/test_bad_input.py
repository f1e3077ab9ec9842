"""Bad input gets one clear sentence and exit code 2, before anything is sent."""

import importlib.util
import socket
import sys
from pathlib import Path

import pytest

import companion
from companion import extras
from companion.cli.main import main
from companion.mavlink.transport.free_port import free_port


def run(capsys, *arguments):
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as exit_:  # argparse's own way
        code = exit_.code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    return code, captured.out, " ".join(captured.err.split())


def config(tmp_path, text):
    path = tmp_path / "vehicle.yaml"
    path.write_text(f"recording: {{directory: {tmp_path}/flights}}\n{text}")
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("limts: {}", "`limts` is not a known key; did you mean `limits`?"),
        ("limits: {max_tilt: 30}", "`limits.max_tilt` is not a known key; did you mean"),
        ("limits: {max_tilt_deg: 90}", "`limits.max_tilt_deg`"),
        ("limits: {min_thrust: 0.9}", "min_thrust must be below max_thrust"),
        ("planner: {name: so4}", "unknown planner 'so4'"),
        ("planner: {name: First_Order}", "; did you mean first-order?"),
        ("guidance: {kind: NMPC}", "unknown guidance 'NMPC'; known: linear, nmpc"),
        ("guidance: {kind: NMPC}", "; did you mean nmpc?"),
        ("limits: {MAX_TILT_DEG: 20}", "did you mean `max_tilt_deg`?"),
        ("flight: {maneuvers: [hoover]}", "(got 'hoover'); did you mean hover?"),
        ("circle: {speed_m_s: 120}", "(got 120); if it is in km/h, write 33.33"),
        ("limits: {max_tilt_deg: 0,35}", "a number has a point for decimals, not a comma"),
        ("planner: {gain_per_s: .nan}", "finite"),
        ("planner: {name: model-following}", "needs vehicle.lag_ms and vehicle.dead_time_ms"),
        (
            "flight: {maneuvers: [corners]}\nlimits: {max_tilt_deg: 25}",
            "east_coefficient²) is 0.495, and must not",
        ),
        ("flight: {maneuvers: [loop]}", "`flight.maneuvers.0`"),
        ("flight: {maneuvers: []}", "`flight.maneuvers`"),
        ("steps: {settle_s: .inf}", "`steps.settle_s`"),
        ("deadman: {silence_limit_ms: 10000}", "`deadman.silence_limit_ms`"),
        ("deadman: {silence_limit_ms: 90}", "must be at least telemetry_stale_ms"),
        ("deadman: {target_stale_ms: 30}", "two periods of guidance.rate_hz"),
        (
            "link: {attitude_rate_hz: 100}\ndeadman: {telemetry_stale_ms: 10}",
            "telemetry_stale_ms must be longer than a period of link.attitude_rate_hz",
        ),
        ("link: {attitude_rate_hz: 40}", "min_attitude_rate_hz must not exceed"),
        ("circle: {laps: 1.0e-270}", "`circle.laps` must be at least 0.01"),
        ("link: {source_component: 1}", "must not both equal"),
        ("thrust: {hover_thrust: 0.92}", "between limits.min_thrust and limits.max_thrust"),
        (
            "limits: {fence_floor_m: 4.8}",
            "limits.fence_floor_m with a margin of 0.5 m",
        ),
        (
            "safety: {fence_polygon_m: [[1, 1], [1, 5], [5, 1]]}",
            "must surround [0, 0], the point where control begins; move its corners",
        ),
        (
            "limits: {max_tilt_deg: 10}\n"
            "flight: {maneuvers: [trajectory], slow_down: true, slow_down_reserve_m_s2: 2}",
            "flight.slow_down_reserve_m_s2 2 must be less than the 1.73 m/s² that "
            "limits.max_tilt_deg 10 gives; lower it",
        ),
        ("limits: {max_tilt_deg: 10}", "steps.coefficient must not exceed the sine"),
        ("circle: {radius_m: 1, speed_m_s: 4}", "° of tilt, limits.max_tilt_deg allows 35"),
        (
            "circle: {radius_m: 26}",
            "circle: from 33.85 s on the vehicle goes up to 2.0 m outside the fence",
        ),
        (
            "flight: {maneuvers: [identify]}\nlimits: {max_tilt_deg: 15}",
            "identify.tilt_rate_deg_s × identify.tilt_duration_s must not exceed 0.75 × limits",
        ),
        (
            "flight: {maneuvers: [identify]}\nlimits: {max_tilt_rate_deg_s: 50}",
            "identify.tilt_rate_deg_s must not exceed limits.max_tilt_rate_deg_s",
        ),
        (
            "flight: {maneuvers: [identify]}\nlimits: {max_yaw_rate_deg_s: 40}",
            "identify.yaw_rate_deg_s must not exceed limits.max_yaw_rate_deg_s",
        ),
        ("a: [", "not valid YAML"),
        ("flight: {arm: 'yes'}", "`flight.arm`"),
        ("link: {backend: mavsdk, lockstep: true}", "neither fly in lockstep nor sign"),
        ("link: {backend: mavsdk, signing_key_file: key}", "neither fly in lockstep nor sign"),
        ("realtime: {scheduler: fifo, priority: 95}", "`realtime.priority`"),
        ("limits: {max_tilt_deg: 30, max_tilt_deg: 40}", "is given twice"),
        ("link: 3", "`link`"),
        ("vehicle: {dead_time_ms: true}", "`vehicle.dead_time_ms`: must not be true or false"),
        ("flight: {slow_down: 1.5}", "`flight.slow_down`"),
        ("flight: {trajectory: ''}", "`flight.trajectory`: must name a file or a folder (got '')"),
        ("link: {endpoint: nonsense}", "nonsense"),
        ("link: {endpoint: 'udpin://0.0.0.0:port'}", "port"),
        ("link: {endpoint: 'serial:///dev/not-there:57600'}", "/dev/not-there"),
        ("link: {signing_key_file: /not/there}", "/not/there"),
        ("mock: {sped: 2}", "speed"),
    ],
)
def test_a_wrong_configuration_is_refused_with_what_where_and_how(capsys, tmp_path, text, words):
    path = config(tmp_path, text)
    command = "check-config" if text.startswith("mock") else "fly"
    arguments = (command, path) if command == "check-config" else (command, "--config", path)
    code, _, err = run(capsys, *arguments)
    assert code == 2
    assert words in err


def test_a_missing_file_is_named(capsys, tmp_path):
    code, _, err = run(capsys, "fly", "--config", tmp_path / "none.yaml")
    assert code == 2
    assert "none.yaml: cannot read it: No such file or directory" in err


def test_a_busy_port_is_named(capsys, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("0.0.0.0", 0))
        port = other.getsockname()[1]
        path = config(tmp_path, f"link: {{endpoint: 'udpin://0.0.0.0:{port}'}}")
        code, _, err = run(capsys, "fly", "--config", path)
    assert code == 2
    assert f"{port}: the port is in use by another program" in err


def test_a_vehicle_that_is_not_there_is_a_failed_flight(capsys, tmp_path):
    path = config(tmp_path, "flight: {connect_timeout_s: 0.3}")
    endpoint = f"udpin://127.0.0.1:{free_port()}"
    code, out, _ = run(capsys, "fly", "--config", path, "--endpoint", endpoint)
    assert code == 1
    assert "no heartbeat" in " ".join(out.split())


def test_a_recording_folder_that_cannot_be_made_is_named(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    path = tmp_path / "c.yaml"
    path.write_text(f"recording: {{directory: {tmp_path}/file/flights}}")
    code, _, err = run(capsys, "fly", "--config", path)
    assert code == 2
    assert "recording.directory: cannot make" in err


def test_an_unknown_maneuver_names_the_known(capsys, tmp_path):
    code, _, err = run(capsys, "fly", "--config", config(tmp_path, ""), "--maneuvers", "loop")
    assert code == 2
    assert "must be hover, steps, circle, corners, identify or trajectory (got 'loop')" in err


def test_check_config_refuses_what_a_flight_would_refuse(capsys, tmp_path):
    far = tmp_path / "far.yaml"
    far.write_text("line: {to_m: [400, 0, 0], speed_m_s: 2}")
    for text, words in (
        ("link: {endpoint: nonsense}", "nonsense"),
        ("link: {signing_key_file: /not/there}", "/not/there"),
        ("flight: {maneuvers: [trajectory]}", "flight.trajectory: name a file"),
        ("flight: {maneuvers: [trajectory], trajectory: /not/there.yaml}", "/not/there.yaml"),
        (
            f"flight: {{maneuvers: [trajectory], trajectory: {far}}}",
            "make the path smaller, or widen the fence",
        ),
    ):
        code, _, err = run(capsys, "check-config", config(tmp_path, text))
        assert (code, words in err) == (2, True)


def test_a_maneuver_from_the_command_line_must_fit_the_limits(capsys, tmp_path):
    path = config(tmp_path, "limits: {max_tilt_deg: 10}\nflight: {maneuvers: [hover]}")
    code, _, err = run(capsys, "fly", "--config", path, "--maneuvers", "steps")
    assert code == 2
    assert "the command line: steps.coefficient must not exceed" in err


@pytest.mark.parametrize(
    ("module", "extra", "arguments"),
    [("mavsdk", "mavsdk", ("bench", "link")), ("matplotlib", "plot", ("plot", "flights/x"))],
)
def test_a_missing_extra_is_one_sentence(capsys, monkeypatch, module, extra, arguments):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == module else found(name)
    )
    code, _, err = run(capsys, *arguments)
    assert code == 2
    command = f"{sys.executable} -m pip install -e '{Path(companion.__file__).parents[1]}[{extra}]'"
    assert f"needs {module}; install it with: {command}" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("link: {backend: mavsdk}", "link.backend: mavsdk needs mavsdk"),
        ("guidance: {kind: nmpc}\nvehicle: {lag_ms: 25.0}", "guidance.kind: nmpc needs casadi"),
    ],
)
def test_a_key_whose_extra_is_not_installed_is_named(capsys, tmp_path, monkeypatch, text, words):
    monkeypatch.setattr(importlib.util, "find_spec", lambda *_: None)
    path = config(tmp_path, text)
    code, _, err = run(capsys, "fly", "--config", path)
    assert code == 2
    assert f"{words}; install it with: {sys.executable}" in err
    code, out, _ = run(capsys, "check-config", path)
    assert code == 0  # the computer that flies may have it
    assert f"warning: {words}; install it with" in out


def test_the_command_for_an_extra_is_the_one_that_works_here(monkeypatch, tmp_path):
    monkeypatch.setattr(extras, "_CLONE_FOLDER", tmp_path)
    monkeypatch.setattr(sys, "executable", str(tmp_path / ".venv/bin/python"))
    assert extras.pip_command("plot").endswith(" -m pip install 'mavlink-companion[plot]'")
    (tmp_path / "pyproject.toml").touch()
    monkeypatch.chdir(tmp_path)
    assert extras.pip_command("plot") == ".venv/bin/python -m pip install -e '.[plot]'"


def test_lockstep_on_the_command_line_does_not_go_with_mavsdk(capsys, tmp_path):
    path = config(tmp_path, "link: {backend: mavsdk}")
    code, _, err = run(capsys, "fly", "--config", path, "--lockstep")
    assert code == 2
    assert "neither fly in lockstep nor sign" in err


def test_what_realtime_requires_and_is_refused_is_named_and_nothing_is_flown(capsys, tmp_path):
    path = config(tmp_path, "realtime: {cpu_affinity: [1023], required: true}")
    endpoint = f"udpin://127.0.0.1:{free_port()}"
    code, _, err = run(capsys, "fly", "--config", path, "--endpoint", endpoint)
    assert code == 2
    assert "processor 1023: not granted: processor 1023 is not available to this program" in err
    assert list((tmp_path / "flights").iterdir()) == []


@pytest.mark.parametrize(
    "arguments", [(), ("fly",), ("bench",), ("check-config",), ("identify",), ("hover",)]
)
def test_wrong_usage_exits_with_2(capsys, arguments):
    code, _, err = run(capsys, *arguments)
    assert code == 2
    assert "usage" in err
