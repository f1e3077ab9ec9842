"""Converts between local NED and latitude, longitude, altitude, on a flat Earth at the origin."""

from math import cos, degrees, radians
from typing import NamedTuple

from sitl_mock.physics.quaternion import Vector

EARTH_RADIUS_M = 6371000.0


class Geodetic(NamedTuple):
    """A geodetic position: degrees, and m above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    def as_integers(self) -> tuple[int, int, int]:
        """Return latitude and longitude, 1e-7 degrees, and altitude, mm, as MAVLink sends them."""
        latitude, longitude, altitude = self
        return round(latitude * 1e7), round(longitude * 1e7), round(altitude * 1e3)


def to_geodetic(origin: Geodetic, position: Vector) -> Geodetic:
    """Return the geodetic position of a local NED position (m)."""
    north, east, down = position
    parallel_radius = EARTH_RADIUS_M * cos(radians(origin.latitude_deg))
    return Geodetic(
        origin.latitude_deg + degrees(north / EARTH_RADIUS_M),
        origin.longitude_deg + degrees(east / parallel_radius),
        origin.altitude_m - down,
    )


def to_local(origin: Geodetic, place: Geodetic) -> Vector:
    """Return the local NED position (m) of a geodetic position."""
    parallel_radius = EARTH_RADIUS_M * cos(radians(origin.latitude_deg))
    return (
        radians(place.latitude_deg - origin.latitude_deg) * EARTH_RADIUS_M,
        radians(place.longitude_deg - origin.longitude_deg) * parallel_radius,
        origin.altitude_m - place.altitude_m,
    )
