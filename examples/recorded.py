"""The folder of a recorded flight, for the examples that read one.

It is the folder named on the command line, else the newest under `flights`, else one that is flown
now on the mock vehicle: body-rate doublets, from which `companion identify` also reads.
"""

import subprocess
import sys
from pathlib import Path

FLY = ("demo", "--lockstep", "--maneuvers", "identify", "--set", "planner.name=first-order")


def flight() -> Path:
    """The folder of a flight.

    Raises:
        CalledProcessError: none was recorded, and the flight of now failed.
    """
    if len(sys.argv) > 1:
        return Path(sys.argv[1])
    if not list(Path("flights").glob("*/flight.tlog")):
        subprocess.run([sys.executable, "-m", "companion", *FLY], check=True, stdout=sys.stderr)
    return max(Path("flights").glob("*/flight.tlog")).parent
