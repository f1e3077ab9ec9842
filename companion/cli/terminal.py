"""A flight on the terminal: phases, what they wait for, events; a question at the end."""

import asyncio
import queue
import sys
import threading
from collections.abc import Callable

from rich.console import Console
from rich.status import Status

_REPEAT = 5.0
"""Without a live terminal, say what is waited for this often, s."""

_WAITING = 1000
"""Lines that a stalled terminal may owe; more are dropped."""

_PATIENCE = 2.0
"""How long a stalled terminal may hold up the end, s."""


class _Speaker:
    """Prints in a thread of its own: a terminal that stalls or goes away must not stop a flight."""

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
    """A line of standard input, which must be a terminal; the event loop goes on meanwhile."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[str] = loop.create_future()
    loop.add_reader(sys.stdin, lambda: answer.set_result(sys.stdin.readline()))
    try:
        return await answer
    finally:
        loop.remove_reader(sys.stdin)


class FlightConsole(Console):
    """A console whose reader may go away: rich would end the program, and silence stdout."""

    def on_broken_pipe(self) -> None:
        """Let whoever printed deal with it."""
        raise BrokenPipeError


class TerminalObserver:
    """Tells a flight to a person; a live line on a terminal, plain lines elsewhere."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._speaker = _Speaker()
        self._status: Status | None = None
        self._said = 0.0

    def phase(self, name: str, waits_for: str) -> None:
        """Show that a phase began."""
        self._said = 0.0
        self._speaker.say(lambda: self._show_phase(name, waits_for))

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
        """Show what is waited for, and for how long."""
        text = f"{name}: {detail or 'working'} ({elapsed:.0f} of at most {timeout:.0f} s)"
        if self._console.is_terminal:
            self._speaker.say(lambda: self._show_status(text))
        elif elapsed - self._said >= _REPEAT:
            self._said = elapsed
            self._speaker.say(lambda: self._print(f"           {text}"))

    def event(self, time: float, text: str) -> None:
        """Show an event."""
        self._speaker.say(lambda: self._print(f"  {time:6.1f} s  {text}"))

    def close(self) -> None:
        """Take the live line away, once all is said."""
        self._speaker.say(self._stop_status)
        self._speaker.close()

    async def ask_landing(self) -> bool:
        """Ask whether to land; where nobody can answer, the vehicle goes on holding."""
        if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
            self._speaker.say(
                lambda: self._print("The vehicle holds. Take it over, or command a landing.")
            )
            return False
        self._speaker.say(self._stop_status)
        self._speaker.say(
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
