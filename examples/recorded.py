"""The folder of a recorded flight, for the examples that read one.

It is the folder named on the command line, else the newest under `flights`. If there is none, the
mock vehicle flies now: body-rate doublets, from which a vehicle can be identified.
"""

import sys
from pathlib import Path

from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly


def flight_folder() -> Path:
    """Return the folder of a flight, with `flight.tlog` in it."""
    if len(sys.argv) > 1:
        return Path(sys.argv[1])
    if not list(Path("flights").glob("*/flight.tlog")):
        doublets = {"flight": {"maneuvers": ["identify"]}, "planner": {"name": "first-order"}}
        config = changed(load(shipped("mock-px4.yaml")), doublets, "doublets")
        fly(config, MockVehicle("px4"), Path("flights/doublets"))
    return max(Path("flights").glob("*/flight.tlog"), key=lambda log: log.stat().st_mtime).parent
