"""Terminals that are not UTF-8: every command says what it has to say, in characters they have.

And standard output that is closed, full, or not read to its end.
"""

import json
import os
import re
import subprocess
import sys
from itertools import product

import pytest

from companion.cli.main import main
from companion.config.files import shipped
from companion.files.ascii_text import ascii_for
from companion.mavlink.transport.free_port import free_port
from tests.cli.test_demo import quick_demo

ASCII = {"PYTHONIOENCODING": "ascii"}
LATIN = {"PYTHONIOENCODING": "latin-1"}
C_LOCALE = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


def companion(folder, environment, *arguments):
    """A command as users start it; its exit code, and its output with its errors."""
    done = subprocess.run(
        [sys.executable, "-m", "companion", *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
    )
    return done.returncode, done.stdout


IN_ONE_PROCESS = """
import sys
from glob import glob
from companion.cli.main import main
for command in " ".join(sys.argv[1:]).split(" ; "):
    sys.argv[1:] = [path for word in command.split() for path in glob(word) or [word]]
    print(f"\\nend {main()}", flush=True)
"""


def in_one_process(folder, environment, *commands, errors=subprocess.STDOUT):
    """Like `companion`, several commands one after another: their imports cost more than they.

    Args:
        errors: where standard error goes; by default into the output, as on a terminal.

    Returns:
        the exit code and the output of each command.
    """
    words = " ; ".join(map(" ".join, commands)).split()
    done = subprocess.run(
        [sys.executable, "-c", IN_ONE_PROCESS, *words],
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=errors,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    outputs = re.split(rb"\nend (\d)\n", done.stdout)[:-1]
    return [(int(code), out) for out, code in zip(outputs[::2], outputs[1::2], strict=True)]


def assert_said(done, code, *words):
    returned, out = done
    assert returned == code, out
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
    flight = f"demo --config {quick_demo(tmp_path)} --lockstep --maneuvers steps"
    done, told = in_one_process(
        tmp_path, environment, flight.split(), ("identify", "--log", "flights/2*")
    )
    assert_said(done, 0, b"The flight was good", b"open loop", b"landing", b"Recorded in")
    if environment is not LATIN:
        assert done[1].isascii()
        assert b" deg tilted" in done[1]
        assert b"?" not in done[1]
    assert_said(told, 0, b"Response to body rates", b"vehicle.yaml")


@pytest.fixture(scope="module")
def on_ascii(tmp_path_factory):
    """What the commands say on an ASCII terminal: a refusal, help, and the doctor's word."""
    folder = tmp_path_factory.mktemp("ascii")
    (folder / "wrong.yaml").write_text("limits: {max_tilt_deg: 200}\nlink: {größe: °}\n")
    (folder / "nobody.yaml").write_text(
        f"link: {{endpoint: 'udpin://127.0.0.1:{free_port()}'}}\n"
        "flight: {connect_timeout_s: 0.2}\n"
    )
    return in_one_process(
        folder,
        ASCII,
        ("check-config", "wrong.yaml"),
        ("doctor", "--config", "nobody.yaml", "--wait", "0.1"),
    )


def test_refusals_are_told_on_any_terminal(on_ascii, tmp_path, monkeypatch, capsys):
    assert_said(on_ascii[0], 2, b"max_tilt_deg", b"gro")
    monkeypatch.chdir(tmp_path)
    code = main(["check-config", os.fsdecode(b"\xff\xc3.yaml")])
    assert_said((code, capsys.readouterr().err.encode()), 2, b"cannot read")


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
    found, shown, missing, schema = in_one_process(
        tmp_path,
        environment,
        ("check-config", "flüge/übung.yaml"),
        ("config", "flüge/übung.yaml", "--get", "limits.max_tilt_deg"),
        ("check-config", "nö.yaml"),
        ("config", "--schema"),
    )
    assert_said(found, 0, b"bung.yaml: ok")
    assert_said(shown, 0, b"max_tilt_deg: 21")
    assert_said(missing, 2, b"cannot read it")
    assert all(out.isascii() for _, out in (found, shown, missing))
    assert_said(schema, 0)
    json.loads(schema[1])


def test_help_is_told_on_any_terminal(tmp_path):
    assert_said(companion(tmp_path, ASCII, "identify", "--help"), 0, b"of tilt")


def test_the_doctor_is_told_on_any_terminal(on_ascii):
    assert_said(on_ascii[1], 1, b"no heartbeat", b"Source: HEARTBEAT")


FULL = "companion: standard output cannot be written: No space left on device\n"
OUTPUTS = {">&-": "", ">/dev/full": FULL, "| true": ""}
"""What a shell does with standard output, and what is said of it."""
COMMANDS = "config", "check-config c.yaml"
"""Long and short: a long output fails while it is printed, a short one at the end."""

FORKS = """
import gc, io, json, os, sys
import companion.cli.run, companion.cli.config
from companion.cli.main import main

gc.freeze()  # the end of a process would look for garbage among all that is imported

def redirect(output, unbuffered):
    if output == ">&-":
        os.close(1)
        sys.stdout = sys.__stdout__ = None
        return
    if output == "| true":
        reader, writer = os.pipe()
        os.close(reader)
    else:
        writer = os.open("/dev/full", os.O_WRONLY)
    os.dup2(writer, 1)
    raw = io.FileIO(1, "w", closefd=False)
    raw.name = "<stdout>"
    stream = raw if unbuffered else io.BufferedWriter(raw)
    sys.stdout = sys.__stdout__ = io.TextIOWrapper(stream, write_through=unbuffered)

results = []
for number, (command, output, unbuffered) in enumerate(json.loads(sys.argv[1])):
    process = os.fork()
    if process == 0:
        os.dup2(os.open(f"{number}.txt", os.O_WRONLY | os.O_CREAT), 2)
        redirect(output, bool(unbuffered))
        sys.argv[1:] = command.split()
        sys.exit(main())
    results.append(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))
print(json.dumps(results))
"""


@pytest.fixture(scope="module")
def without_output(tmp_path_factory):
    """The exit code and the errors of each command whose output cannot be written.

    Each ends as a program does, in a process of its own, forked from one that has imported them.
    """
    folder = tmp_path_factory.mktemp("output")
    (folder / "c.yaml").write_text("limits: {max_tilt_deg: 20}\n")
    cases = list(product(COMMANDS, OUTPUTS, ["", "1"]))
    done = subprocess.run(
        [sys.executable, "-c", FORKS, json.dumps(cases)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    errors = [(folder / f"{number}.txt").read_text() for number in range(len(cases))]
    return dict(zip(cases, zip(json.loads(done.stdout), errors, strict=True), strict=True))


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("output", OUTPUTS)
def test_output_that_cannot_be_written_is_no_traceback(without_output, command, output, unbuffered):
    code, errors = without_output[command, output, unbuffered]
    assert_no_traceback(errors)
    words = OUTPUTS[output]
    assert words in errors
    assert errors.count("No space left on device") == bool(words), "it is told once"
    if output != "| true":
        assert code == (1 if words else 0)


def assert_no_traceback(errors):
    for sign in ("internal error", "Traceback", "Exception ignored", "Errno"):
        assert sign not in errors


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("output", OUTPUTS)
def test_a_version_that_cannot_be_written_is_no_traceback(output, unbuffered):
    """It is printed by argparse, which goes on without an output."""
    done = subprocess.run(
        f"{sys.executable} -m companion --version {output}",
        shell=True,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        capture_output=True,
        text=True,
        check=False,
    )
    assert_no_traceback(done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("command", [("bench", "planner", "--seconds", "0.01"), ("study", "fig2")])
def test_figures_are_told_on_any_terminal(tmp_path, command):
    done = companion(tmp_path, ASCII, *command)
    assert_said(done, 0)
    assert done[1].isascii()


def test_standard_error_that_is_full_changes_no_exit_code(tmp_path):
    """`2>/dev/full` made a usage error a failure, and took the result of `tune --json`."""
    vehicle = str(shipped("vehicle-px4.yaml"))
    tune = ["tune", vehicle, "--no-flights", "--json", "--out", "tuned.yaml"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        (code, out), (again, _) = in_one_process(tmp_path, {}, tune, tune, errors=full)
    assert json.loads(out)["file"] == "tuned.yaml"
    assert (code, again) == (0, 2)
