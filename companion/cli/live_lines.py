"""The state of a flight in three lines at the bottom of a terminal, rewritten in place."""

import codecs
import os
from collections.abc import Sequence
from math import degrees, isinf
from typing import IO

from companion.files.ascii_text import ascii_for
from companion.flight.status import FlightStatus

_USUAL_WIDTH = 80
"""Width assumed for a terminal that does not report its own, columns."""
_RED = "\x1b[1;31m{}\x1b[0m"


def can_redraw(file: IO[str]) -> bool:
    """Whether lines can be rewritten: a terminal with ANSI codes, and NO_COLOR is not set."""
    is_dumb = os.environ.get("TERM", "dumb") in ("", "dumb", "unknown")
    return file.isatty() and not is_dumb and not os.environ.get("NO_COLOR")


def status_lines(status: FlightStatus) -> list[str]:
    """The three lines: maneuver; motion of the vehicle; safety, setpoints and battery."""
    return [
        f"{status.phase:<9} {status.time:.0f} s   {_activity(status)}",
        f"{'':<9} height {_number(status.height, '.1f', 'm')}   "
        f"speed {_number(status.speed, '.1f', 'm/s')}   "
        f"tilt {_number(None if status.tilt is None else degrees(status.tilt), '.0f', '°')}   "
        f"tracking error {_number(status.tracking_error, '.2f', 'm')}",
        f"{'':<9} safety {_safety(status)}  {_setpoints(status)}  battery {_battery(status)}",
    ]


def _activity(status: FlightStatus) -> str:
    if status.maneuver is not None:
        duration_text = (
            "" if status.maneuver_duration is None else f" of {status.maneuver_duration:.0f}"
        )
        return f"{status.maneuver}, {status.maneuver_elapsed:.0f}{duration_text} s"
    return f"{status.waiting_for or 'working'} ({elapsed_text(status.elapsed, status.timeout)})"


def elapsed_text(elapsed: float, timeout: float) -> str:
    """How long a phase has lasted, and its time limit if it has one; both times in s."""
    return f"{elapsed:.0f} s" if isinf(timeout) else f"{elapsed:.0f} of at most {timeout:.0f} s"


def _setpoints(status: FlightStatus) -> str:
    rate_text = "no setpoints" if status.setpoint_rate is None else f"{status.setpoint_rate:.0f} Hz"
    if status.latency is None:
        return rate_text
    return f"{rate_text}  latency {1e3 * status.latency:.2f} ms ({status.missed_deadlines} late)"


def _battery(status: FlightStatus) -> str:
    battery = status.battery
    if battery is None or battery.remaining is None:
        return "–"
    voltage_text = "" if battery.voltage_v is None else f" {battery.voltage_v:.1f} V"
    return f"{100.0 * battery.remaining:.0f} %{voltage_text}"


def _safety(status: FlightStatus) -> str:
    if status.alarms:
        return "ALARM: " + ", ".join(status.alarms)
    return "ok" if status.monitored else "off"


def _number(value: float | None, number_format: str, unit: str) -> str:
    if value is None:
        return "–"
    text = f"{value:{number_format}}"
    text = text.removeprefix("-") if float(text) == 0.0 else text
    return f"{text}{'' if unit == '°' else ' '}{unit}"


class LiveLines:
    """Status lines that stay at the bottom while other text scrolls above them.

    Each change is one write, so nothing flickers. Lines are cut to the terminal's width.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        encoding = getattr(file, "encoding", None) or "ascii"
        self._is_unicode = codecs.lookup(encoding).name.startswith("utf")
        self._lines: list[str] = []

    def show(self, lines: Sequence[str], *, alarm: bool = False) -> None:
        """Replace the lines; with `alarm`, the last line has the colour of an alarm."""
        cursor_to_first_line, columns = self._cursor_to_first_line(), self._columns()
        printable_lines = lines if self._is_unicode else [ascii_for(line) for line in lines]
        self._lines = [line[: columns - 1] for line in printable_lines]
        drawn_lines = list(self._lines)
        if alarm and drawn_lines:
            drawn_lines[-1] = _RED.format(drawn_lines[-1])
        self._write(
            cursor_to_first_line + "".join(f"{line}\x1b[K\n" for line in drawn_lines) + "\x1b[J"
        )

    def write_above(self, text: str) -> None:
        """Write `text`, which consists of whole lines, above the status lines."""
        status_text = "".join(f"{line}\n" for line in self._lines)
        self._write(f"{self._cursor_to_first_line()}\x1b[J{text}{status_text}")

    def clear(self) -> None:
        """Remove the lines."""
        if self._lines:
            self._write(f"{self._cursor_to_first_line()}\x1b[J")
            self._lines = []

    def _cursor_to_first_line(self) -> str:
        """Code that moves the cursor to the first line, even if a narrow terminal wrapped lines."""
        columns = self._columns()
        rows = sum(max(1, -(-len(line) // columns)) for line in self._lines)
        return f"\x1b[{rows}F" if rows else "\r"

    def _columns(self) -> int:
        try:
            return os.get_terminal_size(self._file.fileno()).columns or _USUAL_WIDTH
        except (OSError, ValueError):
            return _USUAL_WIDTH

    def _write(self, text: str) -> None:
        self._file.write(text)
        self._file.flush()
