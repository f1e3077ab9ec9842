"""A flight in memory whose observer calls are kept, to be told to a live page in real time."""

import asyncio
from pathlib import Path

from companion import testing
from companion.live.door import open_door
from companion.live.helper import Helper, Wishes
from tests.flight.fly import mock_vehicle, quick_flight

CIRCLE = {
    "flight": {"maneuvers": ["circle"], "takeoff_height_m": 3.0},
    "circle": {"speed_m_s": 3.0, "radius_m": 4.0},
    "limits": {"fence_radius_m": 12.0},
}


class Kept:
    """An observer that keeps what it is told, and when."""

    def __init__(self):
        self.calls = []
        self._now = 0.0

    def _keep(self, name, *arguments):
        self.calls.append((self._now, name, arguments))

    def phase(self, *arguments):
        self._keep("phase", *arguments)

    def waiting(self, *arguments):
        pass

    def status(self, status):
        self._now = status.time
        self._keep("status", status)

    def event(self, *arguments):
        self._keep("event", *arguments)


def flown(**changes):
    """The configuration of a circle, and what its observer was told."""
    kept = Kept()
    with mock_vehicle() as mock:
        config = quick_flight(mock.autopilot, {**CIRCLE, **changes})
        summary = testing.fly(config, mock, observer=kept)
        assert summary.result == "ok"
    return config, kept.calls


class Page:
    """A live page over a flight that is told again; changes are made without a flight.

    Attributes:
        notes: what the page's process had to say.
    """

    def __init__(self, config, folder: Path | None, address="127.0.0.1:0", watch=None):
        self.door = open_door(address)
        self.notes = []
        self.helper = Helper(Wishes(watch, self.door, True, folder), config)
        self.helper.note = self.notes.append
        self.door.listening.close()
        self.url = f"http://127.0.0.1:{self.door.port}/"

    async def tell(self, calls, pace=1.0):
        """Tell the flight again, `pace` times as fast, once and from its end on."""
        began = asyncio.get_running_loop().time()
        for at, name, arguments in calls:
            await asyncio.sleep(began + at / pace - asyncio.get_running_loop().time())
            getattr(self.helper, name)(*arguments)
