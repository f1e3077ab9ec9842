"""A real autopilot in its simulation, and flights of `companion fly` on it."""

import os
import tempfile
import time
from contextlib import contextmanager, nullcontext
from fcntl import LOCK_EX, flock
from pathlib import Path

from tests.real.build import ROOT, Build, build_of, running
from tests.real.dataflash import DataflashLog, newest_log
from tests.real.flight import Flight, started
from tests.real.relay import Relay, connected
from tests.real.station import Station
from tests.real.truth import Truth

PORTS = {"px4": (14540, 14640), "ardupilot": (5760, 5860)}
"""Of the autopilot, and of the relay that the program is given instead."""
TUNED = {
    "px4": {"thrust": {"hover_thrust": 0.49}, "guidance": {"drag_per_s": 1.0}},
    "ardupilot": {"thrust": {"hover_thrust": 0.37}, "guidance": {"drag_per_s": 0.3}},
}
WIND = {
    "px4": {"SIH_WIND_N": 3.0},
    # Without SIM_WIND_T 1 its wind grows with the root of the height, to its full speed at 60 m.
    "ardupilot": {
        "SIM_WIND_SPD": 3.0,
        "SIM_WIND_DIR": 180.0,
        "SIM_WIND_TURB": 1.0,
        "SIM_WIND_T": 1.0,
    },
}
"""Parameters of the simulators; PX4's has no turbulence."""
_HEARTBEATS_S = 1.2
"""PX4 tells once a second whether it is armed."""
_TURN_ABOVE_M, _TURN_DEG_S = 1.5, 30.0
HOVER = {
    "flight": {"arm": True, "takeoff_height_m": 5.0, "maneuvers": ["hover"]},
    "hover": {"duration_s": 120.0},
}


def merged(base, changes):
    out = dict(base)
    for key, value in changes.items():
        out[key] = merged(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


class Vehicle:
    """A running autopilot with a ground station beside it.

    Attributes:
        relay: stands between it and the program, or None.
        endpoint: for `link.endpoint`.
        fifo: whether the program flies before other programs of this computer (SCHED_FIFO).
    """

    def __init__(
        self, build: Build, folder: Path, *, relayed: bool = True, fifo: bool = False
    ) -> None:
        self.fifo = fifo
        self.autopilot, self.folder, self.build = build.autopilot, folder, build
        self.relay = Relay(self.autopilot, *PORTS[self.autopilot]) if relayed else None
        self.endpoint = build.endpoint if self.relay is None else self.relay.endpoint
        # ArduPilot boots when a client comes to its first port, and must keep it until it runs.
        first = nullcontext()
        if self.endpoint.startswith("tcp://"):
            host, _, port = self.endpoint.removeprefix("tcp://").rpartition(":")
            first = connected(host, int(port), build.ready_s)
        with first:
            self.station = Station(build)
            self.station.until(lambda: self.station.told, build.ready_s, "heartbeat")
        self.station.ask_for_rates()
        self.flown: list[Flight] = []
        self._logs: dict[Path, DataflashLog] = {}

    def close(self) -> None:
        for flight in self.flown:
            flight.process.kill()
            flight.process.wait()
        self.station.close()
        if self.relay is not None:
            self.relay.close()

    def parameter(self, name: str, value: float) -> None:
        """Set a parameter of the autopilot, whatever its type."""
        self.station.set_parameter(name, value)

    def fly(self, *, prelude: str = "", **changes) -> Flight:
        """Begin `companion fly`; `prelude` is Python that its process runs before."""
        include = {"include": str(ROOT / "configs" / f"vehicle-{self.autopilot}.yaml")}
        config = merged(merged(HOVER, TUNED[self.autopilot]), changes) | include
        return self.launch(config, prelude=prelude)

    def launch(
        self, config: dict, *, command: str = "fly", prelude: str = "", folder: Path | None = None
    ) -> Flight:
        """Begin `companion fly` or `companion identify`; it records in `folder`."""
        if self.autopilot == "ardupilot":
            self.station.command(42651, 1, 100)  # its battery empties from flight to flight
        folder = folder or self.folder / f"flight{len(self.flown) + 1}"
        first = {"realtime": {"scheduler": "fifo"}} if self.fifo else {}
        config = merged({"link": {"endpoint": self.endpoint}, **first}, config)
        self.flown.append(started(self, config, folder, command, prelude))
        return self.flown[-1]

    def hovering(self, seconds: float = 4.0, **changes) -> Flight:
        """A flight that has been flown by our rates for so long."""
        flight = self.fly(**changes)
        flight.until_obeyed()
        time.sleep(seconds)
        assert self.station.obeys, f"{self.station.mode}: {flight.said()}"
        return flight

    def face_north(self, flight: Flight) -> None:
        """Turn an ArduCopter to north while it takes off; PX4 keeps its heading by itself.

        Corners leave ArduPilot a degree off each time, and the straightness of all planners
        depends on the heading (first-order at 400°/s: 0.026 at 0°, 0.046 at -8.5°).
        """
        if self.autopilot != "ardupilot":
            return
        station = self.station
        high = lambda: station.mode == "GUIDED" and station.armed and station.up > _TURN_ABOVE_M  # noqa: E731
        station.until(lambda: high() or flight.process.poll() is not None, 200.0, "take-off")
        station.command(115, 0.0, _TURN_DEG_S)

    def blow(self, on: bool) -> None:
        """Wind from now on, or none."""
        for name, value in WIND[self.autopilot].items():
            self.parameter(name, value if on else 0.0)

    def truth(self, arrival: float, vehicle_time: float) -> Truth | None:
        """The motion since then: by our clock (`time.monotonic`), by the vehicle's, s."""
        if self.station.hil is not None:
            return self.station.hil.since(arrival)
        if self.build.truth == "none":
            return None
        log = newest_log(Path(self.build.truth).expanduser())
        if log not in self._logs:
            self._logs[log] = DataflashLog(log)
        return self._logs[log].truth(vehicle_time)

    def bring_down(self) -> None:
        """As a pilot would, so that the next flight can begin."""
        if self.relay is not None:
            self.relay.plug(up=True, down=True)
        if self.station.armed:
            time.sleep(_HEARTBEATS_S)  # it may have been disarmed since the latest one
        if self.station.armed:
            if self.station.mode != "LAND":
                self.station.set_mode("LAND")
            self.station.until(lambda: not self.station.armed, 90.0, "disarming")
        time.sleep(1.5)

    def load(self) -> str:
        return " ".join(f"{each:.1f}" for each in os.getloadavg())


@contextmanager
def real_vehicle(
    autopilot: str,
    *arguments: str,
    folder: Path | None = None,
    relayed: bool = True,
    fifo: bool = False,
):
    """Start it, alone on this machine, and stop it afterwards whatever happens.

    Args:
        autopilot: px4 or ardupilot.
        arguments: of its `start`.
        folder: where it keeps its files; null: a temporary one.
        relayed: whether a `Relay` stands between it and the program.
        fifo: autopilot and program before other programs of this computer (SCHED_FIFO), where
            that is allowed.
    """
    folder = (folder or Path(tempfile.mkdtemp(prefix=f"real-{autopilot}-"))).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    build = build_of(autopilot, folder, list(arguments))
    log = folder.with_suffix(".log")
    with Path(f"/tmp/{autopilot}.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        with running(build, log, fifo=fifo):
            vehicle = Vehicle(build, folder, relayed=relayed, fifo=fifo)
            try:
                yield vehicle
            finally:
                vehicle.close()
