"""`companion bench flight`: how much faster than real time one core flies whole flights.

The program and the mock vehicle run in one process (`companion.testing`). The processor time of
both together is measured, so that other programs on the computer count little. A first, short
flight, which imports modules, is not measured.
"""

from time import process_time
from typing import Any

from rich.console import Console
from rich.table import Table

from companion.batch import can_compile
from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly

FILES = {"px4": "mock-px4.yaml", "ardupilot": "mock-ardupilot.yaml"}
"""The shipped configuration of each autopilot."""
CLOCKS = {"lockstep": True, "free": False}
"""Kinds of clock by name. True: lockstep. False: samples come without waiting, as over UDP."""

_FLIGHTS = 3
_WARM_UP_S = 0.2
_WIRE_S = 0.0005


def run(seconds: float, as_json: bool) -> dict[str, Any]:
    """Fly a hover with each autopilot, in lockstep and free.

    Args:
        seconds: duration of the hover, without take-off and landing, s.
        as_json: print nothing; the caller prints the result.

    Returns:
        By autopilot and clock, of the quickest of three flights: `vehicle_s`, `cpu_s`, their ratio
        `times_real_time`, and `setpoints`.

    Raises:
        ConfigError: a shipped configuration cannot be found.
        RuntimeError: a flight failed; the message says why.
    """
    figures: dict[str, Any] = {}
    for autopilot in FILES:
        figures[autopilot] = {
            name: _best_flight(autopilot, CLOCKS[name], seconds) for name in CLOCKS
        }
    if not as_json:
        _print(figures)
    return figures


def _best_flight(autopilot: str, lockstep: bool, seconds: float) -> dict[str, float]:
    _fly_once(autopilot, lockstep, _WARM_UP_S)
    return min(
        (_fly_once(autopilot, lockstep, seconds) for _ in range(_FLIGHTS)),
        key=lambda flight: flight["cpu_s"],
    )


def _fly_once(autopilot: str, lockstep: bool, seconds: float) -> dict[str, float]:
    """Figures of one flight."""
    path = shipped(FILES[autopilot])
    config = _hovering(load(path), seconds)
    vehicle = MockVehicle(
        config=path, lockstep=lockstep, delay_s=_WIRE_S, compiled=can_compile(), prearm_delay_s=0.2
    )
    began = process_time()
    summary = fly(config, vehicle)
    cpu = process_time() - began
    if summary.result != "ok":
        raise RuntimeError(f"the flight of {autopilot} failed: {summary.result}")
    return {
        "vehicle_s": vehicle.time,
        "cpu_s": cpu,
        "times_real_time": vehicle.time / cpu,
        "setpoints": summary.counts.setpoints,
    }


def _hovering(config: Config, seconds: float) -> Config:
    flight = {"arm": True, "maneuvers": ("hover",), "takeoff_height_m": 2.0}
    return changed(config, {"flight": flight, "hover": {"duration_s": seconds}}, "bench flight")


def _print(figures: dict[str, Any]) -> None:
    table = Table("autopilot", "clock", "flight, s", "processor, s", "times real time")
    for autopilot, clocks in figures.items():
        for clock, flown in clocks.items():
            table.add_row(
                autopilot,
                clock,
                f"{flown['vehicle_s']:.1f}",
                f"{flown['cpu_s']:.2f}",
                f"{flown['times_real_time']:.1f}",
            )
    Console().print(table)
