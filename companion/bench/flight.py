"""`companion bench flight`: how much faster than real time one core flies whole flights.

The program and the mock vehicle run in one process (`companion.testing`). The processor time of
both together is measured, so other programs on the computer have little effect. A first, short
flight, which imports modules, is not measured. The physics are compiled if numba is installed.
"""

from time import process_time
from typing import Any

from rich.console import Console
from rich.table import Table

from companion.batch import can_compile
from companion.bench.profile import sampling, shares
from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.extras import pip_command
from companion.testing import MockVehicle, fly

CONFIG_FILES = {"px4": "mock-px4.yaml", "ardupilot": "mock-ardupilot.yaml"}
"""File name of the shipped configuration for each autopilot of the mock vehicle."""
CLOCKS = {"lockstep": True, "free": False}
"""Whether the vehicle runs in lockstep, by name of the clock; a vehicle with the clock `free` does
not wait for setpoints."""

_MEASURED_FLIGHTS = 3  # of which the quickest counts
_WARM_UP_S = 0.2  # hover of the flight that is not measured
_LINK_DELAY_S = 0.0005


def run(seconds: float, as_json: bool, profile: bool = False) -> dict[str, Any]:
    """Fly a hover with each autopilot and each of `CLOCKS`.

    Args:
        seconds: duration of the hover, without take-off and landing, s.
        as_json: print nothing; the caller prints the result.
        profile: fly once more, and measure how much processor time each part of the code uses.

    Returns:
        Figures by autopilot and clock, of the quickest of three flights: `vehicle_s`, `cpu_s`,
        their ratio `times_real_time`, number of `setpoints`, and whether the physics are
        `compiled`; with `profile` also the `shares` of the processor time by part.

    Raises:
        ConfigError: a shipped configuration cannot be found.
        RuntimeError: a flight failed; the message says why.
    """
    figures: dict[str, Any] = {}
    for autopilot in CONFIG_FILES:
        figures[autopilot] = {
            name: _measure(autopilot, CLOCKS[name], seconds, profile) for name in CLOCKS
        }
    if not as_json:
        _print(figures)
    return figures


def _measure(autopilot: str, lockstep: bool, seconds: float, profile: bool) -> dict[str, Any]:
    _fly_once(autopilot, lockstep, _WARM_UP_S)
    best = min(
        (_fly_once(autopilot, lockstep, seconds) for _ in range(_MEASURED_FLIGHTS)),
        key=lambda flight: flight["cpu_s"],
    )
    if profile:
        with sampling() as counts:
            _fly_once(autopilot, lockstep, seconds)
        best["shares"] = shares(counts)
    return best


def _fly_once(autopilot: str, lockstep: bool, seconds: float) -> dict[str, Any]:
    """Fly one hover of `seconds` s; return its figures, as in `run`."""
    path = shipped(CONFIG_FILES[autopilot])
    config = _hover_config(load(path), seconds)
    compiled = can_compile()
    vehicle = MockVehicle(
        config=path, lockstep=lockstep, delay_s=_LINK_DELAY_S, compiled=compiled, prearm_delay_s=0.2
    )
    start_time = process_time()
    summary = fly(config, vehicle)
    cpu_s = process_time() - start_time
    if summary.result != "ok":
        raise RuntimeError(f"the flight of {autopilot} failed: {summary.result}")
    return {
        "vehicle_s": vehicle.time,
        "cpu_s": cpu_s,
        "times_real_time": vehicle.time / cpu_s,
        "setpoints": summary.counts.setpoints,
        "compiled": compiled,
    }


def _hover_config(config: Config, seconds: float) -> Config:
    flight = {"arm": True, "maneuvers": ("hover",), "takeoff_height_m": 2.0}
    return changed(config, {"flight": flight, "hover": {"duration_s": seconds}}, "bench flight")


def _print(figures: dict[str, Any]) -> None:
    table = Table("autopilot", "clock", "flight, s", "processor, s", "times real time")
    for autopilot, clocks in figures.items():
        for clock, flight in clocks.items():
            table.add_row(
                autopilot,
                clock,
                f"{flight['vehicle_s']:.1f}",
                f"{flight['cpu_s']:.2f}",
                f"{flight['times_real_time']:.1f}",
            )
    console = Console()
    console.print(table)
    if not can_compile():
        # As markup, rich would leave out the extra's brackets.
        console.print(f"Flights are quicker with numba: {pip_command('study')}", markup=False)
    _print_shares(figures, console)


def _print_shares(figures: dict[str, Any], console: Console) -> None:
    """Print the shares of the processor time, with a column for each autopilot and clock."""
    flights = {
        f"{autopilot}, {clock}": flight["shares"]
        for autopilot, clocks in figures.items()
        for clock, flight in clocks.items()
        if "shares" in flight
    }
    if not flights:
        return
    table = Table("share of the processor time", *flights)
    for part in next(iter(flights.values())):
        table.add_row(part, *(f"{shares.get(part, 0.0):.0%}" for shares in flights.values()))
    console.print(table)
