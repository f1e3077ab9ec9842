"""A real autopilot in its simulation, and flights of `companion fly` on it.

`REAL` names the folder that holds `px4/start`, `ardupilot/start` and `stop`; without it
`../shared/real`, beside the repository.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from fcntl import LOCK_EX, flock
from pathlib import Path

import yaml

from tests.real.relay import Relay
from tests.real.station import Station

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("REAL", ROOT.parent / "shared" / "real"))
PORTS = {"px4": (14540, 14640), "ardupilot": (5760, 5860)}
"""The autopilot's, and the one that the program is given."""
TUNED = {
    "px4": {"thrust": {"hover_thrust": 0.49}, "guidance": {"drag_per_s": 1.0}},
    "ardupilot": {"thrust": {"hover_thrust": 0.37}, "guidance": {"drag_per_s": 0.3}},
}
HOVER = {
    "flight": {"arm": True, "takeoff_height_m": 5.0, "programme": ["hover"]},
    "hover": {"duration_s": 120.0},
}


def merged(base, changes):
    out = dict(base)
    for key, value in changes.items():
        out[key] = merged(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


class Vehicle:
    """A running autopilot with our relay and a ground station beside it."""

    def __init__(self, autopilot: str, folder: Path) -> None:
        self.autopilot, self.folder = autopilot, folder
        vehicle_port, port = PORTS[autopilot]
        self.relay = Relay(autopilot, vehicle_port, port)
        self.station = Station(autopilot)
        self.station.until(lambda: self.station.told, 60.0, "heartbeat")
        self.station.ask_for_rates()
        self.flown: list[Flight] = []

    def close(self) -> None:
        for flight in self.flown:
            flight.process.kill()
            flight.process.wait()
        self.station.close()
        self.relay.close()

    def parameter(self, name: str, value: float) -> None:
        """Set a parameter of the autopilot, whatever its type."""
        if self.autopilot == "px4":
            tool = self.folder / "bin" / "px4-param"
            subprocess.run([tool, "set", name, f"{value:g}"], check=True, capture_output=True)
        else:
            self.station.set_parameter(name, value)

    def fly(self, *, prelude: str = "", **changes) -> "Flight":
        """Begin `companion fly`; `prelude` is Python that its process runs before."""
        if self.autopilot == "ardupilot":
            self.station.command(42651, 1, 100)  # its battery empties from flight to flight
        folder = self.folder / f"flight{len(self.flown) + 1}"
        folder.mkdir()
        config = merged(merged(HOVER, TUNED[self.autopilot]), changes)
        config["link"] = {"endpoint": self.relay.endpoint} | config.get("link", {})
        config["recording"] = {"directory": str(folder)}
        config["include"] = str(ROOT / "configs" / f"vehicle-{self.autopilot}.yaml")
        path = folder / "fly.yaml"
        path.write_text(yaml.safe_dump(config, sort_keys=False))
        program = f"{prelude}\nfrom companion.cli import main\nraise SystemExit(main())"
        command = [sys.executable, "-c", program, "fly", "--config", str(path), "--json"]
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=(folder / "err.txt").open("w"), text=True,
        )  # fmt: skip
        self.flown.append(Flight(self, process))
        return self.flown[-1]

    def hovering(self, seconds: float = 4.0, **changes) -> "Flight":
        """A flight that has been flown by our rates for so long."""
        flight = self.fly(**changes)
        flight.until_obeyed()
        time.sleep(seconds)
        assert self.station.obeys, f"{self.station.mode}: {flight.said()}"
        return flight

    def bring_down(self) -> None:
        """As a pilot would, so that the next flight can begin."""
        self.relay.plug(up=True, down=True)
        if self.station.armed:
            if self.station.mode != "LAND":
                self.station.set_mode("LAND")
            self.station.until(lambda: not self.station.armed, 90.0, "disarming")
        time.sleep(1.5)

    def load(self) -> str:
        return " ".join(f"{each:.1f}" for each in os.getloadavg())


class Flight:
    """A process that flies."""

    def __init__(self, vehicle: Vehicle, process: subprocess.Popen) -> None:
        self.vehicle, self.process, self.began = vehicle, process, time.monotonic()
        self.result: dict = {}

    def until_obeyed(self, seconds: float = 120.0) -> float:
        station = self.vehicle.station
        return station.until(
            lambda: station.obeys or self.process.poll() is not None, seconds, "offboard"
        )

    def send(self, number: signal.Signals) -> float:
        now = time.monotonic()
        self.process.send_signal(number)
        return now

    def finish(self, seconds: float = 120.0) -> dict:
        """The summary, with the exit code."""
        out, _ = self.process.communicate(timeout=seconds)
        lines = out.splitlines()
        self.result = json.loads(lines[-1]) if lines else {}
        return self.result

    def said(self) -> list[str]:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return [event["text"] for event in self.finish().get("events", [])]

    def last_setpoint(self, since: float) -> float | None:
        """How long after `since` the last setpoint passed, s; None if none did."""
        later = [at for at in self.vehicle.relay.setpoints if at > since]
        return round(later[-1] - since, 3) if later else None


@contextmanager
def real_vehicle(autopilot: str, *arguments: str, folder: Path | None = None):
    """Start it, alone on this machine, and stop it afterwards whatever happens."""
    folder = folder or Path(tempfile.mkdtemp(prefix=f"real-{autopilot}-"))
    with Path(f"/tmp/{autopilot}.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        start, stop = REAL / autopilot / "start", REAL / "stop"
        try:
            subprocess.run([start, folder, *arguments], check=True, capture_output=True)
            vehicle = Vehicle(autopilot, folder)
            try:
                yield vehicle
            finally:
                vehicle.close()
        finally:
            subprocess.run([stop, folder], check=False)
