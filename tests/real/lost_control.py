"""Flights that the link or the autopilot's own geofence ends, not the program."""

import time

from tests.real.outcome import figures
from tests.real.vehicle import Vehicle

_CIRCLE = {"radius_m": 5.0, "speed_m_s": 2.0, "laps": 3.0}
_GEOFENCES = {
    "px4": ({"GF_MAX_HOR_DIST": 4.0, "GF_ACTION": 3}, {"GF_MAX_HOR_DIST": 0.0, "GF_ACTION": 2}),
    "ardupilot": (
        {"FENCE_TYPE": 2, "FENCE_RADIUS": 4.0, "FENCE_MARGIN": 1.0, "FENCE_ENABLE": 1},
        {"FENCE_ENABLE": 0},
    ),
}
"""Parameters of a circle of 4 m, and without it."""
_SILENT_S = 5.0


def own_fence(vehicle: Vehicle) -> dict:
    """A circle leads out of the geofence of the autopilot, which returns."""
    on, off = _GEOFENCES[vehicle.autopilot]
    for name, value in on.items():
        vehicle.parameter(name, value)
    try:
        flight = vehicle.hovering(3.0, flight={"maneuvers": ["circle"]}, circle=_CIRCLE)
        station = vehicle.station
        event = station.until(lambda: not station.obeys, 60.0, "end of our control")
        flight.finish()
    finally:
        for name, value in off.items():
            vehicle.parameter(name, value)
    return figures(vehicle, flight, event - 1.0)


def lost_in_takeoff(vehicle: Vehicle) -> dict:
    """The link is silent in the climb for longer than the program waits, then comes back."""
    flight, station = vehicle.fly(), vehicle.station
    climbed = lambda: station.seen and station.seen[-1].up - station.seen[0].up > 1.5  # noqa: E731
    station.until(lambda: station.armed and climbed(), 120.0, "climb")
    vehicle.relay.plug(up=False, down=False)
    event = time.monotonic()
    time.sleep(_SILENT_S)
    vehicle.relay.plug(up=True, down=True)
    flight.finish()
    return figures(vehicle, flight, event, 30.0, events=flight.result.get("events", [])[-5:])
