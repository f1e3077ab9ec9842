"""The fence: where the vehicle may fly, about the place where offboard control began."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import cos, hypot, inf, pi, radians, remainder, sin
from typing import Any, NamedTuple

from companion.guidance.braking import acceleration_beside_wind, mean_deceleration
from companion.guidance.reference import NorthEast, Vector

Corner = tuple[float, float]
"""A corner of a polygon: (north, east) in m, or (latitude, longitude) in degrees."""

Components = tuple[Any, Any, Any]
"""A `Vector`, or a vector whose components are arrays."""

EARTH_RADIUS = 6_371_000.0
"""Mean radius of the earth, m; over the size of a fence the earth counts as flat."""


class LatLon(NamedTuple):
    """Latitude and longitude of a place (WGS84), degrees."""

    latitude: float
    longitude: float


class FenceCentre(NamedTuple):
    """Centre of the fence.

    Attributes:
        position_ned: position in the autopilot's local frame, m NED.
        lat_lon: latitude and longitude; None: unknown.
    """

    position_ned: Vector
    lat_lon: LatLon | None


class Breach(NamedTuple):
    """How a place breaches the fence.

    Attributes:
        limit: the configuration key of the limit that is breached.
        relation: words between `where` and `limit` in the message, such as "beyond".
        where: the place in words, such as "12.0 m above where control began".
        distance_outside: distance outside the fence, m; negative for a place inside the fence but
            within the margin; 0: not computed (polygon without a margin, unknown origin).
    """

    limit: str
    relation: str
    where: str
    distance_outside: float

    def __str__(self) -> str:
        return f"{self.where}, {self.relation} {self.limit}"


def height_in_words(height: float) -> str:
    """A height above home (m), which may be negative, in words."""
    return f"{abs(height):.1f} m {'below' if height < -0.05 else 'above'} home"


@dataclass(frozen=True, slots=True)
class Fence:
    """A cylinder between a floor and a ceiling, and an optional polygon; the vehicle stays in both.

    Attributes:
        radius: radius of the cylinder about the place where control began, m.
        ceiling: largest height above the place where control began, m.
        floor: smallest height above home, m.
        polygon: corners, m north and east of where control began; empty: only the cylinder.
        polygon_deg: corners as (latitude, longitude) in degrees, instead of `polygon`.
        deceleration: deceleration that the vehicle reaches if its tilt allows it, m/s².
        reaction_time: assumed delay before the vehicle brakes, s.
        estimate_delay: delay of the estimated horizontal motion behind the true one, s.
        tilt_acceleration: largest horizontal acceleration by tilt, m/s². A part of it balances the
            wind; the rest limits horizontal braking.
    """

    radius: float
    ceiling: float
    floor: float
    polygon: tuple[Corner, ...]
    polygon_deg: tuple[Corner, ...]
    deceleration: float
    reaction_time: float
    estimate_delay: float = 0.0
    tilt_acceleration: float = inf

    @property
    def walls(self) -> "Fence":
        """The fence without ceiling and floor."""
        return replace(self, ceiling=inf, floor=-inf)

    @property
    def levels(self) -> "Fence":
        """The fence with only ceiling and floor."""
        return replace(self, radius=inf, polygon=(), polygon_deg=())

    def breach(
        self, offset: Vector, height: float | None, origin: LatLon | None, margin: float = 0.0
    ) -> Breach | None:
        """The first limit of the fence that a place breaches; None: it breaches none.

        Args:
            offset: position of the place relative to where control began, m NED.
            height: height of the place above home, m; None: home is not known, and the floor is not
                checked.
            origin: the place where control began; None: it is not known. A fence with `polygon_deg`
                is then breached everywhere.
            margin: how far inside the fence the place must lie, m.
        """
        north, east, down = offset
        distance = hypot(north, east)
        if distance > self.radius - margin:
            where = f"{distance:.1f} m from where control began"
            return Breach("limits.fence_radius_m", "beyond", where, distance - self.radius)
        if self.polygon_deg and origin is None:
            where = "at a place whose latitude and longitude are not known"
            return Breach("safety.fence_polygon_deg", "but needed by", where, 0.0)
        polygon_deg = self.polygon_deg
        corners = local_polygon(polygon_deg, origin) if origin and polygon_deg else self.polygon
        if corners:
            distance_outside = -distance_inside(north, east, corners) if margin else 0.0
            if distance_outside > -margin or not inside(north, east, corners):
                key = "safety.fence_polygon_deg" if polygon_deg else "safety.fence_polygon_m"
                where = f"{north:.1f} m north and {east:.1f} m east of where control began"
                return Breach(key, "outside", where, distance_outside)
        if -down > self.ceiling - margin:
            where = f"{0.0 - down:.1f} m above where control began"
            return Breach("limits.fence_ceiling_m", "above", where, -down - self.ceiling)
        if height is not None and height < self.floor + margin:
            where = height_in_words(height)
            return Breach("limits.fence_floor_m", "below", where, self.floor - height)
        return None

    def stopping_point(
        self,
        offset: Components,
        velocity: Components,
        acceleration: tuple[Any, Any] = (0.0, 0.0),
        wind: NorthEast | None = None,
    ) -> Components:
        """Where the vehicle stops if it brakes now, m NED from where control began.

        From a horizontal or vertical velocity v, the vehicle stops after v·t + v²/(2b). b is
        `deceleration`, or horizontally less if tilt limit and wind allow only less. t is
        `reaction_time`, horizontally plus `estimate_delay`. A horizontal acceleration a that makes
        the vehicle faster is assumed to last for the time t; the vehicle then stops after
        v·t + a·t²/2 + (v + a·t)²/(2b). An acceleration that brakes is ignored, because it may end
        at any moment.

        Args:
            offset: position of the vehicle relative to where control began, m NED; numbers, or
                arrays of them.
            velocity: velocity, m/s NED; numbers, or arrays of them.
            acceleration: acceleration north and east, m/s²; numbers, or arrays of them.
            wind: acceleration that the wind gives a vehicle at rest, m/s², north and east. None: no
                wind; required if the other arguments are arrays.
        """
        north, east, down = velocity
        reaction_time = self.reaction_time + self.estimate_delay
        dv_north, dv_east = reaction_time * acceleration[0], reaction_time * acceleration[1]
        # The square of the speed after the reaction time, minus the square of the present speed.
        increase = dv_north * (2.0 * north + dv_north) + dv_east * (2.0 * east + dv_east)
        is_faster = (increase > 0.0) * 1.0
        dv_north, dv_east = is_faster * dv_north, is_faster * dv_east
        later_north, later_east = north + dv_north, east + dv_east
        later_speed = (later_north * later_north + later_east * later_east) ** 0.5
        available_acceleration = self.tilt_acceleration
        if wind is not None:
            available_acceleration = acceleration_beside_wind(
                available_acceleration, (later_north, later_east), wind
            )
        half_braking_time = (
            0.5 * later_speed / mean_deceleration(self.deceleration, available_acceleration)
        )
        return (
            offset[0] + reaction_time * (north + 0.5 * dv_north) + half_braking_time * later_north,
            offset[1] + reaction_time * (east + 0.5 * dv_east) + half_braking_time * later_east,
            offset[2] + (self.reaction_time + 0.5 * abs(down) / self.deceleration) * down,
        )

    def breach_at_stopping_point(
        self,
        offset: Vector,
        velocity: Vector,
        height: float | None,
        origin: LatLon | None,
        margin: float = 0.0,
        acceleration: NorthEast = (0.0, 0.0),
        wind: NorthEast | None = None,
    ) -> Breach | None:
        """The breach at the place where the vehicle would stop; None: it would stop inside.

        The arguments are those of `stopping_point` and `breach`; `height` is the present height.
        """
        stop = self.stopping_point(offset, velocity, acceleration, wind)
        descent = stop[2] - offset[2]
        return self.breach(stop, None if height is None else height - descent, origin, margin)


def inside(north: float, east: float, polygon: Sequence[Corner]) -> bool:
    """Whether a place lies in a polygon, by the even-odd rule.

    A ray northwards from a place inside crosses the sides an odd number of times.
    """
    is_inside = False
    for (n0, e0), (n1, e1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        if (e0 > east) is not (e1 > east) and north < n0 + (east - e0) / (e1 - e0) * (n1 - n0):
            is_inside = not is_inside
    return is_inside


def distance_inside(north: float, east: float, polygon: Sequence[Corner]) -> float:
    """Distance from a place to the nearest side of a polygon, m; negative outside."""
    nearest = inf
    for (n0, e0), (n1, e1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        along_north, along_east = n1 - n0, e1 - e0
        squared_length = along_north * along_north + along_east * along_east
        projection = (north - n0) * along_north + (east - e0) * along_east
        fraction = min(max(projection / squared_length, 0.0), 1.0) if squared_length > 0.0 else 0.0
        distance = hypot(north - n0 - fraction * along_north, east - e0 - fraction * along_east)
        nearest = min(nearest, distance)
    return nearest if inside(north, east, polygon) else -nearest


@lru_cache(maxsize=4)
def circle_corners(radius: float, count: int) -> tuple[Corner, ...]:
    """A circle of `radius` metres about the origin, as a polygon of `count` corners."""
    angles = [2.0 * pi * corner / count for corner in range(count)]
    return tuple((radius * cos(angle), radius * sin(angle)) for angle in angles)


def local_polygon(corners_deg: tuple[Corner, ...], origin: LatLon) -> tuple[Corner, ...]:
    """Convert corners from (latitude, longitude) in degrees to m north and east of `origin`."""
    return tuple(local_offset(LatLon(*corner), origin) for corner in corners_deg)


def local_offset(lat_lon: LatLon, origin: LatLon) -> Corner:
    """How far a place lies from `origin`, m north and east, the short way across ±180°."""
    return (
        EARTH_RADIUS * radians(lat_lon.latitude - origin.latitude),
        EARTH_RADIUS
        * radians(remainder(lat_lon.longitude - origin.longitude, 360.0))
        * cos(radians(origin.latitude)),
    )
