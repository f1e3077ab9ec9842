"""Where the vehicle may fly: about the place where control began, and above a floor."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, hypot, radians
from typing import NamedTuple

from companion.guidance.reference import Vector

Corner = tuple[float, float]
"""(north, east) in m, or (latitude, longitude) in degrees."""

EARTH_RADIUS = 6_371_000.0
"""Mean, m; over the size of a fence the earth is flat."""


class Place(NamedTuple):
    """WGS84, degrees."""

    latitude: float
    longitude: float


@dataclass(frozen=True, slots=True)
class Fence:
    """A cylinder, within it perhaps a polygon, between a floor and a ceiling; m.

    Attributes:
        radius: about where control began.
        ceiling: above where control began.
        floor: above home.
        polygon: corners about where control began; none: the cylinder alone.
        places: the corners as (latitude, longitude) in degrees, instead.
        deceleration: that is certain, m/s².
        reaction: time until it begins, s.
    """

    radius: float
    ceiling: float
    floor: float
    polygon: tuple[Corner, ...]
    places: tuple[Corner, ...]
    deceleration: float
    reaction: float

    def breach(self, offset: Vector, height: float | None, origin: Place | None) -> str | None:
        """What is wrong with a place, as the end of a sentence.

        Args:
            offset: from where control began, m NED.
            height: above home, m, or None where home is not known.
            origin: where control began, or None where that is not known.
        """
        north, east, down = offset
        distance = hypot(north, east)
        if distance > self.radius:
            return f"{distance:.1f} m from where control began, beyond limits.fence_radius_m"
        if self.places and origin is None:
            return "at a place whose latitude and longitude are not known"
        corners = local_polygon(self.places, origin) if origin and self.places else self.polygon
        if corners and not inside(north, east, corners):
            return "outside the polygon of the fence"
        if -down > self.ceiling:
            return f"{-down:.1f} m above where control began, above limits.fence_ceiling_m"
        if height is not None and height < self.floor:
            return f"{height:.1f} m above home, below limits.fence_floor_m"
        return None

    def stop(self, velocity: float) -> float:
        """How far the vehicle goes on along one axis, m."""
        way = abs(velocity) * self.reaction + velocity * velocity / (2.0 * self.deceleration)
        return way if velocity >= 0.0 else -way


def inside(north: float, east: float, polygon: Sequence[Corner]) -> bool:
    """Whether a place lies in a polygon: a ray northwards crosses its sides an odd number of times.

    Source: the even-odd rule.
    """
    odd = False
    for (n0, e0), (n1, e1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        if (e0 > east) is not (e1 > east) and north < n0 + (east - e0) / (e1 - e0) * (n1 - n0):
            odd = not odd
    return odd


@lru_cache(maxsize=4)
def local_polygon(places: tuple[Corner, ...], origin: Place) -> tuple[Corner, ...]:
    """Corners given as (latitude, longitude) in degrees, in metres about `origin`."""
    narrower = cos(radians(origin.latitude))
    return tuple(
        (
            EARTH_RADIUS * radians(latitude - origin.latitude),
            EARTH_RADIUS * radians(longitude - origin.longitude) * narrower,
        )
        for latitude, longitude in places
    )
