"""`make real`: fly the stated set on real autopilots and on the mock, and write one table.

The folder gets a folder of each vehicle, `rows.json` and `table.md`. What it holds already is kept,
so a campaign can be flown in parts.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from tests.real import table
from tests.real.build import REAL, builds
from tests.real.figures import fly

OTHERS = ("first-order", "quaternion", "so3", "exact", "euler")
"""The planners that model-following is compared with."""
STRAIGHT = ["corners400", "corners90", "steps"]
NEAR = ["hover", "circle2", "circle5+eight5", "circle8+eight8", "circle10"]
COMPARED = [f"{flight}:{planner}" for planner in OTHERS for flight in STRAIGHT[:2]]
IDENTIFIED = ["corners400@identified", "corners90@identified"]
SETS = {
    "straight": STRAIGHT,
    "near": NEAR,
    "nmpc": ["circle5@nmpc"],
    "wind": ["circle5@wind"],
    "identify": ["identify", *IDENTIFIED],
    "compared": COMPARED,
    "ends": ["kill", "takeover", "ten"],
}
"""What is flown, in this order; `ends` once, and not on the mock."""


def main() -> int:
    """Fly, and write the table; 1 if a flight failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.real.campaign", description=__doc__)
    parser.add_argument("--autopilot", choices=["px4", "ardupilot"], help="only this one")
    parser.add_argument("--out", type=Path, default=Path("flights") / "real")
    parser.add_argument("--times", type=int, default=1, help="of each flight; 3 for medians")
    parser.add_argument("--fifo", action="store_true", help="before other programs (SCHED_FIFO)")
    parser.add_argument("--sets", default=",".join(SETS), help=f"only these, of {','.join(SETS)}")
    parser.add_argument("--no-mock", action="store_true", help="no ratio to the mock's figures")
    options = parser.parse_args()
    unknown = set(options.sets.split(",")) - set(SETS)
    if unknown:
        parser.error(f"--sets: no {', '.join(sorted(unknown))}; there are {', '.join(SETS)}")
    try:
        found = builds()
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    flown = [name for name in found if options.autopilot in (None, name)]
    if not flown:
        print(f"REAL={REAL} has no {options.autopilot}", file=sys.stderr)
        return 2
    failed = False
    for autopilot in flown:
        failed |= _campaign(autopilot, options)
    rows = table.read([options.out])
    (options.out / "rows.json").write_text(json.dumps(rows, indent=1))
    text = table.markdown(rows)
    (options.out / "table.md").write_text(text)
    print(text)
    return int(failed)


def _campaign(autopilot: str, options) -> bool:
    """Whether a flight failed."""
    sets = [name for name in SETS if name in options.sets.split(",")]
    flights = [flight for name in sets if name != "ends" for flight in SETS[name]]
    # The wind of PX4's own simulator has no turbulence.
    if autopilot == "px4":
        flights = [flight for flight in flights if flight not in SETS["wind"]]
    repeated = [f"{flight}*{options.times}" for flight in flights]
    repeated += SETS["ends"] if "ends" in sets else []
    stamp = time.strftime("%Y%m%d-%H%M%S")
    rows = fly(
        autopilot,
        repeated,
        options.out / f"{autopilot}-{stamp}",
        changes={"realtime": {"scheduler": "fifo"}} if options.fifo else {},
        fifo=options.fifo,
    )
    if not options.no_mock:
        rows += fly(f"mock-{autopilot}", flights, options.out / f"mock-{autopilot}-{stamp}")
    return any("error" in row for row in rows)


if __name__ == "__main__":
    sys.exit(main())
