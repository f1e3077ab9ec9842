"""`make real`: fly the stated set on real autopilots and on the mock vehicle, and write one table.

Both autopilots fly at the same time, each in a process of its own. The folder gets a folder of each
run, `rows.json` and `table.md`. A flight that the folder already holds is not flown again, so an
interrupted campaign goes on where it was, and one can be flown in parts.
"""

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from tests.real import table
from tests.real.build import REAL, builds
from tests.real.figures import fly

OTHERS = ("first-order", "quaternion", "so3", "exact", "euler")
"""The planners that model-following is compared with."""
STRAIGHT = ["corners400", "corners90"]
NEAR = ["circle5+eight5", "circle8+eight8", "circle2", "hover", "circle10"]
SETS = {
    "straight": STRAIGHT,
    "near": NEAR,
    "identify": ["identify", *(f"{flight}@identified" for flight in STRAIGHT)],
    "nmpc": ["circle5@nmpc"],
    "wind": ["circle5@wind"],
    "compared": [f"{flight}:{planner}" for flight in STRAIGHT for planner in OTHERS],
    "ends": ["ten"],
    "steps": ["steps"],
}
"""What is flown, in this order: the most important first."""
REPEATED = ("straight", "near", "nmpc")
"""Sets that `--times` repeats; the others are flown once."""
MOCK_SETS = ("straight", "near", "wind", "compared", "steps")
"""Sets that the mock vehicle flies, too."""
_TEN = 10


class Flown(NamedTuple):
    """What a folder already holds of one vehicle.

    Attributes:
        counts: how often each flight was flown to its end.
        identified: the file that the latest `identify` wrote, or None.
    """

    counts: Counter[str]
    identified: Path | None


def main() -> int:
    """Fly, and write the table; 1 if a flight failed."""
    options = _options()
    try:
        found = builds()
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    flown = [name for name in found if options.autopilot in (None, name)]
    if not flown:
        print(f"REAL={REAL} has no {options.autopilot}", file=sys.stderr)
        return 2
    # The mock vehicle first: beside the real ones it would load the computer.
    mocks = [] if options.no_mock else [f"mock-{name}" for name in flown]
    for vehicles in (mocks, flown):
        _fly_side_by_side(vehicles, options)
    rows = table.read([options.out])
    (options.out / "rows.json").write_text(json.dumps(rows, indent=1))
    text = table.markdown(rows)
    (options.out / "table.md").write_text(text)
    print(text)
    return int(any("error" in row for row in rows))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.real.campaign", description=__doc__)
    parser.add_argument("--autopilot", choices=["px4", "ardupilot"], help="only this one")
    parser.add_argument("--out", type=Path, default=Path("flights") / "real")
    parser.add_argument(
        "--times", type=int, default=1, help=f"of {', '.join(REPEATED)}; 3 for medians"
    )
    parser.add_argument("--minutes", type=float, default=600.0, help="begin no flight after these")
    parser.add_argument("--fifo", action="store_true", help="before other programs (SCHED_FIFO)")
    parser.add_argument("--sets", default=",".join(SETS), help=f"only these, of {','.join(SETS)}")
    parser.add_argument("--no-mock", action="store_true", help="no ratio to the mock's figures")
    options = parser.parse_args()
    unknown = set(options.sets.split(",")) - set(SETS)
    if unknown:
        parser.error(f"--sets: no {', '.join(sorted(unknown))}; there are {', '.join(SETS)}")
    options.until = time.monotonic() + 60.0 * options.minutes
    return options


def _fly_side_by_side(vehicles: list[str], options: argparse.Namespace) -> None:
    """Fly on these vehicles at the same time; if one fails to start, the others still fly."""
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_campaign, args=(name, options)) for name in vehicles]
    for process in processes:
        process.start()
    try:
        for process in processes:
            process.join()
    except KeyboardInterrupt:  # they got it, too, and stop their simulators
        for process in processes:
            process.join()
        raise


def _campaign(vehicle: str, options: argparse.Namespace) -> None:
    """Fly on one vehicle what its folder lacks."""
    sets = [name for name in SETS if name in options.sets.split(",")]
    held = already_flown(table.read([options.out]), vehicle)
    flights = missing(planned(vehicle, sets, options.times), held.counts)
    if not flights:
        return
    fly(
        vehicle,
        flights,
        options.out / f"{vehicle}-{time.strftime('%Y%m%d-%H%M%S')}",
        fifo=options.fifo,
        identified=held.identified,
        until=options.until,
    )


def planned(vehicle: str, sets: list[str], times: int) -> list[str]:
    """The flights of one vehicle in their order: each repeated one once before any comes again."""
    real = not vehicle.startswith("mock-")
    # The wind of PX4's own simulator has no turbulence.
    no_wind = vehicle.endswith("px4")
    flown = [
        name for name in sets if (real or name in MOCK_SETS) and not (name == "wind" and no_wind)
    ]
    repeated = [flight for name in flown if name in REPEATED for flight in SETS[name]]
    once = [flight for name in flown if name not in REPEATED for flight in SETS[name]]
    return repeated * times + once


def missing(flights: list[str], counts: Counter[str]) -> list[str]:
    """The flights without as many as were already flown, first ones first."""
    left = Counter(counts)
    out = []
    for flight in flights:
        if left[flight] > 0:
            left[flight] -= 1
        else:
            out.append(flight)
    return out


def already_flown(rows: list[dict], vehicle: str) -> Flown:
    """What these rows hold of a vehicle with the stock airframe."""
    own = [row for row in rows if row["vehicle"] == vehicle and row["airframe"] == "stock"]
    good = [row for row in own if "error" not in row]
    counts = Counter(row["flight"] for row in good)
    counts["ten"] //= _TEN
    files = [Path(row["file"]) for row in good if row["flight"] == "identify"]
    kept = [path for path in files if path.exists()]
    return Flown(counts, kept[-1] if kept else None)


if __name__ == "__main__":
    sys.exit(main())
