"""Where the bundled vehicle really is while it flies: what telemetry tells, without its errors."""

import asyncio
import json
import socket
from contextlib import suppress

import numpy as np

from companion.flight.observer import Silent
from companion.study.step import Floats

_PERIOD = 0.02
"""Between two questions, s of vehicle time; half a millimetre of a curved way lies between."""
_PATIENCE = 1.0
"""For an answer, s of wall time; it takes some 0.1 ms."""
_WATCHED = "maneuvers"
"""The phase of the flight."""


class TruthWatch(Silent):
    """Asks the vehicle's control channel for the truth, over and over, while the maneuver flies.

    In lockstep the vehicle stands still until its sample is answered. So a question may block our
    event loop, and its answer belongs to this very moment of vehicle time.

    Args:
        port: of the control channel, on this machine.
    """

    def __init__(self, port: int) -> None:
        self._address = ("127.0.0.1", port)
        self._rows: list[tuple[float, ...]] = []
        self._asking: asyncio.Task[None] | None = None

    def phase(self, name: str, waits_for: str) -> None:
        """Begin with the maneuver, end with whatever comes after it."""
        if name == _WATCHED:
            self._asking = asyncio.create_task(self._ask())
        elif self._asking is not None:
            self._asking.cancel()

    def rows(self) -> Floats:
        """(n, 4): vehicle time, s, and position north, east and down of home, m."""
        return np.array(self._rows).reshape(-1, 4)

    async def _ask(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel, suppress(OSError):
            # A vehicle that does not answer is gone, and the flight's end will say so.
            channel.settimeout(_PATIENCE)
            channel.connect(self._address)
            while True:
                channel.send(b'{"state": true}')
                truth = json.loads(channel.recv(65536))
                self._rows.append((truth["time"], *truth["position"]))
                await asyncio.sleep(_PERIOD)
