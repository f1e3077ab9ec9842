"""The mock vehicle in the place of a real autopilot: the same flights, the same measures."""

import itertools
import json
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import yaml

from companion.demo import free_port
from tests.real.build import ROOT
from tests.real.truth import Floats, NoTruthError, Truth, truth_from
from tests.real.vehicle import Flight, merged, started

_POLLED_S = 0.0005
"""Between two questions for the truth; in lockstep vehicle time runs several times as fast."""
# The other one's answer is waited for asleep: a real autopilot may fly on the same computer.
_PATIENT = "from companion.mavlink import lockstep; lockstep._SPIN_S = 0.0"
_MOCK = """
from sitl_mock import __main__, server
server.SPIN_S = 0.0
raise SystemExit(__main__.main())
"""
_FILLED_S, _LONGEST_S = 0.01, 0.3
"""Between two answers of the truth, filled by a cubic with their velocities (1e-4 m), s."""
_WIND = {"speed_m_s": 3.0, "from_deg": 180.0, "gust_m_s": 0.5}


class MockVehicle:
    """A mock for each flight, in lockstep: its figures do not depend on this computer's load.

    Attributes:
        autopilot: whose personality it has.
        flown: the flights.

    Args:
        autopilot: px4 or ardupilot.
        settings: keys of the mock's section that differ from configs/mock-*.yaml.
    """

    def __init__(self, autopilot: str, settings: dict) -> None:
        self.autopilot = autopilot
        self.flown: list[Flight] = []
        self._settings = settings
        self._wind: dict = {}
        self._mock: _Mock | None = None

    def close(self) -> None:
        """End it."""
        if self._mock is not None:
            self._mock.close()

    def face_north(self, flight: Flight) -> None:
        """It does already."""

    def blow(self, on: bool) -> None:
        """Wind in the next flight, or none."""
        self._wind = {"wind": _WIND} if on else {}

    def launch(self, config: dict, *, command: str = "fly", folder: Path) -> Flight:
        """As `Vehicle.launch`."""
        self.close()
        shipped = ROOT / "configs" / f"mock-{self.autopilot}.yaml"
        settings = merged(yaml.safe_load(shipped.read_text())["mock"], self._settings)
        # As irregular as a real link; and each flight has its own luck, so that medians mean
        # something.
        own = {"gcs_port": 0, "exact_rates": False, "seed": 1 + len(self.flown)}
        self._mock = _Mock(merged(settings, self._wind | own), folder.parent)
        link = {"endpoint": self._mock.endpoint, "lockstep": True}
        self.flown.append(started(self, merged(config, {"link": link}), folder, command, _PATIENT))
        return self.flown[-1]

    def truth(self, arrival: float, vehicle_time: float) -> Truth:
        """Of the latest flight.

        Raises:
            NoTruthError: it told none.
        """
        rows = np.array(self._mock.rows if self._mock else []).reshape(-1, 11)
        if len(rows) < 2:
            raise NoTruthError("the mock told no truth")
        rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
        return truth_from(_filled(rows[:, :7]), rows[:, [0, 7, 8, 9, 10]])

    def bring_down(self) -> None:
        """The next flight has a vehicle of its own."""

    def load(self) -> str:
        """Of this computer, over 1, 5 and 15 minutes."""
        return " ".join(f"{each:.1f}" for each in os.getloadavg())


def _filled(rows: Floats) -> Floats:
    """Positions every 10 ms or more often: a busy computer lets us ask more rarely.

    Args:
        rows: (n, 7), rising: time s, position m, velocity m/s.
    """
    parts = [rows[:, :4]]
    for (t0, *a), (t1, *b) in itertools.pairwise(rows):
        h = t1 - t0
        if not _FILLED_S < h < _LONGEST_S:
            continue
        s = np.arange(_FILLED_S, h, _FILLED_S)[:, None] / h
        (p0, v0), (p1, v1) = (np.split(np.array(each), 2) for each in (a, b))
        cubic = (1 + 2 * s) * (1 - s) ** 2 * p0 + s * (1 - s) ** 2 * h * v0
        cubic += s**2 * (3 - 2 * s) * p1 + s**2 * (s - 1) * h * v1
        parts.append(np.column_stack([t0 + h * s, cubic]))
    return np.concatenate(parts)


class _Mock:
    """A running mock, whose truth is asked for all the time."""

    def __init__(self, settings: dict, folder: Path) -> None:
        self.rows: list[list[float]] = []
        port, control = free_port(), free_port()
        self.endpoint = f"udpin://127.0.0.1:{port}"
        config = folder / "mock.yaml"
        config.write_text(yaml.safe_dump({"mock": settings}))
        arguments = ["--headless", "--lockstep", "--config", str(config)]
        arguments += ["--port", str(port), "--control-port", str(control)]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _MOCK, *arguments], cwd=ROOT, stdin=subprocess.DEVNULL,
            stdout=(folder / "mock.log").open("w"), stderr=subprocess.STDOUT,
        )  # fmt: skip
        self._address = ("127.0.0.1", control)
        self._running = True
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._running = False
        self._thread.join()
        self._process.terminate()
        self._process.wait()

    def _watch(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            channel.settimeout(0.2)
            while self._running:
                try:
                    channel.sendto(b'{"state": true}', self._address)
                    state = json.loads(channel.recv(65536))
                except (TimeoutError, ConnectionRefusedError):
                    continue
                self.rows.append(
                    [state["time"], *state["position"], *state["velocity"], *state["q"]]
                )
                time.sleep(_POLLED_S)
