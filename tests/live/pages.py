"""A live page without a flight: it is told of a circle, and changes take effect at once."""

import asyncio
import threading
from math import cos, pi, sin

from companion.config import Config
from companion.flight.status import FlightStatus
from companion.live.addresses import open_page_socket
from companion.live.helper import Helper, HelperTasks


def status(time):
    """A vehicle on a circle of 4 m, once round in 8 s."""
    angle = 2.0 * pi * time / 8.0
    north, east = 4.0 * cos(angle), 4.0 * sin(angle)
    view = {
        "q_w": 1.0,
        "q_x": 0.1 * sin(angle),
        "q_y": 0.1 * cos(angle),
        "q_z": 0.0,
        "measured_north": -0.2 * cos(angle),
        "measured_east": -0.2 * sin(angle),
        "target_north": -0.25 * cos(angle),
        "target_east": -0.25 * sin(angle),
        "reference_north": -0.2 * cos(angle),
        "reference_east": -0.2 * sin(angle),
        "estimated_north_m": north,
        "estimated_east_m": east,
        "reference_north_m": 1.02 * north,
        "reference_east_m": 1.02 * east,
        "fence_north_m": 0.0,
        "fence_east_m": 0.0,
        "height_m": 3.0 + 0.1 * sin(angle),
        "reference_height_m": 3.0,
        "frames_lost": 0,
        "round_trip_ms": 1.5,
    }
    return FlightStatus(
        time=time,
        airborne_time=time,
        phase="maneuvers",
        waiting_for="",
        elapsed=time,
        timeout=60.0,
        maneuver="circle",
        maneuver_elapsed=time,
        maneuver_duration=60.0,
        speed=3.1,
        tilt=0.2,
        tracking_error=0.08,
        setpoint_rate=250.0,
        latency=0.0003,
        missed_deadlines=0,
        monitored=True,
        view=view,
    )


class Page:
    """A live page, told of the circle by a thread until `end`.

    Attributes:
        page_socket: of the page.
        helper: the flight's side of its process.
        notes: what the process had to say.
        url: of the page.
    """

    def __init__(self, folder=None, address="127.0.0.1:0"):
        self.page_socket, self.notes = open_page_socket(address), []
        self.helper = Helper(
            HelperTasks(None, Config(), self.page_socket, None, True, folder), Config()
        )
        self.helper.note = self.notes.append
        self.page_socket.listening_socket.close()
        self.url = f"http://127.0.0.1:{self.page_socket.port}/"
        self._over = threading.Event()
        self._thread = threading.Thread(target=asyncio.run, args=(self._serve(),))
        self._thread.start()

    def end(self):
        """End the flight."""
        self._over.set()
        self._thread.join()
        self.helper.close("the flight is over")

    async def _serve(self):
        await self.helper.run_while_serving(self._tell())

    async def _tell(self):
        loop = asyncio.get_running_loop()
        began = loop.time()
        self.helper.phase("maneuvers", "the maneuver to end")
        self.helper.event(0.0, "maneuver: circle")
        while not self._over.is_set():
            self.helper.status(status(loop.time() - began))
            await asyncio.sleep(0.1)
