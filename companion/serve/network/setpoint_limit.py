"""Bounds what the setpoints of one client cost the control loop."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from companion.mavlink.framing import Frame
from companion.serve.network.client import Client

_WINDOW = 0.02
"""Length of the window in which setpoints are counted, s."""
_MAX_COUNT = 10
"""Largest number of setpoints of a client that are handled in a window; each costs up to 0.3 ms."""


@dataclass
class _Window:
    """The setpoints of one client in its present window."""

    begins: float
    """When the window begins, s of event-loop time."""
    count: int = 0
    """Number of setpoints that were handled in it."""
    newest: Frame | None = None
    """The newest setpoint that was not, or None."""
    timer: asyncio.TimerHandle | None = None
    """Hands on `newest` at the end of the window."""


class SetpointLimit:
    """Admits some setpoints of each client at once; of the others, only the newest, a little later.

    So neither a flood nor the backlog of a connection that stood still delays the control loop, and
    the newest setpoint is always flown.

    Args:
        hand_on: called with a client and its setpoint that was kept until its window ended.
    """

    def __init__(self, hand_on: Callable[[Client, Frame], None]) -> None:
        self._hand_on = hand_on
        self._loop = asyncio.get_running_loop()
        self._windows: WeakKeyDictionary[Client, _Window] = WeakKeyDictionary()

    def admits(self, client: Client, frame: Frame) -> bool:
        """Whether a setpoint may be handled now; otherwise it is kept or dropped."""
        now, window = self._loop.time(), self._windows.get(client)
        if window is None or now - window.begins >= _WINDOW:
            self.forget(client)
            window = self._windows[client] = _Window(now)
        if window.count < _MAX_COUNT:
            window.count += 1
            return True
        window.newest = frame
        if window.timer is None:
            end = window.begins + _WINDOW
            window.timer = self._loop.call_at(end, self._end_window, client, window)
        return False

    def forget(self, client: Client) -> None:
        """Drop what is kept of a client."""
        window = self._windows.pop(client, None)
        if window is not None and window.timer is not None:
            window.timer.cancel()

    def _end_window(self, client: Client, window: _Window) -> None:
        newest = window.newest
        self._windows[client] = _Window(self._loop.time(), count=1)
        if newest is not None:
            self._hand_on(client, newest)
