"""Shows a flight on the terminal: phases, events, and the question at the end."""

import asyncio
import queue
import sys
import threading
from collections.abc import Callable

from rich.console import Console
from rich.status import Status

_REPEAT = 5.0
"""Period of the status line where the output is no terminal, s."""

_WAITING = 1000
"""Lines queued for a stalled terminal; further lines are dropped."""

_PATIENCE = 2.0
"""Longest wait for a stalled terminal at the end, s."""


class _PrintThread:
    """Prints in its own thread: a terminal that stalls or closes must not stop a flight."""

    def __init__(self) -> None:
        self._lines: queue.Queue[Callable[[], None] | None] = queue.Queue(_WAITING)
        self._thread = threading.Thread(target=self._speak, name="terminal", daemon=True)
        self._thread.start()

    def say(self, line: Callable[[], None]) -> None:
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            return

    def close(self) -> None:
        if self._thread.is_alive():
            try:
                self._lines.put(None, timeout=_PATIENCE)
            except queue.Full:
                return
            self._thread.join(_PATIENCE)

    def _speak(self) -> None:
        broken = False
        while (line := self._lines.get()) is not None:
            if broken:
                continue
            try:
                line()
            except (OSError, ValueError):  # gone, or closed
                broken = True


async def read_line() -> str:
    """Read a line from the terminal while the event loop goes on."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[str] = loop.create_future()
    loop.add_reader(sys.stdin, lambda: answer.set_result(sys.stdin.readline()))
    try:
        return await answer
    finally:
        loop.remove_reader(sys.stdin)


class FlightConsole(Console):
    """A console whose reader may close the pipe; rich itself would end the program."""

    def on_broken_pipe(self) -> None:
        """Raise to the caller that prints."""
        raise BrokenPipeError


class TerminalObserver:
    """Shows a flight: a live status line on a terminal, plain lines elsewhere."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._printer = _PrintThread()
        self._status: Status | None = None
        self._said = 0.0

    def phase(self, name: str, waits_for: str) -> None:
        """Show that a phase began."""
        self._said = 0.0
        self._printer.say(lambda: self._show_phase(name, waits_for))

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
        """Show what the phase waits for, and since when."""
        text = f"{name}: {detail or 'working'} ({elapsed:.0f} of at most {timeout:.0f} s)"
        if self._console.is_terminal:
            self._printer.say(lambda: self._show_status(text))
        elif elapsed - self._said >= _REPEAT:
            self._said = elapsed
            self._printer.say(lambda: self._print(f"           {text}"))

    def event(self, time: float, text: str) -> None:
        """Show an event."""
        self._printer.say(lambda: self._print(f"  {time:6.1f} s  {text}"))

    def close(self) -> None:
        """Remove the status line after the last event."""
        self._printer.say(self._stop_status)
        self._printer.close()

    async def ask_landing(self) -> bool:
        """Ask whether to land; without a terminal the vehicle goes on holding."""
        if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
            self._printer.say(
                lambda: self._print("The vehicle holds. Take it over, or command a landing.")
            )
            return False
        self._printer.say(self._stop_status)
        self._printer.say(
            lambda: self._print("The vehicle holds. Land it now? [y/N] (Ctrl-C again leaves) ")
        )
        return (await read_line()).strip().lower() in ("y", "yes")

    def _show_phase(self, name: str, waits_for: str) -> None:
        self._stop_status()
        self._console.print(f"[bold]{name:<10}[/] waiting for {waits_for}", highlight=False)
        if self._console.is_terminal:
            spinner = "line" if self._console.options.ascii_only else "dots"
            self._status = self._console.status(name, spinner=spinner)
            self._status.start()

    def _show_status(self, text: str) -> None:
        if self._status is not None:
            self._status.update(text)

    def _stop_status(self) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None

    def _print(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)
