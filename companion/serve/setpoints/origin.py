"""Where the autopilot's local frame begins on the globe, from its local and global positions."""

from math import cos, degrees, hypot, radians

from companion.guidance.fence import EARTH_RADIUS
from companion.guidance.reference import Vector
from companion.serve.setpoints.request import Origin

_SHARE = 0.05
"""Share of a new pair of positions: each is off by some centimetres."""
_MOVED = 2.0
"""An origin that seems to be this far from the estimate has been set anew, m."""


class OriginEstimate:
    """Averages the origin over pairs of positions of the same instant.

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
        """Take a pair.

        Args:
            position_ned: in the local frame, m.
            latitude: of the same place, degrees.
            longitude: of it, degrees.
            altitude: above mean sea level, m.
            height: above home, m.
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
