"""Flights on a real autopilot in its simulation: `python -m tests.real px4 killed pilot*20`.

One line of JSON a flight. Needs the autopilots (see `vehicle.py`), so `make test` leaves it alone.
"""

import argparse
import json
import sys
import traceback

from tests.real.rows import ROWS
from tests.real.vehicle import REAL, real_vehicle

ARGUMENTS = {"px4": ["PX4_PARAM_COM_OBL_RC_ACT=4"], "ardupilot": []}


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
                try:
                    out = ROWS[name](vehicle)
                except Exception as error:
                    traceback.print_exc()
                    failed, out = failed + 1, {"error": repr(error)}
                    vehicle.bring_down()
                print(json.dumps({"row": name, **out}), flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
