"""Whom a flight tells what happens: the terminal, a test, later the live page."""

from typing import Protocol


class Observer(Protocol):
    """Is told what happens, in the order in which it happens; must return at once."""

    def phase(self, name: str, waits_for: str) -> None:
        """A phase began."""
        ...

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
        """Once a second: what the phase waits for, since when and for how long at most (s)."""
        ...

    def event(self, time: float, text: str) -> None:
        """Something happened, `time` s after the flight began."""
        ...


class Silent:
    """An observer that tells nobody."""

    def phase(self, name: str, waits_for: str) -> None:
        """Say nothing."""

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
        """Say nothing."""

    def event(self, time: float, text: str) -> None:
        """Say nothing."""
