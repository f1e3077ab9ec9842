"""Figures of stated flights: `python -m tests.real.figures px4 corners400*3 circle5+eight5`.

One line of JSON a flight, at the end one table. Vehicles: px4, ardupilot (real ones, see
`build.py`), mock-px4, mock-ardupilot.
"""

import argparse
import json
import sys
import time
from contextlib import contextmanager
from math import inf
from pathlib import Path

import yaml

from tests.real import table
from tests.real.airframes import AIRFRAMES, Airframe
from tests.real.flights import ESTIMATORS, PARTS, VARIANTS
from tests.real.flown import Flying
from tests.real.incidents import INCIDENTS
from tests.real.mock_vehicle import MockInMemory
from tests.real.vehicle import merged, real_vehicle

VEHICLES = ("px4", "ardupilot", "mock-px4", "mock-ardupilot")


def main() -> int:
    """Fly what the command line asks for; 1 if a flight failed."""
    options = _options()
    rows = fly(
        options.vehicle,
        options.flights,
        options.out / f"{options.vehicle}-{time.strftime('%Y%m%d-%H%M%S')}",
        airframe=options.airframe,
        start=options.start,
        changes=_changed(options.set),
        fifo=options.fifo,
        base=[path.resolve() for path in options.include],
    )
    print(table.markdown(rows))
    return 0 if all("error" not in row for row in rows) else 1


def fly(
    name: str,
    flights: list[str],
    folder: Path,
    *,
    airframe: str = "stock",
    start: list[str] | None = None,
    changes: dict | None = None,
    base: list[Path] | None = None,
    fifo: bool = False,
    identified: Path | None = None,
    until: float = inf,
) -> list[dict]:
    """Fly on one vehicle without restarting it; rows are printed and kept in `folder`.

    Args:
        name: px4, ardupilot, mock-px4 or mock-ardupilot.
        flights: names, each with `*TIMES` behind it or not.
        folder: a new one.
        airframe: which of `AIRFRAMES`.
        start: more arguments of the autopilot's `start`.
        changes: of the configuration, in all flights.
        base: configurations above the one that ships.
        fifo: autopilot and program before other programs of this computer.
        identified: the file for flights `@identified` before the first `identify`.
        until: no flight begins later, s of `time.monotonic`.
    """
    folder = folder.resolve()
    folder.mkdir(parents=True)
    rows: list[dict] = []
    vehicle_flown = AIRFRAMES[airframe]
    told = ESTIMATORS[name.removeprefix("mock-")] if vehicle_flown.estimated else {}
    with simulation(name, folder, vehicle_flown, start or [], fifo) as vehicle:
        flying = Flying(vehicle, merged(told, changes or {}), base or [], identified)
        for asked in flights:
            flight, _, times = asked.partition("*")
            for _ in range(int(times or 1)):
                if time.monotonic() > until:
                    break
                for row in flying(flight, folder / f"{len(rows) + 1:02}-{flight}"):
                    rows.append({"vehicle": name, "airframe": airframe, **row})
                    print(json.dumps(rows[-1]), flush=True)
                    with (folder / "rows.jsonl").open("a") as file:
                        file.write(json.dumps(rows[-1]) + "\n")
    (folder / "table.md").write_text(table.markdown(rows))
    return rows


@contextmanager
def simulation(name: str, folder: Path, airframe: Airframe, start: list[str], fifo: bool):
    """A vehicle that flies: the mock vehicle in memory, or a real autopilot."""
    autopilot = name.removeprefix("mock-")
    if name != autopilot:
        yield MockInMemory(autopilot, airframe.mock)
        return
    arguments = [*airframe.arguments(autopilot, folder), *start]
    with real_vehicle(
        autopilot, *arguments, folder=folder / autopilot, relayed=False, fifo=fifo
    ) as vehicle:
        yield vehicle


def _options():
    known = [*PARTS, "identify", *INCIDENTS, "ten"]
    parser = argparse.ArgumentParser(prog="python -m tests.real.figures", description=__doc__)
    parser.add_argument("vehicle", choices=VEHICLES)
    parser.add_argument(
        "flights",
        nargs="+",
        help=f"NAME[+NAME][@VARIANT][:PLANNER][*TIMES]; names {', '.join(known)}; "
        f"variants {', '.join(VARIANTS)}",
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument(
        "--include", action="append", default=[], type=Path, metavar="FILE",
        help="a configuration above the one that ships, such as identify's vehicle.yaml",
    )  # fmt: skip
    parser.add_argument("--airframe", choices=list(AIRFRAMES), default="stock")
    parser.add_argument(
        "--fifo", action="store_true",
        help="program and autopilot before all others on this computer (SCHED_FIFO)",
    )  # fmt: skip
    parser.add_argument("--start", action="append", help="more arguments of `start`, one each")
    parser.add_argument("--out", type=Path, default=Path("flights") / "real")
    options = parser.parse_args()
    if options.airframe != "stock" and not AIRFRAMES[options.airframe].differs(options.vehicle):
        parser.error(f"the airframe {options.airframe} is not described for {options.vehicle}")
    return options


def _changed(settings: list[str]) -> dict:
    """`planner.gain_per_s=5` as a configuration."""
    out: dict = {}
    for setting in settings:
        name, _, value = setting.partition("=")
        part: object = yaml.safe_load(value)
        for key in reversed(name.split(".")):
            part = {key: part}
        out = merged(out, part)
    return out


if __name__ == "__main__":
    sys.exit(main())
