"""Limits the rate of each client's setpoints, so that they do not delay the control loop."""

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

    begin_time: float
    """Event-loop time at the beginning of the window, s."""
    count: int = 0
    """Number of setpoints that were handled in the window."""
    newest_setpoint: Frame | None = None
    """The newest setpoint that waits for the end of the window, or None."""
    timer: asyncio.TimerHandle | None = None
    """Timer that passes `newest_setpoint` on at the end of the window; None: no setpoint waits."""


class SetpointLimit:
    """Admits the first `_MAX_COUNT` setpoints of a client in each window.

    If more come, the newest is passed on at the end of the window, and the others are dropped. So
    neither a flood nor the backlog of a stalled connection delays the control loop, and the newest
    setpoint is always flown.

    Args:
        forward: called at the end of a window with a client and its newest setpoint.
    """

    def __init__(self, forward: Callable[[Client, Frame], None]) -> None:
        self._forward = forward
        self._loop = asyncio.get_running_loop()
        self._windows: WeakKeyDictionary[Client, _Window] = WeakKeyDictionary()

    def admits(self, client: Client, frame: Frame) -> bool:
        """Whether a setpoint may be handled now; otherwise it is kept or dropped."""
        now, window = self._loop.time(), self._windows.get(client)
        if window is None or now - window.begin_time >= _WINDOW:
            self.forget(client)
            window = self._windows[client] = _Window(now)
        if window.count < _MAX_COUNT:
            window.count += 1
            return True
        window.newest_setpoint = frame
        if window.timer is None:
            end = window.begin_time + _WINDOW
            window.timer = self._loop.call_at(end, self._end_window, client, window)
        return False

    def forget(self, client: Client) -> None:
        """Drop the window of a client and the setpoint that waits in it."""
        window = self._windows.pop(client, None)
        if window is not None and window.timer is not None:
            window.timer.cancel()

    def _end_window(self, client: Client, window: _Window) -> None:
        newest = window.newest_setpoint
        self._windows[client] = _Window(self._loop.time(), count=1)
        if newest is not None:
            self._forward(client, newest)
