"""What came of an event: its figures, for a row of docs/exits.md."""

import time

from tests.real.vehicle import Vehicle

WATCHED = 12.0
"""After an event the vehicle is watched for this long, s."""


def figures(vehicle: Vehicle, flight, event: float, seconds: float = WATCHED, **more):
    """What came of an event."""
    time.sleep(max(0.0, event + seconds - time.monotonic()))
    station = vehicle.station
    out = {
        "result": flight.result.get("result"),
        "exit": flight.process.poll(),
        "last_setpoint": flight.last_setpoint(event),
        "modes": station.modes_since(event),
        **station.motion_since(event, event + seconds),
        **more,
        "load": vehicle.load(),
    }
    vehicle.bring_down()
    out["left_in"] = station.mode
    return out
