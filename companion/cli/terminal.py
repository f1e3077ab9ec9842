"""Shows a flight on the terminal: phases, events and state; asks at the end whether to land."""

import asyncio
import queue
import sys
import threading
import time
from collections.abc import Callable
from math import inf
from typing import Any

from rich.console import Console

from companion.cli.live_lines import LiveLines, can_redraw, elapsed_text, status_lines
from companion.flight.status import FlightStatus

_STATUS_PERIOD = 5.0
"""Period of plain status lines on output that cannot be redrawn, s."""

_REDRAW_PERIOD = 0.2
"""Shortest period between redraws, s of wall time; a flight in lockstep may outrun the terminal."""

_QUEUE_LENGTH = 1000
"""Most lines queued for a stalled terminal; further lines are dropped."""

_CLOSE_TIMEOUT = 2.0
"""Longest wait at close for a place in the full queue, and then for the queued lines, s."""


class _PrintThread:
    """Prints in its own thread, so that a terminal that stalls or closes cannot stop a flight."""

    def __init__(self) -> None:
        self._lines: queue.Queue[Callable[[], None] | None] = queue.Queue(_QUEUE_LENGTH)
        self._thread = threading.Thread(target=self._print_lines, name="terminal", daemon=True)
        self._thread.start()

    def queue_line(self, print_line: Callable[[], None]) -> bool:
        """Queue a call that prints a line; return false if the queue is full."""
        try:
            self._lines.put_nowait(print_line)
        except queue.Full:
            return False
        return True

    def close(self) -> None:
        if self._thread.is_alive():
            try:
                self._lines.put(None, timeout=_CLOSE_TIMEOUT)
            except queue.Full:
                return
            self._thread.join(_CLOSE_TIMEOUT)

    def _print_lines(self) -> None:
        terminal_is_gone = False
        while (print_line := self._lines.get()) is not None:
            if terminal_is_gone:
                continue
            try:
                print_line()
            except (OSError, ValueError):  # the terminal is gone or closed
                terminal_is_gone = True


async def read_line() -> str:
    """Read a line from the terminal without blocking the event loop."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[str] = loop.create_future()
    loop.add_reader(sys.stdin, lambda: answer.set_result(sys.stdin.readline()))
    try:
        return await answer
    finally:
        loop.remove_reader(sys.stdin)


class FlightConsole(Console):
    """A console that prints brackets unchanged, and survives a closed pipe.

    `rich.console.Console` would take brackets, for example in the name of a folder, for markup, and
    would end the program when the pipe closes.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options, markup=False)

    def on_broken_pipe(self) -> None:
        """Raise `BrokenPipeError`, where Rich would end the program."""
        raise BrokenPipeError


class TerminalObserver:
    """Shows a flight: events, and on a terminal live status lines below them."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._printer = _PrintThread()
        self._live_lines = LiveLines(console.file) if can_redraw(console.file) else None
        self._newest_status: FlightStatus | None = None
        self._redraw_queued = self._asking = False
        self._drawn_at = -inf
        self._status_printed_at = 0.0

    def phase(self, name: str, waits_for: str) -> None:
        """Show that a phase began."""
        self._status_printed_at = 0.0
        self._printer.queue_line(
            lambda: self._print(f"[bold]{name:<10}[/] waiting for {waits_for}", True)
        )

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Print periodically what the phase waits for, unless live lines already show it."""
        if self._live_lines is None and elapsed - self._status_printed_at >= _STATUS_PERIOD:
            self._status_printed_at = elapsed
            text = f"{name}: {waiting_for or 'working'} ({elapsed_text(elapsed, timeout)})"
            self._printer.queue_line(lambda: self._print(f"           {text}"))

    def status(self, status: FlightStatus) -> None:
        """Redraw the live lines, at most once per `_REDRAW_PERIOD`, unless the terminal stalls."""
        self._newest_status = status
        now = time.monotonic()
        if (
            self._live_lines is None
            or self._asking
            or self._redraw_queued
            or now - self._drawn_at < _REDRAW_PERIOD
        ):
            return
        self._drawn_at = now
        self._redraw_queued = self._printer.queue_line(self._draw)

    def event(self, time: float, text: str) -> None:
        """Show an event."""
        self._printer.queue_line(lambda: self._print(f"  {time:6.1f} s  {text}"))

    def close(self) -> None:
        """Remove the live lines after the last event."""
        self._printer.queue_line(self._clear)
        self._printer.close()

    async def ask_landing(self) -> bool:
        """Ask whether to land; without a terminal the vehicle continues to hold."""
        if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
            self._printer.queue_line(
                lambda: self._print("The vehicle holds. Take it over, or command a landing.")
            )
            return False
        self._asking = True
        self._printer.queue_line(self._clear)
        self._printer.queue_line(
            lambda: self._print("The vehicle holds. Land it now? [y/N] (Ctrl-C ends the flight) ")
        )
        try:
            return (await read_line()).strip().lower() in ("y", "yes")
        finally:
            self._asking = False

    def _draw(self) -> None:
        self._redraw_queued = False
        status = self._newest_status
        if self._live_lines is not None and status is not None and not self._asking:
            self._live_lines.show(status_lines(status), alarm=bool(status.alarms))

    def _clear(self) -> None:
        if self._live_lines is not None:
            self._live_lines.clear()

    def _print(self, text: str, markup: bool = False) -> None:
        """Print a line, above the live lines if there are any."""
        if self._live_lines is None:
            self._write(text, markup)
            return
        with self._console.capture() as captured:
            self._write(text, markup)
        self._live_lines.write_above(captured.get())

    def _write(self, text: str, markup: bool) -> None:
        self._console.print(text, highlight=False, markup=markup, soft_wrap=True)
