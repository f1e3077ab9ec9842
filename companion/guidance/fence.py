"""Where the vehicle may fly: about the place where control began, and above a floor."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, hypot, inf, radians
from typing import Any, NamedTuple

from companion.guidance.reference import Vector

Corner = tuple[float, float]
"""(north, east) in m, or (latitude, longitude) in degrees."""

Components = tuple[Any, Any, Any]
"""A `Vector`, or one whose components are arrays."""

EARTH_RADIUS = 6_371_000.0
"""Mean, m; over the size of a fence the earth is flat."""


class Place(NamedTuple):
    """WGS84, degrees."""

    latitude: float
    longitude: float


class Breach(NamedTuple):
    """What is wrong with a place.

    Attributes:
        limit: the key of the configuration that says so.
        side: on which side of the limit the place lies.
        where: the place, as the end of a sentence.
        by: how far it lies outside, m; negative inside.
    """

    limit: str
    side: str
    where: str
    by: float

    def __str__(self) -> str:
        polygon = self.limit.startswith("safety.")
        return self.where if polygon else f"{self.where}, {self.side} {self.limit}"


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

    def breach(
        self, offset: Vector, height: float | None, origin: Place | None, margin: float = 0.0
    ) -> Breach | None:
        """What is wrong with a place.

        Args:
            offset: from where control began, m NED.
            height: above home, m, or None where home is not known.
            origin: where control began, or None where that is not known.
            margin: the place must lie inside by this, m.
        """
        north, east, down = offset
        distance = hypot(north, east)
        if distance > self.radius - margin:
            where = f"{distance:.1f} m from where control began"
            return Breach("limits.fence_radius_m", "beyond", where, distance - self.radius)
        if self.places and origin is None:
            where = "at a place whose latitude and longitude are not known"
            return Breach("safety.fence_polygon_deg", "with", where, 0.0)
        corners = local_polygon(self.places, origin) if origin and self.places else self.polygon
        if corners:
            by = -distance_inside(north, east, corners) if margin else 0.0
            if by > -margin or not inside(north, east, corners):
                key = "safety.fence_polygon_deg" if self.places else "safety.fence_polygon_m"
                return Breach(key, "outside", "outside the polygon of the fence", by)
        if -down > self.ceiling - margin:
            where = f"{0.0 - down:.1f} m above where control began"
            return Breach("limits.fence_ceiling_m", "above", where, -down - self.ceiling)
        if height is not None and height < self.floor + margin:
            where = f"{height:.1f} m above home"
            return Breach("limits.fence_floor_m", "below", where, self.floor - height)
        return None

    def stop(self, offset: Components, velocity: Components) -> Components:
        """Where the vehicle comes to a stop, m: v·t + v²/(2a), horizontally and vertically.

        Args:
            offset: from where control began, m NED; numbers, or arrays of them.
            velocity: m/s NED.
        """
        north, east, down = velocity
        level = self._seconds((north * north + east * east) ** 0.5)
        return (
            offset[0] + level * north,
            offset[1] + level * east,
            offset[2] + self._seconds(abs(down)) * down,
        )

    def stop_breach(
        self,
        offset: Vector,
        velocity: Vector,
        height: float | None,
        origin: Place | None,
        margin: float = 0.0,
    ) -> Breach | None:
        """What is wrong with the place where the vehicle stops if it begins to brake now."""
        stop = self.stop(offset, velocity)
        sunk = stop[2] - offset[2]
        return self.breach(stop, None if height is None else height - sunk, origin, margin)

    def _seconds(self, speed: Any) -> Any:
        """For how long the vehicle would go on at this speed to come as far as it does, s."""
        return self.reaction + speed / (2.0 * self.deceleration)


def inside(north: float, east: float, polygon: Sequence[Corner]) -> bool:
    """Whether a place lies in a polygon: a ray northwards crosses its sides an odd number of times.

    Source: the even-odd rule.
    """
    odd = False
    for (n0, e0), (n1, e1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        if (e0 > east) is not (e1 > east) and north < n0 + (east - e0) / (e1 - e0) * (n1 - n0):
            odd = not odd
    return odd


def distance_inside(north: float, east: float, polygon: Sequence[Corner]) -> float:
    """From a place in a polygon to the nearest of its sides, m; negative outside."""
    nearest = inf
    for (n0, e0), (n1, e1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        along_north, along_east = n1 - n0, e1 - e0
        square = along_north * along_north + along_east * along_east
        across = (north - n0) * along_north + (east - e0) * along_east
        share = min(max(across / square, 0.0), 1.0) if square > 0.0 else 0.0
        gap = hypot(north - n0 - share * along_north, east - e0 - share * along_east)
        nearest = min(nearest, gap)
    return nearest if inside(north, east, polygon) else -nearest


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
