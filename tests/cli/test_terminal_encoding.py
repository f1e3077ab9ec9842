"""Terminals that are not UTF-8: every command says what it has to say, in characters they have.

And standard output that is closed, full, or not read to its end.
"""

import json
import os
import subprocess
import sys

import pytest

from companion.config.files import shipped
from companion.files.ascii_text import ascii_for
from companion.mavlink.transport.free_port import free_port
from tests.cli.test_demo import quick_demo

ASCII = {"PYTHONIOENCODING": "ascii"}
LATIN = {"PYTHONIOENCODING": "latin-1"}
C_LOCALE = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


def companion(folder, environment, *arguments):
    return subprocess.run(
        [sys.executable, "-m", "companion", *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        check=False,
    )


IN_ONE_PROCESS = """
import sys
from companion.cli.main import main
codes, commands = [], " ".join(sys.argv[1:]).split(" ; ")
for command in commands:
    sys.argv[1:] = command.split()
    codes.append(main())
print(codes)
"""


def in_one_process(folder, environment, *commands):
    """Like `companion`, several commands one after another: their imports cost more than they."""
    words = " ; ".join(map(" ".join, commands)).split()
    return subprocess.run(
        [sys.executable, "-c", IN_ONE_PROCESS, *words],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        check=False,
    )


def assert_said(done, code, *words):
    out = done.stdout + done.stderr
    assert done.returncode == code, out
    for sign in (b"internal error", b"Traceback", b"codec"):
        assert sign not in out
    for word in words:
        assert word in out, out


@pytest.mark.parametrize(
    ("text", "readable"),
    [
        ("1.5 m/s² at 35° ± 2 µs…", "1.5 m/s^2 at 35 deg +- 2 us..."),
        ("ċ = p(c_d − c), ω ≤ Ω", "c = p(c_d - c), omega <= Omega"),
        ("s⁻¹ → √½", "s^-1 -> sqrt1/2"),
        ("│ ─ ┌ ⠋ Zürich 飛", "| - + * Zurich ?"),
        ("\udcff", "?"),
        ("plain \"'\\", "plain \"'\\"),
    ],
)
def test_what_ascii_lacks_is_written_such_that_it_can_be_read(text, readable):
    assert ascii_for(text) == readable


def test_no_character_is_written_as_one_that_would_break_json():
    for code in (*range(0x80, 0x3100), *range(0xD800, 0xE000), 0x1F600):
        written = ascii_for(chr(code))
        assert written.isascii()
        assert not set(written) & set('"\\')


@pytest.mark.parametrize(
    "environment",
    [
        ASCII,
        pytest.param(LATIN, marks=pytest.mark.slow),
        pytest.param(C_LOCALE, marks=pytest.mark.slow),
    ],
)
def test_a_good_flight_is_good_on_any_terminal(tmp_path, environment):
    options = ("--config", quick_demo(tmp_path), "--lockstep", "--maneuvers", "steps")
    done = companion(tmp_path, environment, "demo", *options)
    assert_said(done, 0, b"The flight was good", b"open loop", b"landing")
    assert b"Recorded in" in done.stdout  # to the very end
    if environment is not LATIN:
        assert done.stdout.isascii()
        assert b" deg tilted" in done.stdout
        assert b"?" not in done.stdout
    (log,) = (path for path in (tmp_path / "flights").iterdir() if path.is_dir())
    told = companion(tmp_path, environment, "identify", "--log", log)
    assert_said(told, 0, b"Response to body rates", b"vehicle.yaml")


def test_refusals_are_told_on_any_terminal(tmp_path):
    (tmp_path / "wrong.yaml").write_text("limits: {max_tilt_deg: 200}\nlink: {größe: °}\n")
    refused = companion(tmp_path, ASCII, "check-config", "wrong.yaml")
    assert_said(refused, 2, b"max_tilt_deg", b"gro")
    assert_said(companion(tmp_path, {}, "check-config", b"\xff\xc3.yaml"), 2, b"cannot read")


@pytest.mark.parametrize("environment", [ASCII, C_LOCALE, {**C_LOCALE, **ASCII}])
def test_files_whose_names_are_not_ascii_are_found_in_any_locale(tmp_path, environment):
    folder = tmp_path / "flüge"
    folder.mkdir()
    (folder / "grün.yaml").write_text("limits: {max_tilt_deg: 21}\n")
    (folder / "höhe.yaml").write_text("hover: {duration_s: 1}\n")
    (folder / "übung.yaml").write_text(
        "include: grün.yaml\nflight: {maneuvers: [trajectory], trajectory: höhe.yaml}\n",
        encoding="utf-8",
    )
    done = in_one_process(
        tmp_path,
        environment,
        ("check-config", "flüge/übung.yaml"),
        ("config", "flüge/übung.yaml", "--get", "limits.max_tilt_deg"),
        ("check-config", "nö.yaml"),
    )
    assert_said(done, 0, b"bung.yaml: ok", b"max_tilt_deg: 21", b"cannot read it", b"[0, 0, 2]")
    assert done.stdout.isascii()


def test_help_and_the_schema_are_told_on_any_terminal(tmp_path):
    assert_said(companion(tmp_path, ASCII, "identify", "--help"), 0, b"of tilt")
    schema = companion(tmp_path, C_LOCALE, "config", "--schema")
    assert_said(schema, 0)
    json.loads(schema.stdout)


def test_the_doctor_is_told_on_any_terminal(tmp_path):
    (tmp_path / "nobody.yaml").write_text(
        f"link: {{endpoint: 'udpin://127.0.0.1:{free_port()}'}}\n"
        "flight: {connect_timeout_s: 0.2}\n"
    )
    done = companion(tmp_path, ASCII, "doctor", "--config", "nobody.yaml", "--wait", "0.1")
    assert_said(done, 1, b"no heartbeat", b"Source: HEARTBEAT")


FULL = "companion: standard output cannot be written: No space left on device\n"


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("command", ["config", "check-config c.yaml", "--version"])
@pytest.mark.parametrize(("output", "words"), [(">&-", ""), (">/dev/full", FULL), ("| true", "")])
def test_output_that_cannot_be_written_is_no_traceback(
    tmp_path, command, output, words, unbuffered
):
    (tmp_path / "c.yaml").write_text("limits: {max_tilt_deg: 20}\n")
    done = subprocess.run(
        f"{sys.executable} -m companion {command} {output}",
        shell=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        capture_output=True,
        text=True,
        check=False,
    )
    for sign in ("internal error", "Traceback", "Exception ignored", "Errno"):
        assert sign not in done.stderr
    if command == "--version":  # printed by argparse, which goes on without an output
        return
    assert words in done.stderr
    assert done.stderr.count("No space left on device") == bool(words), "it is told once"
    if output != "| true":  # that is the code of `true`
        assert done.returncode == (1 if words else 0)


@pytest.mark.slow
@pytest.mark.parametrize("command", [("bench", "planner", "--seconds", "0.01"), ("study", "fig2")])
def test_figures_are_told_on_any_terminal(tmp_path, command):
    done = companion(tmp_path, ASCII, *command)
    assert_said(done, 0)
    assert done.stdout.isascii()


def test_standard_error_that_is_full_changes_no_exit_code(tmp_path):
    """`2>/dev/full` made a usage error a failure, and took the result of `tune --json`."""
    vehicle = str(shipped("vehicle-px4.yaml"))
    tune = ["tune", vehicle, "--no-flights", "--json", "--out", "tuned.yaml"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [sys.executable, "-c", IN_ONE_PROCESS, *tune, ";", *tune],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=full,
            check=False,
        )
    figures, codes = done.stdout.splitlines()
    assert json.loads(figures)["file"] == "tuned.yaml"
    assert json.loads(codes) == [0, 2]
    assert done.returncode == 0
