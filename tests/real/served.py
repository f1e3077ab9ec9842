"""An offboard program of MAVSDK on a real autopilot, through `companion serve` or directly.

`python -m tests.real.served px4 mavsdk_native.py`, or with `mavsdk_grpc_program.py`, or `--direct`.
One line of JSON: what the program saw, and for the circle the errors by telemetry and by truth.
Needs the autopilots (see `build.py`), so `make test` leaves it alone.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from companion.recording.flight_record import read_flight
from companion.recording.measurements.recorded_summary import trace_of
from tests.real.build import REAL, ROOT
from tests.real.measures import rms
from tests.real.stamps import stamp_offset
from tests.real.vehicle import TUNED, merged, real_vehicle

ARGUMENTS = {"px4": [], "ardupilot": [str(REAL / "ardupilot" / "guided.parm")]}
PROGRAM_ARGUMENTS = {"px4": ("0.49", "MPC_THR_HOVER"), "ardupilot": ("0.363", "MOT_THST_HOVER")}
DIRECT = {"px4": "udpin://0.0.0.0:14540", "ardupilot": "tcpout://127.0.0.1:5760"}
OURS = "127.0.0.1:14551"
_LONGEST_S = 240.0
SPEED, _NEAR_SPEED = 5.0, 0.1
"""The circle is what is flown at this speed, m/s."""
_LEAST_ROWS = 50


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.real.served", description=__doc__)
    parser.add_argument("autopilot", choices=["px4", "ardupilot"])
    parser.add_argument("program", help="a file of tests/serve")
    parser.add_argument("--direct", action="store_true", help="without `companion serve`")
    parser.add_argument("--ground", action="store_true", help="ask for control on the ground")
    parser.add_argument("--wind", action="store_true", help="3 m/s of it")
    parser.add_argument("--start", action="append", help="arguments of `start`, one each")
    options = parser.parse_args()
    arguments = options.start or ARGUMENTS[options.autopilot]
    with real_vehicle(options.autopilot, *arguments, relayed=False) as vehicle:
        vehicle.blow(options.wind)
        more = ["ground"] if options.ground else []
        row = (direct if options.direct else through_us)(vehicle, options.program, more)
        vehicle.bring_down()
        load = vehicle.load()
    print(json.dumps({"autopilot": options.autopilot, **vars(options), "load": load, **row}))
    return int("error" in row)


def direct(vehicle, program: str, more: list[str]) -> dict:
    """The program on the autopilot itself."""
    return run(program, vehicle.autopilot, DIRECT[vehicle.autopilot], more)


def through_us(vehicle, program: str, more: list[str]) -> dict:
    """The program through `companion serve`; the circle is measured by truth."""
    folder = Path(tempfile.mkdtemp(prefix="served-")) / "serve"
    include = {"include": str(ROOT / "configs" / f"vehicle-{vehicle.autopilot}.yaml")}
    serve = {"serve": {"clients": [f"udpin://{OURS}"]}, "limits": {"max_tilt_deg": 45.0}}
    serving = vehicle.launch(
        merged(TUNED[vehicle.autopilot], serve) | include, command="serve", folder=folder
    )
    arrival = time.monotonic()
    row = run(program, vehicle.autopilot, f"udpout://{OURS}", more)
    serving.send(2)
    row["counters"] = serving.finish()
    flights = [each for each in sorted(folder.iterdir()) if (each / "summary.json").exists()]
    row["flights"] = len(flights)
    for flight in flights:
        row |= measured(vehicle, flight, arrival)
    if "error" in row:
        row["said"] = serving._errors.read_text()[-3000:]
    return row


def run(program: str, autopilot: str, endpoint: str, more: list[str]) -> dict:
    """Run a program; what it reported, or its error."""
    path = ROOT / "tests" / "serve" / program
    try:
        ended = subprocess.run(
            [sys.executable, path, endpoint, *PROGRAM_ARGUMENTS[autopilot], *more],
            capture_output=True, text=True, timeout=_LONGEST_S, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"error": f"the program did not end within {_LONGEST_S:g} s"}
    if ended.returncode != 0:
        return {"error": ended.stderr[-1500:]}
    report = json.loads(ended.stdout.split("REPORT ")[1].splitlines()[0])
    del report["wanted"]
    return report


def measured(vehicle, folder: Path, arrival: float) -> dict:
    """The summary of a recorded flight, and the errors on its circle at full speed, RMS in m."""
    summary = json.loads((folder / "summary.json").read_text())
    out = {"result": summary["result"], "latency_us": summary["latency_us"]}
    trace = trace_of(read_flight(folder))
    tracking = trace.tracking.rows().copy()
    tracking[:, 0] += stamp_offset(trace.rates.rows(), folder / "flight.tlog")
    speed = np.linalg.norm(np.gradient(tracking[:, 1:4], tracking[:, 0], axis=0), axis=1)
    circle = tracking[abs(speed - SPEED) < _NEAR_SPEED]
    if len(circle) < _LEAST_ROWS:
        return out
    time, reference = circle[:, 0], circle[:, 1:4]
    out["circle_program_m"] = rms(circle[:, 4:7] - reference)
    truth = vehicle.truth(arrival, float(tracking[0, 0]) - 1.0)
    if truth is not None:
        true = truth.position_at(time)
        # The estimator's origin is its own: laid over each other by one shift.
        shift = (circle[:, 4:7] - true).mean(axis=0)
        out["circle_truth_m"] = rms(true + shift - reference)
    return out


if __name__ == "__main__":
    sys.exit(main())
