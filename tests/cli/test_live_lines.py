"""The state of a flight on a terminal: three lines that stay below the events; elsewhere none."""

import asyncio
import contextlib
import io
import os
import pty
import re
import sys
import threading
import time
from math import inf, radians

import pytest

from companion.cli import terminal
from companion.cli.live_lines import LiveLines, can_redraw, status_lines
from companion.cli.terminal import FlightConsole, TerminalObserver
from companion.flight.status import FlightStatus
from companion.vehicle.records import Battery

HOVERING = FlightStatus(
    time=47.2,
    airborne_time=33.1,
    phase="maneuvers",
    waiting_for="circle, 5 of 14 s flown",
    elapsed=30.0,
    timeout=48.0,
    maneuver="circle",
    maneuver_elapsed=5.2,
    maneuver_duration=14.0,
    height=5.02,
    speed=2.04,
    tilt=radians(12.4),
    tracking_error=0.036,
    setpoint_rate=249.6,
    latency=0.00012,
    missed_deadlines=3,
    battery=Battery(0.0, 15.93, 0.83),
    monitored=True,
)
WAITING = FlightStatus(3.0, None, "checks", "the vehicle to be ready", 2.0, 60.0, height=-0.01)


class Screen:
    """What a terminal shows of what is written to it; it scrolls without end."""

    def __init__(self, columns=80):
        self.columns = columns
        self.lines, self.row, self.column = [""], 0, 0

    def feed(self, text):
        for code, motion, sign in re.findall(r"(\x1b\[([0-9;]*)([A-Za-z])|[\s\S])", text):
            if sign:
                self._control(motion, sign)
            else:
                self._character(code)
        return self

    def _control(self, motion, sign):
        if sign == "F":
            self.row, self.column = self.row - int(motion or 1), 0
            assert self.row >= 0, "above the screen"
        elif sign == "K":
            self.lines[self.row] = self.lines[self.row][: self.column]
        elif sign == "J":
            self.lines[self.row] = self.lines[self.row][: self.column]
            del self.lines[self.row + 1 :]
        else:
            assert sign == "m", f"an unknown control sequence {sign!r}"

    def _character(self, one):
        if one == "\r":
            self.column = 0
        elif one == "\n":
            self.row, self.column = self.row + 1, 0
            if self.row == len(self.lines):
                self.lines.append("")
        else:
            line = self.lines[self.row].ljust(self.column)
            self.lines[self.row] = line[: self.column] + one + line[self.column + 1 :]
            self.column += 1


def plain(line):
    return " ".join(line.split())


def test_three_lines_say_what_is_flown_how_it_moves_and_how_all_is():
    first, second, third = status_lines(HOVERING)
    assert plain(first) == "maneuvers 47 s circle, 5 of 14 s"
    assert plain(second) == "height 5.0 m speed 2.0 m/s tilt 12° tracking error 0.04 m"
    assert plain(third) == "safety ok 250 Hz latency 0.12 ms (3 late) battery 83 % 15.9 V"
    assert max(map(len, (first, second, third))) < 80


def test_what_is_unknown_is_a_dash_and_an_alarm_is_named():
    first, second, third = status_lines(WAITING)
    assert "the vehicle to be ready (2 of at most 60 s)" in first
    assert plain(second) == "height 0.0 m speed – tilt – tracking error –"
    assert plain(third) == "safety off no setpoints battery –"
    assert "ALARM: tilt, fence" in status_lines(HOVERING._replace(alarms=("tilt", "fence")))[2]
    endless = WAITING._replace(timeout=inf)
    assert "(2 s)" in status_lines(endless)[0]


def test_in_lockstep_no_latency_is_shown():
    third = status_lines(HOVERING._replace(latency=None, missed_deadlines=None))[2]
    assert "latency" not in third
    assert "late" not in third


class Terminal(io.StringIO):
    """A terminal of UTF-8."""

    encoding = "utf-8"

    def isatty(self):
        return True


def test_events_scroll_above_the_lines_and_nothing_else_remains():
    out = Terminal()
    live = LiveLines(out)
    for k in range(3):
        live.show([f"phase {k}", "longer than the next" if k < 2 else "short", "third"])
        live.write_above(f"event {k}\n")
    assert Screen().feed(out.getvalue()).lines == [
        "event 0",
        "event 1",
        "event 2",
        "phase 2",
        "short",
        "third",
        "",
    ]
    live.clear()
    live.clear()
    assert Screen().feed(out.getvalue()).lines == ["event 0", "event 1", "event 2", ""]


def test_a_key_that_is_echoed_does_not_stay():
    out = Terminal()
    live = LiveLines(out)
    live.show(["one", "two", "three"])
    out.write("^C")
    live.show(["one", "two", "three"])
    assert Screen().feed(out.getvalue()).lines == ["one", "two", "three", ""]


def test_a_line_is_cut_at_the_width_of_the_terminal():
    out = Terminal()
    LiveLines(out).show(["x" * 300])
    (line, _) = Screen().feed(out.getvalue()).lines
    assert line == "x" * 79


def test_a_terminal_that_is_not_utf8_gets_ascii():
    out = Terminal()
    out.encoding = "iso8859-1"
    LiveLines(out).show(status_lines(HOVERING))
    assert out.getvalue().isascii()
    assert "tilt 12 deg" in out.getvalue()


@pytest.mark.parametrize(
    ("variables", "redraws"),
    [
        ({"TERM": "xterm"}, True),
        ({"TERM": "xterm", "NO_COLOR": "1"}, False),
        ({"TERM": "xterm", "NO_COLOR": ""}, True),
        ({"TERM": "dumb"}, False),
        ({}, False),
    ],
)
def test_where_lines_are_redrawn(monkeypatch, variables, redraws):
    for name in ("TERM", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert can_redraw(Terminal()) is redraws
    assert not can_redraw(io.StringIO())


def shown_by(observer):
    """Show a flight of two phases, with a state after each event."""
    observer.phase("checks", "the vehicle to be ready")
    for k in range(4):
        observer.event(k, f"event number {k}")
        observer.status(WAITING._replace(time=float(k)))
        observer.waiting("checks", "all is checked", 5.0 * k, 60.0)
    observer.phase("maneuvers", "the maneuver to end")
    observer.status(HOVERING)
    observer.close()


@pytest.fixture
def on_a_pty(monkeypatch):
    """An observer that writes to a pseudo-terminal, and a function that reads what it shows."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(terminal, "_REDRAW_PERIOD", 0.0)
    ours, theirs = pty.openpty()
    written = []

    def read():
        with contextlib.suppress(OSError):  # the other end is closed
            while data := os.read(ours, 65_536):
                written.append(data)

    reader = threading.Thread(target=read)
    reader.start()
    file = os.fdopen(theirs, "w", encoding="utf-8")

    def seen():
        file.close()
        reader.join()
        return b"".join(written).decode()

    yield TerminalObserver(FlightConsole(file=file, highlight=False, width=80)), seen
    os.close(ours)


def test_on_a_terminal_the_state_is_live_and_is_gone_at_the_end(on_a_pty):
    observer, seen = on_a_pty
    shown_by(observer)
    written = seen()
    assert "safety" in written
    lines = Screen().feed(written).lines
    assert [line.strip() for line in lines if line] == [
        "checks     waiting for the vehicle to be ready",
        *(f"{k}.0 s  event number {k}" for k in range(4)),
        "maneuvers  waiting for the maneuver to end",
    ]


def test_a_question_is_asked_without_live_lines(on_a_pty, monkeypatch):
    observer, seen = on_a_pty

    async def answer():
        observer.status(HOVERING)
        await asyncio.sleep(0.05)
        observer.status(HOVERING)
        return "y\n"

    monkeypatch.setattr(terminal, "read_line", answer)
    monkeypatch.setattr(terminal.sys, "stdin", Terminal())
    observer.status(HOVERING)
    assert asyncio.run(observer.ask_landing())
    observer.close()
    lines = [line for line in Screen().feed(seen()).lines if line]
    assert lines == ["The vehicle holds. Land it now? [y/N] (Ctrl-C ends the flight) "]


@pytest.mark.parametrize("variable", [None, "NO_COLOR"])
def test_elsewhere_it_is_plain_lines(monkeypatch, variable):
    monkeypatch.setenv("TERM", "xterm")
    if variable is not None:
        monkeypatch.setenv(variable, "1")
    out = io.StringIO() if variable is None else Terminal()
    shown_by(TerminalObserver(FlightConsole(file=out, highlight=False, width=80)))
    text = out.getvalue()
    assert "\x1b[" not in text.replace("\x1b[1m", "").replace("\x1b[0m", "")
    assert "event number 3" in text
    assert "all is checked (15 of at most 60 s)" in text
    assert "safety" not in text


def test_a_stalled_terminal_gets_the_newest_state_only(monkeypatch):
    """The states that could not be shown take no room from the events."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(terminal, "_REDRAW_PERIOD", 0.0)

    goes_on = threading.Event()

    class Stalled(Terminal):
        def write(self, text):
            goes_on.wait(10.0)
            return super().write(text)

    out = Stalled()
    observer = TerminalObserver(FlightConsole(file=out, highlight=False, width=80))
    began = time.monotonic()
    for k in range(3 * terminal._QUEUE_LENGTH):
        observer.status(HOVERING._replace(time=float(k)))
    observer.event(1.0, "the last event")
    assert time.monotonic() - began < 5.0
    goes_on.set()
    observer.close()
    assert Screen().feed(out.getvalue()).lines == ["     1.0 s  the last event", ""]
    assert out.getvalue().count("circle, 5 of 14 s") < 5


def test_an_alarm_is_drawn_in_its_colour_and_only_the_last_line():
    out = Terminal()
    LiveLines(out).show(["one", "safety"], alarm=True)
    written = out.getvalue()
    assert written.startswith("\rone\x1b[K\n\x1b[1;31msafety\x1b[0m\x1b[K\n")
    assert Screen().feed(re.sub(r"\x1b\[[\d;]*m", "", written)).lines == ["one", "safety", ""]
    calm = Terminal()
    LiveLines(calm).show(["one", "safety"])
    assert calm.getvalue() != written


class Stalled:
    """Prints nothing until it may."""

    def __init__(self):
        self.goes_on, self.lines = threading.Event(), []

    def __call__(self, text):
        def line():
            self.goes_on.wait(10.0)
            self.lines.append(text)

        return line


def test_lines_for_a_terminal_that_stalls_are_dropped_and_the_end_does_not_wait(monkeypatch):
    monkeypatch.setattr(terminal, "_QUEUE_LENGTH", 3)
    monkeypatch.setattr(terminal, "_CLOSE_TIMEOUT", 0.05)
    printer, line = terminal._PrintThread(), Stalled()
    said = [printer.queue_line(line(number)) for number in range(9)]
    assert said[:3] == [True] * 3
    assert not said[-1]
    began = time.monotonic()
    printer.close()
    assert time.monotonic() - began < 5.0  # a line waits for 10 s
    line.goes_on.set()
    printer.close()
    printer._thread.join(10.0)
    assert line.lines == [number for number, was in enumerate(said) if was]


def test_a_terminal_that_is_gone_is_not_written_to_again():
    printer, tried = terminal._PrintThread(), []

    def fail():
        tried.append("once")
        raise OSError("gone")

    for _ in range(5):
        printer.queue_line(fail)
    printer.close()
    printer.close()
    assert tried == ["once"]


def test_an_answer_is_read_without_holding_up_the_flight(monkeypatch):
    ours, theirs = pty.openpty()
    with os.fdopen(theirs) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)

        async def asked():
            answer = asyncio.create_task(terminal.read_line())
            await asyncio.sleep(0.02)
            assert not answer.done()
            os.write(ours, b"yes\n")
            return await answer

        assert asyncio.run(asyncio.wait_for(asked(), 5.0)) == "yes\n"
    os.close(ours)
