"""The origin of the autopilot's local frame, from its local and global positions."""

from math import cos, degrees, hypot, radians

from companion.guidance.fence import EARTH_RADIUS
from companion.guidance.reference import Vector
from companion.serve.setpoints.request import Origin

_SHARE = 0.05
"""Weight of a new pair of positions; each pair is off by some centimetres."""
_MOVED = 2.0
"""An origin this far from the estimate counts as newly set, m."""


class OriginEstimate:
    """Averages the origin over pairs of simultaneous positions.

    Attributes:
        origin: the estimate, or None before the first pair.
    """

    def __init__(self) -> None:
        self.origin: Origin | None = None

    def note(
        self,
        position_ned: Vector,
        latitude: float,
        longitude: float,
        altitude: float,
        height: float,
    ) -> None:
        """Take a pair of positions.

        Args:
            position_ned: position in the local frame, m.
            latitude: latitude of the same place, degrees.
            longitude: longitude of the same place, degrees.
            altitude: altitude above mean sea level, m.
            height: height above home, m.
        """
        north, east, down = position_ned
        seen = Origin(
            latitude - degrees(north / EARTH_RADIUS),
            longitude - degrees(east / (EARTH_RADIUS * cos(radians(latitude)))),
            altitude + down,
            altitude - height,
        )
        known = self.origin
        if known is None or _distance(known, seen) > _MOVED:
            self.origin = seen
            return
        self.origin = Origin(*(a + _SHARE * (b - a) for a, b in zip(known, seen, strict=True)))


def _distance(a: Origin, b: Origin) -> float:
    north = radians(a.latitude - b.latitude) * EARTH_RADIUS
    east = radians(a.longitude - b.longitude) * EARTH_RADIUS * cos(radians(a.latitude))
    return hypot(north, east, a.altitude - b.altitude)
