"""The meaning of a setpoint, and the error for a setpoint that is not flown."""

from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.guidance.reference import Vector


class RefusedSetpoint(ValueError):  # noqa: N818 - it is refused, and nothing failed
    """A setpoint that is not flown; the message tells its sender why."""


class AxisDemand(NamedTuple):
    """A command along one or more axes: position, velocity, acceleration, or several of them.

    A position may come with a velocity, and both with an acceleration; a velocity may come with an
    acceleration. None: not commanded.
    """

    position: tuple[float, ...] | None
    """Commanded position in the autopilot's local frame, m, or heading, rad."""
    velocity: tuple[float, ...] | None
    """Commanded velocity, m/s, or yaw rate, rad/s."""
    acceleration: tuple[float, ...] | None
    """Commanded acceleration, m/s² or rad/s²."""


class MotionRequest(NamedTuple):
    """A commanded motion, NED, SI units and radians."""

    horizontal: AxisDemand
    """Demand along the axes (north, east)."""
    vertical: AxisDemand
    """Demand along the axis (down,)."""
    yaw: float | None
    """Commanded yaw, rad from north; None: not commanded."""
    yaw_rate: float | None
    """Commanded yaw rate, rad/s; None: not commanded."""


class AttitudeRequest(NamedTuple):
    """A commanded attitude."""

    q: Quaternion
    """Unit quaternion, body to world, w first."""
    yaw_rate: float
    """Feedforward of the yaw rate, rad/s."""
    thrust: float
    """Normalised thrust, 0..1."""


class RatesRequest(NamedTuple):
    """Commanded body rates."""

    rates: BodyRates
    """Body rates about x, y, z (FRD), rad/s."""
    thrust: float
    """Normalised thrust, 0..1."""


Request = MotionRequest | AttitudeRequest | RatesRequest


class VehiclePose(NamedTuple):
    """Pose of the vehicle when a setpoint arrives, for setpoints relative to the vehicle."""

    position_ned: Vector
    """Position in the autopilot's local frame, m."""
    yaw: float
    """Yaw of the body, rad from north."""
    origin: "Origin | None" = None
    """Origin of the local frame; None: unknown."""


_MIN_TAKEOFF_HEIGHT, _MIN_TAKEOFF_SPEED = 1.0, 0.1
"""Least commanded height above the vehicle (m) or upward speed (m/s) that requests a take-off."""


def requests_takeoff(request: Request, pose: VehiclePose) -> bool:
    """Whether a request makes a vehicle on the ground take off.

    Requests of an attitude or of body rates never begin a take-off.
    """
    if not isinstance(request, MotionRequest):
        return False
    position, velocity, _ = request.vertical
    if position is not None:
        return position[0] < pose.position_ned[2] - _MIN_TAKEOFF_HEIGHT
    return velocity is not None and velocity[0] < -_MIN_TAKEOFF_SPEED


class Origin(NamedTuple):
    """Origin of the local frame, WGS84: degrees, and m above mean sea level."""

    latitude: float
    longitude: float
    altitude: float
    home_altitude: float
    """Altitude of home above mean sea level, m."""
