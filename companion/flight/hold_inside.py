"""Holds the vehicle where the autopilot's landing will not drift out of the fence."""

from companion.flight.context import FlightContext
from companion.guidance.braking import handover_drift
from companion.guidance.fence import Fence, LatLon
from companion.guidance.reference import NorthEast, Vector, minus
from companion.safety.table import fence_of

_MARGIN = 0.3
"""Smallest distance inside the fence at which the autopilot's drift must end, m: the estimates of
position and wind have errors."""


def brake_inside_fence(context: FlightContext) -> None:
    """End the maneuver, brake, and hold; hold further upwind if the landing would leave the fence.

    PX4 begins its own modes level, so a vehicle that leans against the wind drifts downwind first.
    """
    guidance = context.guidance_loop
    guidance.give_up()
    centre = context.snapshot_builder.fence_centre_without_resets()
    pose = guidance.flown_source.pose
    if not context.link.autopilot.modes_begin_level or centre is None or pose is None:
        return
    stopping_point = minus(pose.position_ned, centre.position_ned)
    wind = guidance.estimate.disturbance
    if only_upwind_is_inside(fence_of(context.config), centre.lat_lon, stopping_point, wind):
        guidance.move_upwind()


def only_upwind_is_inside(
    fence: Fence, origin: LatLon | None, stopping_point: Vector, wind: NorthEast
) -> bool:
    """Whether the landing would drift out of the fence, but not if it began further upwind.

    Args:
        fence: the fence; its ceiling and floor are not used.
        origin: place of the fence's centre; None: it is not known.
        stopping_point: where the vehicle stops, from the fence's centre, m NED.
        wind: acceleration that the wind gives a vehicle at rest, m/s², north and east.
    """
    walls = fence.walls
    (north, east, down), (drift_north, drift_east) = stopping_point, handover_drift(wind)
    downwind = (north + drift_north, east + drift_east, down)
    upwind = (north - drift_north, east - drift_east, down)
    return (
        walls.breach(downwind, None, origin, _MARGIN) is not None
        and walls.breach(upwind, None, origin) is None
    )
