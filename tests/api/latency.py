"""What a busy program costs the time from sample to setpoint; flown in real time on PX4's mock.

`python -m tests.api.latency --seconds 8 --fifo` prints p50 and p99 at 250 Hz for a program that
only commands, one that computes 50 ms for each command, and one that never yields.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

import numpy as np

import companion
from tests.flight.fly import quick_flight
from tests.flight.sockets import mock_vehicle

PROGRAMS = {"commands": 0.0, "computes": 0.05, "never yields": None}
"""Time to compute for each command, s; None: all the time."""


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--fifo", action="store_true", help="with realtime.scheduler: fifo")
    options = parser.parse_args()
    for name, seconds in PROGRAMS.items():
        with tempfile.TemporaryDirectory() as folder:
            found = _flight(Path(folder), options.seconds, seconds, fifo=options.fifo)
        p50, p99 = (round(float(np.percentile(found, each)) * 1e-6, 3) for each in (50, 99))
        load = round(os.getloadavg()[0], 1)
        row = {"program": name, "p50_ms": p50, "p99_ms": p99, "n": len(found), "load": load}
        print(json.dumps(row), flush=True)


def _flight(folder: Path, seconds: float, busy: float | None, *, fifo: bool) -> list[float]:
    """Latencies while the program runs, ns."""
    found: list[float] = []
    with mock_vehicle(folder, in_lockstep=False, full_rate=True, speed=1.0) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        more = {"realtime": {"scheduler": "fifo"}} if fifo else {}
        config = quick_flight("px4", more, endpoint=endpoint, attitude_rate_hz=mock.rate_hz)

        async def fly() -> None:
            async with companion.connect(config, folder=folder) as vehicle:
                await vehicle.take_off()
                latencies = vehicle._flight.context.loop._recorder._trace.latencies_ns
                before = len(latencies.rows())
                if busy is None:
                    _compute(seconds)
                else:
                    async with vehicle.control() as control:
                        async for state in control.states(seconds=seconds):
                            north, east, down = state.velocity_ned
                            control.accelerate((-north, -east, -down))
                            _compute(busy)
                found.extend(latencies.rows()[before:, 0])
                await vehicle.land()

        companion.run(fly())
    return found


def _compute(seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass


if __name__ == "__main__":
    main()
