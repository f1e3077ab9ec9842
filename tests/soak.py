"""A long flight in real time over a bad link: `python -m tests.soak --minutes 30`, or `make soak`.

The bundled vehicle circles at 250 Hz while its link is disturbed at random (seeded): datagrams are
lost, late, doubled, swapped and damaged. A relay between the two notes when each sample went to the
program and when its answer came back; so the program's own counts are judged from outside. At the
end: how far memory grew, which late or missing answers were not counted, and which events no fault
explains. Exit code 0 if all three are as they should be.
"""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import psutil
import yaml

from companion.mavlink.transport.free_port import free_port
from tests.flight.sockets import mock_vehicle
from tests.soak_relay import Relay

RADIUS_M, SPEED_M_S = 3.0, 2.0
SAMPLE_PERIOD_S = 10.0
SETTLED_S = 60.0
"""Memory may grow until then: caches fill, modules load."""
MOST_GROWTH = 2 * 1024 * 1024
AFTERMATH_S = 12.0
"""So long after a fault it may still show: the dead time is judged over 8 s, and twice."""
EXPECTED = (
    "preflight warnings: ",  # on the ground, by a vehicle as PX4 sets it up
    "mode ",
    "maneuver: ",
    "armed",
    "disarmed",
    "autopilot: ",
    "realtime: ",
    "offboard loss: if our setpoints stop",
    "the vehicle's drag is",
)
"""How the events of an undisturbed flight begin."""
FAULTS = (
    {"kind": "drop", "probability": 0.3},
    {"kind": "delay", "probability": 0.5, "delay_ms": 20.0},
    {"kind": "duplicate", "probability": 0.5},
    {"kind": "reorder", "probability": 0.5},
    {"kind": "corrupt", "probability": 0.3},
)
"""None of them is one for which a flight should end; each lasts up to `LONGEST_FAULT_S`."""
LONGEST_FAULT_S = 1.0


VEHICLE_PRIORITY, RELAY_PRIORITY = 60, 55
"""SCHED_FIFO, above the program's, where we may: a vehicle that stands still because this computer
is busy is no fault of the link's, and a relay that is held up measures itself."""


class Memory(NamedTuple):
    at: float
    rss: int


class Report(NamedTuple):
    """What came of it; times in s of `time.monotonic`."""

    summary: dict
    memory: list[Memory]
    faults: list[tuple[float, str]]
    outside: dict[str, int]
    began: float

    def growth(self, settled: float) -> int:
        """Bytes by which memory grew at most, once `settled` s had passed since the first look."""
        later = [each.rss for each in self.memory if each.at - self.memory[0].at >= settled]
        return max(later) - later[0] if later else 0

    def unexplained(self) -> list[str]:
        """Events that neither a flight without faults has, nor a fault shortly before explains."""
        return [
            event["text"]
            for event in self.summary["events"]
            if not event["text"].startswith(EXPECTED)
            and not any(
                0.0 <= self.began + event["time_s"] - at <= LONGEST_FAULT_S + AFTERMATH_S
                for at, _ in self.faults
            )
        ]

    def uncounted(self) -> int:
        """Answers that were late or missing as seen from outside, beyond those that it counted."""
        late = max(0, self.outside["late"] - self.summary["missed_deadlines"])
        not_answered = self.summary["stale"] + self.summary["refused"]
        return late + max(0, self.outside["missing"] - not_answered)


def flight_config(folder: Path, port: int, seconds: float) -> Path:
    """The companion's: a hover, then a circle that lasts as long as asked."""
    laps = seconds * SPEED_M_S / (2.0 * math.pi * RADIUS_M)
    config = {
        "include": str(Path(__file__).parents[1] / "configs" / "vehicle-px4.yaml"),
        "link": {"endpoint": f"udpin://127.0.0.1:{port}"},
        "thrust": {"hover_thrust": 0.49},
        "flight": {"arm": True, "maneuvers": ["hover", "circle"], "takeoff_height_m": 2.0},
        "hover": {"duration_s": 1.0},
        "circle": {"radius_m": RADIUS_M, "speed_m_s": SPEED_M_S, "laps": laps},
        "realtime": {"scheduler": "fifo"},
        "recording": {"directory": str(folder / "flights")},
    }
    path = folder / "soak.yaml"
    path.write_text(yaml.safe_dump(config))
    return path


class Disturber(threading.Thread):
    """Asks the vehicle for one fault after the other, while it is flown."""

    def __init__(self, mock, seed: int) -> None:
        super().__init__(daemon=True)
        self.faults: list[tuple[float, str]] = []
        self._mock, self._random, self._over = mock, random.Random(seed), threading.Event()

    def run(self) -> None:
        while not self._over.wait(self._random.uniform(1.0, 5.0)):
            if self._mock.state()["mode"] != "OFFBOARD":
                continue
            fault = dict(self._random.choice(FAULTS))
            fault["direction"] = self._random.choice(["to_companion", "from_companion", "both"])
            fault["duration_s"] = self._random.uniform(0.1, LONGEST_FAULT_S)
            self.faults.append((time.monotonic(), fault["kind"]))
            assert self._mock.ask({"fault": fault}) == {"ok": True}

    def end(self) -> None:
        self._over.set()
        self.join()


def soak(folder: Path, seconds: float, seed: int, every: float = SAMPLE_PERIOD_S) -> Report:
    """Fly for about `seconds` in the maneuver; looks at the memory `every` s of it."""
    settings = {"speed": 1.0, "seed": seed, "exact_rates": True, "parameters": {}}
    with mock_vehicle(
        folder, in_lockstep=False, battery={"capacity_ah": 500.0}, **settings
    ) as mock:
        go_first(mock.process.pid, VEHICLE_PRIORITY)
        relay = Relay(mock.port, free_port(), lambda: go_first(0, RELAY_PRIORITY))
        disturber = Disturber(mock, seed)
        config = flight_config(folder, relay.companion_port, seconds)
        command = [sys.executable, "-m", "companion", "fly", "--config", str(config), "--json"]
        with (folder / "words.txt").open("wb") as words, relay:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=words)
            disturber.start()
            try:
                memory = watch(process, mock, every)
                out, _ = process.communicate(timeout=120)
            finally:
                disturber.end()
                if process.poll() is None:
                    process.kill()
                    process.communicate()
        assert out, (folder / "words.txt").read_text()
        summary = json.loads(out.decode().strip().splitlines()[-1])
    return Report(summary, memory, disturber.faults, relay.answers.figures(), relay.began)


def go_first(pid: int, priority: int) -> None:
    """Have a process (0: this thread) run before others, where we may."""
    with suppress(PermissionError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(pid, policy, os.sched_param(priority))


def watch(process: "subprocess.Popen[bytes]", mock, every: float) -> list[Memory]:
    """The program's resident memory while it steers, until it does not any more."""
    program = psutil.Process(process.pid)
    mock.until(lambda state: state["mode"] == "OFFBOARD" or process.poll() is not None, 120.0)
    memory: list[Memory] = []
    while process.poll() is None and mock.state()["mode"] == "OFFBOARD":
        memory.append(Memory(time.monotonic(), program.memory_info().rss))
        time.sleep(every)
    return memory


def verdict(report: Report, settled: float) -> tuple[list[str], bool]:
    """What to print, and whether all is well."""
    summary, growth = report.summary, report.growth(settled)
    unexplained, uncounted = report.unexplained(), report.uncounted()
    kinds = [kind for _, kind in report.faults]
    lines = [
        f"flight: {summary['result']}, {summary['rate_hz']:.1f} setpoints a second, "
        f"{len(report.faults)} faults: "
        + ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds))),
        f"memory: {report.memory[-1].rss / 2**20:.1f} MiB, grown by {growth / 2**20:.2f} MiB "
        f"after the first {settled:g} s",
        f"answers: {report.outside} from outside; itself it counted {summary['missed_deadlines']} "
        f"late, {summary['stale']} too old or out of order, {summary['refused']} refused: "
        f"{uncounted} not counted",
        f"events: {len(summary['events'])}, unexplained: {unexplained or 'none'}",
    ]
    good = summary["result"] == "ok" and growth < MOST_GROWTH
    return lines, good and not unexplained and uncounted == 0


def main() -> int:
    """Soak, and say what came of it."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        report = soak(Path(folder), 60.0 * options.minutes, options.seed)
    lines, good = verdict(report, SETTLED_S)
    print("\n".join(lines))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
