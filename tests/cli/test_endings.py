"""Each way in which a command can end: its exit code, its sentence, and what it passes on."""

import argparse
import asyncio
import contextlib
import errno
import inspect
import io
import json
import os
import signal
import sys
from types import SimpleNamespace

import pytest

from companion.bench import flight, link, planner
from companion.bench import serve as bench_serve
from companion.cli import flights, flying, output_file
from companion.cli import main as entry
from companion.cli import serve as serving
from companion.cli.flying import write_flight_page
from companion.cli.main import main
from companion.cli.run import run
from companion.cli.terminal import FlightConsole
from companion.cli.text_streams import _transliterated
from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.extras import MissingExtraError
from companion.files.yaml_file import ConfigError
from companion.mavlink import loop
from companion.mavlink.errors import LinkError
from companion.mavlink.loop import run as run_loop
from companion.program_command import program_command

ENOSPC = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
AGAIN = f"`{program_command()} report 'a b'` tries again"

FIGURE8 = shipped("trajectories/figure8.yaml")


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (ConfigError("bad [key]"), 2, "bad [key]"),
        (LinkError("no vehicle"), 1, "no vehicle"),
        (BrokenPipeError(), 1, None),
        (ENOSPC, 1, "No space left on device"),
        (OSError(errno.EACCES, "Permission denied", "/x"), 1, "/x: Permission denied"),
        (asyncio.CancelledError(), 1, "interrupted before anything was sent"),
        (
            ZeroDivisionError("oops"),
            1,
            "internal error: ZeroDivisionError('oops'); run again with --debug to see where it "
            "happened",
        ),
    ],
)
@pytest.mark.parametrize("debug", [False, True])
def test_each_error_is_one_sentence_and_a_code(capsys, error, code, said, debug):
    def command(_):
        raise error

    assert run(command, argparse.Namespace(debug=debug)) == code
    told = capsys.readouterr().err
    if debug and isinstance(error, ZeroDivisionError):
        assert told.startswith("Traceback")
        told = told[told.index("companion: ") :]
    assert told == ("" if said is None else f"companion: {said}\n")


def test_ctrl_c_before_the_flight_begins_leaves_no_folder_and_no_warning(tmp_path, monkeypatch):
    started = []

    def interrupted():
        raise KeyboardInterrupt

    def fly_interruptibly(session):
        started.append(session.fly())
        return started[0]

    monkeypatch.setattr(loop, "frozen_objects", interrupted)
    monkeypatch.setattr(flying, "fly_interruptibly", fly_interruptibly)
    folder = tmp_path / "flight"
    folder.mkdir()
    with pytest.raises(KeyboardInterrupt):
        flying.fly(Config(), folder, FlightConsole())
    assert not folder.exists()
    assert inspect.getcoroutinestate(started[0]) == inspect.CORO_CLOSED


class _ClosedPipe(io.StringIO):
    """Standard output that nobody reads any more."""

    def write(self, _):
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


@pytest.mark.parametrize("command", ["export --csv", "export --parquet", "report", "plot"])
def test_a_closed_pipe_ends_a_command_about_a_recording_silently(
    monkeypatch, capsys, tmp_path, command
):
    written = tmp_path / "written"
    monkeypatch.setattr("companion.cli.recordings.read_flight", lambda _: None)
    for name in ("export_csv", "export_parquet"):
        monkeypatch.setattr(f"companion.recording.export.{name}", lambda *_: {written: 1})
    monkeypatch.setattr("companion.report.page.write_report", lambda *_: written)
    monkeypatch.setattr("companion.report.picture.draw_flight", lambda *_: None)
    monkeypatch.setattr(sys, "stdout", _ClosedPipe())
    assert main([*command.split(), str(tmp_path)]) == 1
    assert capsys.readouterr().err == ""


def test_ctrl_c_outside_a_flight_is_told(monkeypatch, capsys):
    def loaded(_):
        def interrupted():
            raise KeyboardInterrupt

        return interrupted

    monkeypatch.setattr(entry, "_load_command", loaded)
    before = signal.getsignal(signal.SIGINT)
    assert main(["demo"]) == 1
    assert capsys.readouterr().err == "companion: interrupted\n"
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize(
    ("what", "module", "given"),
    [
        ("link", link, {"rate_hz": 100.0}),
        ("serve", bench_serve, {"rate_hz": 100.0}),
        ("planner", planner, {}),
        ("flight", flight, {"profile": False}),
    ],
)
def test_a_benchmark_prints_its_figures_as_one_line_of_json(
    monkeypatch, capsys, what, module, given
):
    asked = []
    monkeypatch.setattr(module, "run", lambda **told: (asked.append(told), {"p50_us": 1.5})[1])
    rate = ["--rate", "100"] if "rate_hz" in given else []
    assert main(["bench", what, "--seconds", "2", *rate, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"p50_us": 1.5}
    assert asked == [{"seconds": 2.0, "as_json": True, **given}]
    assert main(["bench", what, "--seconds", "2", *rate]) == 0
    assert capsys.readouterr().out == ""


def test_a_study_that_is_interrupted_says_which_files_are_complete(monkeypatch, capsys, tmp_path):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("companion.study.runner.run", interrupted)
    out = tmp_path / "a [b]"
    assert main(["study", "track", "--out", str(out)]) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert "Interrupted: in " in told
    assert "a [b] only the files of finished studies are complete. Run the command again." in told
    rows = [{"rms": 0.1}]
    monkeypatch.setattr("companion.study.runner.run", lambda *_: (out / "index.html", rows))
    assert main(["study", "track", "--out", str(out), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out) == rows
    assert told.err == f"Open {out / 'index.html'}\n"


@pytest.mark.parametrize(
    ("program", "found", "name"),
    [
        ("/x/companion", "/x/companion", "companion"),
        ("/x/companion", "/y/companion", "/x/companion"),
        ("/x/companion", None, "/x/companion"),
        ("/x y/companion", None, "'/x y/companion'"),
        ("/x/__main__.py", None, "'/my env/python' -m companion"),
    ],
)
def test_the_next_command_names_the_program_as_it_was_called(monkeypatch, program, found, name):
    """In quotes where the shell needs them."""
    monkeypatch.setattr(sys, "argv", [program])
    monkeypatch.setattr(sys, "executable", "/my env/python")
    monkeypatch.setattr(flying.shutil, "which", lambda _: found)
    options = argparse.Namespace(typed=("fly",), config="c.yaml")
    assert flying.invocation(options) == (name, ("fly",), "c.yaml")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (MissingExtraError("needs plotly"), "needs plotly"),
        (ValueError("x"), f"x; {AGAIN}"),
        (MemoryError(), f"MemoryError; {AGAIN}"),
        (KeyboardInterrupt(), f"interrupted; {AGAIN}"),
        (ENOSPC, f"No space left on device; {AGAIN}"),
    ],
)
def test_a_page_that_cannot_be_written_does_not_fail_the_flight(monkeypatch, error, said):
    def write(_):
        raise error

    monkeypatch.setattr("companion.report.page.write_report", write)
    assert write_flight_page("a b") == f"No report: {said}"


def test_a_flight_whose_console_is_closed_gets_its_page(monkeypatch, tmp_path):
    """`companion demo | head -1` left a flight without report.html."""

    class Closed:
        def print(self, *_, **__):
            raise BrokenPipeError

    written = []
    monkeypatch.setattr(
        flying, "TerminalObserver", lambda _: SimpleNamespace(ask_landing=None, close=lambda: None)
    )
    monkeypatch.setattr(flying, "Session", lambda *_, **__: None)
    monkeypatch.setattr(flying, "fly_interruptibly", lambda _: None)
    monkeypatch.setattr(flying, "run", lambda *_, **__: SimpleNamespace())
    monkeypatch.setattr(flying, "flight_table", lambda _: "")
    monkeypatch.setattr("companion.report.page.write_report", written.append)
    flying.fly(Config(), tmp_path, Closed())
    assert written == [tmp_path]
    flying.fly(changed(Config(), {"recording": {"report": False}}, ""), tmp_path, Closed())
    assert written == [tmp_path]


@pytest.mark.parametrize("page", [True, False])
def test_a_demo_opens_its_page_if_there_is_one(monkeypatch, tmp_path, page):
    opened = []
    log = tmp_path / "a log"
    log.mkdir()
    if page:
        (log / "report.html").write_text("")
    monkeypatch.setattr(flying, "fly_bundled", lambda *_, **__: SimpleNamespace(log=log))
    monkeypatch.setattr(flights, "_report_result", lambda *_: 0)
    monkeypatch.setattr(flights.webbrowser, "open", opened.append)
    assert main(["demo", "--open"]) == 0
    assert opened == ([f"{(log / 'report.html').as_uri()}"] if page else [])
    opened.clear()
    assert main(["demo"]) == 0
    assert opened == []


class Session:
    """Serves until it is stopped, and notes what happened."""

    def __init__(self, told):
        self.told, self.over = told, asyncio.Event()

    def stop(self):
        self.told.append("stop")

    def leave(self):
        self.told.append("leave")
        self.over.set()

    async def run(self):
        self.loop = asyncio.get_running_loop()
        for seconds, number in self.signals:
            self.loop.call_later(seconds, os.kill, os.getpid(), number)
        await asyncio.wait_for(self.over.wait(), 5.0)
        return {}


class Pages:
    def __init__(self, told):
        self.told = told

    def stop(self):
        self.told.append("stop the page")


def test_a_second_ctrl_c_leaves_but_not_one_of_a_bouncing_key(monkeypatch):
    monkeypatch.setattr(serving, "MIN_CTRL_C_INTERVAL", 0.2)
    told = []
    session = Session(told)
    session.signals = ((0.05, signal.SIGINT), (0.1, signal.SIGINT), (0.4, signal.SIGINT))
    run_loop(serving._until_stopped(session, Pages(told)))
    assert told == ["stop", "leave", "stop the page"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_serving_and_the_page_of_a_flight_gets_some_time(monkeypatch, number):
    monkeypatch.setattr(serving, "_REPORT_TIMEOUT", 0.05)
    told = []
    session = Session(told)
    session.signals = ((0.02, number),)

    class Leaving(Pages):
        def stop(self):
            super().stop()
            session.over.set()

    run_loop(serving._until_stopped(session, Leaving(told)))
    assert told == ["stop", "stop the page"]


def test_only_an_encoding_error_is_transliterated():
    error = UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad")
    with pytest.raises(UnicodeDecodeError):
        _transliterated(error)


@pytest.mark.parametrize("count", ["0", "99999", "-1", "two", "1.5"])
def test_a_count_of_workers_that_is_none_is_wrong_usage(capsys, count):
    with pytest.raises(SystemExit) as ending:
        main(["campaign", "c.yaml", f"--workers={count}"])
    assert ending.value.code == 2
    assert "must be a whole number from 1 to " in capsys.readouterr().err


def test_the_handlers_are_those_of_before_after_a_command():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for argument in ("--help", "no-such-command"):
        with pytest.raises(SystemExit):
            main([argument])
        assert {number: signal.getsignal(number) for number in before} == before


class Beside:
    """Stands for the helper process."""

    feed = None

    def run_while_serving(self, work):
        return "beside", work


@pytest.mark.parametrize(("beside", "removed"), [(None, False), (Beside(), False), (None, True)])
def test_a_flight_is_served_beside_its_helper(monkeypatch, tmp_path, beside, removed):
    ran = []
    session = SimpleNamespace(changes="changes", note="note")
    monkeypatch.setattr(flying, "Session", lambda *_, **__: session)
    monkeypatch.setattr(flying, "fly_interruptibly", lambda each: ("flight", each))
    monkeypatch.setattr(flying, "flight_table", lambda _: "table")
    monkeypatch.setattr(flying, "styled_text", lambda _: "words")
    monkeypatch.setattr(flying, "closing_words", lambda *_: None)
    summary = SimpleNamespace(as_dict=dict)
    monkeypatch.setattr(flying, "run", lambda work, **_: (ran.append(work), summary)[1])
    console = flying.FlightConsole(file=io.StringIO(), highlight=False)
    config = changed(Config(), {"recording": {"report": False}}, "a test")
    folder = tmp_path / "a [b]"
    if not removed:
        folder.mkdir()
    assert flying.fly(config, folder, console, helper=beside) is summary
    flight = ("flight", session)
    assert ran == [flight if beside is None else ("beside", flight)]
    gone = f"Not recorded: {folder} was removed or renamed in flight"
    recorded = gone if removed else f"Recorded in {folder}"
    assert console.file.getvalue() == f"table\n{recorded}\nwords\n"
    if beside is not None:
        assert (beside.changes, beside.note) == ("changes", "note")


@pytest.mark.parametrize("report", [True, False])
@pytest.mark.parametrize("beside", [None, Beside()])
def test_serve_writes_pages_if_asked_to_and_tells_its_counters(
    monkeypatch, tmp_path, capsys, report, beside
):
    session = SimpleNamespace(changes="changes", records=SimpleNamespace(on_recorded=None))
    monkeypatch.setattr(serving, "ServeSession", lambda *_: session)
    monkeypatch.setattr(serving, "_until_stopped", lambda *told: ("serving", told[0]))
    monkeypatch.setattr(serving, "helper_process", lambda *_, **__: contextlib.nullcontext(beside))
    ran = []
    monkeypatch.setattr(serving.link_loop, "run", lambda work: (ran.append(work), {"in": 7})[1])
    config = tmp_path / "c.yaml"
    config.write_text(f"recording: {{report: {str(report).lower()}}}\n")
    assert main(["serve", "--config", str(config), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"in": 7}
    assert (session.records.on_recorded is not None) is report
    work = ("serving", session)
    assert ran == [work if beside is None else ("beside", work)]
    if beside is not None:
        assert beside.changes == "changes"


def test_a_folder_that_this_user_cannot_write_is_refused_before_the_flight(monkeypatch, tmp_path):
    monkeypatch.setattr(output_file.os, "access", lambda *_: False)
    with pytest.raises(
        ConfigError, match=r"the folder .* cannot be written; choose another file with --out"
    ):
        output_file.require_writable(tmp_path / "vehicle.yaml", "--out", force=False)
    monkeypatch.setattr(output_file.os, "access", lambda *_: True)
    output_file.require_writable(tmp_path / "vehicle.yaml", "--out", force=False)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ([], {}),
        (["--lockstep"], {"link": {"lockstep": True}}),
        (
            ["--trajectory", str(FIGURE8), "--slow-down"],
            {"flight": {"maneuvers": ("trajectory",), "trajectory": FIGURE8, "slow_down": True}},
        ),
        (["--arm"], {"flight": {"arm": True}}),
        (["--endpoint", "udpin://127.0.0.1:1"], {"link": {"endpoint": "udpin://127.0.0.1:1"}}),
    ],
)
def test_an_option_of_fly_replaces_its_key(monkeypatch, options, told):
    flown = []
    monkeypatch.setattr(flights, "flight_folder", lambda _: None)
    monkeypatch.setattr(flights, "helper_process", lambda *_, **__: contextlib.nullcontext(None))
    monkeypatch.setattr(flights, "_report_result", lambda *_: 0)
    monkeypatch.setattr(flying, "fly", lambda config, *_: flown.append(config))
    config = shipped("px4.yaml")
    assert main(["fly", "--config", str(config), *options]) == 0
    assert flown == [changed(load(config), told, "a test")]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            ["--maneuvers", "hover", "--trajectory", str(FIGURE8)],
            "so --maneuvers has no effect; leave out one",
        ),
        (["--slow-down"], "--slow-down needs a trajectory; add --trajectory FILE"),
    ],
)
def test_an_option_that_would_have_no_effect_is_refused(options, told, capsys):
    assert main(["fly", "--config", str(shipped("px4.yaml")), *options]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    "error", [ConfigError('bad "key"'), LinkError("none"), ENOSPC, KeyboardInterrupt()]
)
def test_an_error_of_a_command_with_json_is_json(capsys, error):
    """Standard output was empty, so a script that parses it failed with an error of its own."""

    def command(_):
        raise error

    run(command, argparse.Namespace(debug=False, json=True))
    told = capsys.readouterr()
    result = json.loads(told.out)["result"]
    assert told.err == f"companion: {result}\n"
