"""Flights on a real autopilot in its simulation: `python -m tests.real px4 killed pilot*20`.

One line of JSON a flight. Needs the autopilots (see `build.py`), so `make test` leaves it alone.
"""

import argparse
import json
import sys
import traceback

from tests.real.build import REAL
from tests.real.rows import ROWS
from tests.real.vehicle import real_vehicle

ARGUMENTS = {"px4": ["PX4_PARAM_COM_OBL_RC_ACT=4"], "ardupilot": []}


TRIES = 6
DISTURBED = (
    "stood still",
    "deadman.deadline_ms",
    "timer is late",
    "arrives, but older than deadman",
    "comes too rarely",
    "clock went back",
    "jumped ahead",
    "setpoints paused",
    "reach the vehicle too late",
)
"""What a flight says that was ended by a busy computer, which stalls the simulator, too."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.real", description=__doc__)
    parser.add_argument("autopilot", choices=["px4", "ardupilot"])
    parser.add_argument("rows", nargs="+", help=f"NAME or NAME*TIMES, of {', '.join(ROWS)}")
    parser.add_argument("--start", action="append", help="arguments of `start`, one each")
    options = parser.parse_args()
    arguments = options.start or ARGUMENTS[options.autopilot]
    if options.autopilot == "ardupilot" and not options.start:
        arguments = [str(REAL / "ardupilot" / "guided.parm")]
    failed = 0
    with real_vehicle(options.autopilot, *arguments) as vehicle:
        for row in options.rows:
            name, _, times = row.partition("*")
            for _ in range(int(times or 1)):
                failed += not flown(vehicle, name)
    return failed


def flown(vehicle, name: str) -> bool:
    """Fly a row, again where this computer was too busy to fly it; whether it was flown at all."""
    for _ in range(TRIES):
        try:
            out = ROWS[name](vehicle)
        except Exception as error:
            if not isinstance(error, AssertionError):
                traceback.print_exc()
            out = {"error": str(error)}
            vehicle.bring_down()
        words = json.dumps(out)
        disturbed = next((word for word in DISTURBED if word in words), None)
        if name in ("attitude_lowered", "attitude_kept_low", "stopped") and "error" not in out:
            disturbed = None  # they are to end so
        more = {} if disturbed is None else {"disturbed": disturbed}
        print(json.dumps({"row": name, **out, **more}), flush=True)
        if "error" not in out and disturbed is None:
            return True
    return False


if __name__ == "__main__":
    sys.exit(main())
