"""The meaning of a setpoint, and the error for one that is not understood."""

from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.guidance.reference import Vector


class RefusedSetpoint(ValueError):  # noqa: N818 - it is refused, and nothing failed
    """A setpoint that is not flown; the message tells its sender why."""


class AxisDemand(NamedTuple):
    """A command along some axes: position, velocity, acceleration, or several of them.

    A position may come with a velocity, and both with an acceleration; a velocity may come with an
    acceleration. None: not commanded.

    Attributes:
        position: m, in the autopilot's local frame; rad for the heading.
        velocity: m/s or rad/s.
        acceleration: m/s² or rad/s².
    """

    position: tuple[float, ...] | None
    velocity: tuple[float, ...] | None
    acceleration: tuple[float, ...] | None


class MotionRequest(NamedTuple):
    """A commanded motion, NED, SI units and radians.

    Attributes:
        horizontal: (north, east).
        vertical: (down,).
        yaw: rad from north; None: the present yaw, which `yaw_rate` changes.
        yaw_rate: rad/s; None: not commanded.
    """

    horizontal: AxisDemand
    vertical: AxisDemand
    yaw: float | None
    yaw_rate: float | None


class AttitudeRequest(NamedTuple):
    """A commanded attitude.

    Attributes:
        q: unit quaternion, body to world, w first.
        yaw_rate: feedforward of the yaw rate, rad/s.
        thrust: normalised, 0..1.
    """

    q: Quaternion
    yaw_rate: float
    thrust: float


class RatesRequest(NamedTuple):
    """Commanded body rates.

    Attributes:
        rates: rad/s about body x, y, z (FRD).
        thrust: normalised, 0..1.
    """

    rates: BodyRates
    thrust: float


Request = MotionRequest | AttitudeRequest | RatesRequest


class Situation(NamedTuple):
    """State of the vehicle when a setpoint comes, for setpoints relative to it.

    Attributes:
        position_ned: position in the autopilot's local frame, m.
        yaw: yaw of the body, rad from north.
        origin: origin of the local frame; None: unknown.
    """

    position_ned: Vector
    yaw: float
    origin: "Origin | None" = None


_MIN_TAKEOFF_HEIGHT, _MIN_TAKEOFF_SPEED = 1.0, 0.1
"""Height above the vehicle (m) or upward speed (m/s) from which a setpoint requests a take-off."""


def climbs(request: Request, situation: Situation) -> bool:
    """Whether a request leads a vehicle on the ground into the air; attitudes and rates do not."""
    if not isinstance(request, MotionRequest):
        return False
    position, velocity, _ = request.vertical
    if position is not None:
        return position[0] < situation.position_ned[2] - _MIN_TAKEOFF_HEIGHT
    return velocity is not None and velocity[0] < -_MIN_TAKEOFF_SPEED


class Origin(NamedTuple):
    """Origin of the local frame, WGS84.

    Attributes:
        latitude, longitude: degrees.
        altitude: altitude above mean sea level, m.
        home_altitude: altitude of home above mean sea level, m.
    """

    latitude: float
    longitude: float
    altitude: float
    home_altitude: float
