"""A flight on the terminal: phases, what they wait for, events; a question at the end."""

import asyncio
import sys

from rich.console import Console
from rich.status import Status

_REPEAT = 5.0
"""Without a live terminal, say what is waited for this often, s."""


class TerminalObserver:
    """Tells a flight to a person; a live line on a terminal, plain lines elsewhere."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._status: Status | None = None
        self._said = 0.0

    def phase(self, name: str, waits_for: str) -> None:
        """Show that a phase began."""
        self._said = 0.0
        self._console.print(f"[bold]{name:<10}[/] waiting for {waits_for}", highlight=False)
        if self._console.is_terminal:
            self.close()
            self._status = self._console.status(name)
            self._status.start()

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
        """Show what is waited for, and for how long."""
        text = f"{name}: {detail or 'working'} ({elapsed:.0f} of at most {timeout:.0f} s)"
        if self._status is not None:
            self._status.update(text)
        elif elapsed - self._said >= _REPEAT:
            self._said = elapsed
            self._print(f"           {text}")

    def event(self, time: float, text: str) -> None:
        """Show an event."""
        self._print(f"  {time:6.1f} s  {text}")

    def close(self) -> None:
        """Take the live line away."""
        if self._status is not None:
            self._status.stop()
            self._status = None

    def _print(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    async def ask_landing(self) -> bool:
        """Ask whether to land; where nobody can answer, the vehicle goes on holding."""
        self.close()
        if not sys.stdin.isatty():
            self._console.print("The vehicle holds. Take it over, or command a landing.")
            return False
        self._console.print("The vehicle holds. Land it now? [y/N] (Ctrl-C leaves) ", end="")
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        loop = asyncio.get_running_loop()
        loop.add_reader(sys.stdin, lambda: answer.set_result(sys.stdin.readline()))
        try:
            return (await answer).strip().lower() in ("y", "yes")
        finally:
            loop.remove_reader(sys.stdin)
