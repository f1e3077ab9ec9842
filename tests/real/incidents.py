"""What ends a flight otherwise than as planned, and how the next one begins."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

from tests.real.flight import Flight
from tests.real.flights import configuration, shipped
from tests.real.outcome import WATCHED
from tests.real.relay import SETPOINT, frames
from tests.real.vehicle import Vehicle

_BATTERY = {"px4": 75.0, "ardupilot": 96.0}
"""Below this limit a simulated battery comes within a minute, %."""
_LANDED_S = 120.0
_HANDED_OVER_M = 6.0
"""Height at which a pilot hands over, m."""
_RIVAL_THRUST = {"px4": 0.7, "ardupilot": 0.35}
"""About what a hover needs."""


def kill(vehicle: Vehicle, folder: Path) -> dict:
    """The program is killed in a hover; what the vehicle does until it stands."""
    flight = hovering(vehicle, folder)
    event = flight.send(signal.SIGKILL)
    flight.process.wait()
    return _watched(vehicle, event)


def takeover(vehicle: Vehicle, folder: Path) -> dict:
    """The pilot takes over by a change of mode; how long setpoints go on, and what follows."""
    flight = hovering(vehicle, folder)
    wall = time.time()
    event = vehicle.station.set_mode("LOITER")
    result = flight.finish()
    last = max(
        time for time, number in sent(Path(result["log"]) / "flight.tlog") if number == SETPOINT
    )
    return {"result": result["result"], "last_setpoint_s": round(last - wall, 3)} | _watched(
        vehicle, event
    )


def rival(vehicle: Vehicle, folder: Path) -> dict:
    """Another program sends setpoints, too, 100 times a second, until ours hands back."""
    flight = hovering(vehicle, folder)
    event = time.monotonic()
    while flight.process.poll() is None and time.monotonic() < event + WATCHED:
        vehicle.station.send_rates((0.2, 0.0, 0.0), _RIVAL_THRUST[vehicle.autopilot])
        time.sleep(0.01)
    return {"result": flight.finish()["result"]} | _watched(vehicle, event)


def handover(vehicle: Vehicle, folder: Path) -> dict:
    """A pilot flies up and lets the autopilot hold; the program takes over, and gives it back."""
    station = vehicle.station
    _fly_up(vehicle)
    changes = {"arm": False, "take_over": True, "takeoff_height_m": _HANDED_OVER_M - 1.0}
    flight = begun(vehicle, folder, {"flight": changes, "hover": {"duration_s": 5.0}})
    result = flight.finish()
    ended = time.monotonic()
    return {"result": result.get("result"), "began_after_s": flight.obeyed_at - flight.began} | (
        _watched(vehicle, ended) | {"held_in": station.mode, "armed": station.armed}
    )


def _fly_up(vehicle: Vehicle) -> None:
    """Arm and take off as a ground station does, and wait until the vehicle stands in the air."""
    station = vehicle.station
    if vehicle.autopilot == "px4":
        vehicle.parameter("MIS_TAKEOFF_ALT", _HANDED_OVER_M)
    deadline = time.monotonic() + 120.0
    while not station.armed:  # refused until the autopilot is ready
        assert time.monotonic() < deadline, "the autopilot does not arm"
        station.set_mode("LOITER" if vehicle.autopilot == "px4" else "GUIDED")
        time.sleep(0.5)
        station.command(400, 1.0)
        time.sleep(1.5)
    if vehicle.autopilot == "px4":
        station.set_mode("TAKEOFF")
        station.until(lambda: station.mode == "TAKEOFF", 5.0, "take-off")
        station.until(lambda: station.mode == "LOITER", 60.0, "hold after the take-off")
    else:
        station.command(22, 0, 0, 0, 0, 0, 0, _HANDED_OVER_M)
        station.until(lambda: station.up > _HANDED_OVER_M - 0.5, 60.0, "take-off")
    time.sleep(4.0)


def ladder(vehicle: Vehicle, folder: Path) -> dict:
    """The program lands the vehicle itself, for its battery is below the limit."""
    if vehicle.autopilot == "px4":
        vehicle.parameter("SIM_BAT_DRAIN", 60.0)
    try:
        limits = {"min_battery_percent": _BATTERY[vehicle.autopilot]}
        flight = begun(vehicle, folder, {"limits": limits, "hover": {"duration_s": 120.0}})
        result = flight.finish(_LANDED_S + 120.0)
    finally:
        if vehicle.autopilot == "px4":
            vehicle.parameter("SIM_BAT_DRAIN", 3600.0)
    return {"result": result.get("result")}


def calm(vehicle: Vehicle, folder: Path) -> dict:
    """A flight that ends as planned."""
    flight = begun(vehicle, folder, {"hover": {"duration_s": 3.0}})
    return {"result": flight.finish().get("result")}


INCIDENTS = {
    "kill": kill, "takeover": takeover, "ladder": ladder, "calm": calm, "rival": rival,
    "handover": handover,
}  # fmt: skip
TEN = (
    "kill", "takeover", "ladder", "kill", "takeover", "ladder", "calm", "takeover", "calm", "calm"
)  # fmt: skip
"""Two flights begin after a kill, three after a takeover, two after a landing by the ladder."""


def ten(vehicle: Vehicle, folder: Path) -> Iterator[dict]:
    """Ten flights without a restart of the autopilot; of each, how it began."""
    before = None
    for number, name in enumerate(TEN, 1):
        began = len(vehicle.flown)
        try:
            out = INCIDENTS[name](vehicle, folder / f"{number:02}-{name}")
        except AssertionError as error:
            out = {"error": str(error)}
        row = {"number": number, "after": before, "ends_by": name, **out}
        row |= began_by(vehicle.flown[began])
        vehicle.bring_down()
        yield row | {"left_in": vehicle.station.mode, "load": vehicle.load()}
        before = name


def began_by(flight: Flight) -> dict:
    """How long it took until it was obeyed, or what it said instead, and what it asked for."""
    if flight.obeyed_at is not None:
        return {"began_after_s": round(flight.obeyed_at - flight.began, 1)}
    if flight.process.poll() is None:
        flight.send(signal.SIGINT)
        flight.finish()
    return {"did_not_begin": flight.result.get("result") or flight.error()}


def begun(vehicle: Vehicle, folder: Path, changes: dict) -> Flight:
    """A flight with the configuration that ships, from when the autopilot obeys it."""
    folder.mkdir(parents=True, exist_ok=True)
    config = configuration("hover", [shipped(vehicle.autopilot)], folder, changes)
    flight = vehicle.launch(config, folder=folder / "flight")
    flight.until_obeyed()
    return flight


def hovering(vehicle: Vehicle, folder: Path) -> Flight:
    """The same, four seconds later."""
    flight = begun(vehicle, folder, {"hover": {"duration_s": 120.0}})
    time.sleep(4.0)
    assert vehicle.station.obeys, f"{vehicle.station.mode}: {flight.said()}"
    return flight


def _watched(vehicle: Vehicle, event: float) -> dict:
    """What followed; a vehicle that lands by itself is left to."""
    station = vehicle.station
    time.sleep(max(0.0, event + WATCHED - time.monotonic()))
    if station.mode in ("LAND", "RTL", "DESCEND"):
        deadline = time.monotonic() + _LANDED_S
        while station.armed and time.monotonic() < deadline:
            time.sleep(0.1)
    return {"modes": station.modes_since(event), **station.motion_since(event, event + WATCHED)}


def sent(log: Path):
    """(s since 1970, message id) of every record in a `.tlog`."""
    data = log.read_bytes()
    at = 0
    while at + 20 <= len(data):
        number, frame = next(frames(data[at + 8 : at + 8 + 300]), (None, b""))
        if number is None:
            return
        yield int.from_bytes(data[at : at + 8], "big") / 1e6, number
        at += 8 + len(frame)
