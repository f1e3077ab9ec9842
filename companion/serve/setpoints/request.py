"""What a setpoint commands, and the error for one that is not understood."""

from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.guidance.reference import Vector


class RefusedSetpoint(ValueError):  # noqa: N818 - it is refused, and nothing failed
    """A setpoint that is not flown; the message tells its sender why."""


class AxisDemand(NamedTuple):
    """What is commanded along some axes: one of the three, or more of them together.

    A position may come with a velocity, and both with an acceleration; a velocity may come with an
    acceleration. What is missing is None.

    Attributes:
        position: m, in the autopilot's local frame.
        velocity: m/s.
        acceleration: m/s².
    """

    position: tuple[float, ...] | None
    velocity: tuple[float, ...] | None
    acceleration: tuple[float, ...] | None


class MotionRequest(NamedTuple):
    """A commanded motion, NED, SI units and radians.

    Attributes:
        horizontal: (north, east).
        vertical: (down,).
        yaw: rad from north; None: as it is, or as `yaw_rate` turns it.
        yaw_rate: rad/s; None: none is commanded.
    """

    horizontal: AxisDemand
    vertical: AxisDemand
    yaw: float | None
    yaw_rate: float | None


class AttitudeRequest(NamedTuple):
    """A commanded attitude.

    Attributes:
        q: body to world, unit, w first.
        yaw_rate: feed-forward, rad/s.
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
    """What is known of the vehicle when a setpoint comes; frames are relative to it.

    Attributes:
        position_ned: in the autopilot's local frame, m.
        yaw: of the body, rad from north.
        origin: of the local frame, or None while it is not known.
    """

    position_ned: Vector
    yaw: float
    origin: "Origin | None" = None


_LEAST_HEIGHT, _LEAST_CLIMB = 1.0, 0.1
"""A setpoint this far above the vehicle (m), or upwards this fast (m/s), asks for a take-off."""


def climbs(request: Request, situation: Situation) -> bool:
    """Whether a request leads a vehicle on the ground into the air; attitudes and rates do not."""
    if not isinstance(request, MotionRequest):
        return False
    position, velocity, _ = request.vertical
    if position is not None:
        return position[0] < situation.position_ned[2] - _LEAST_HEIGHT
    return velocity is not None and velocity[0] < -_LEAST_CLIMB


class Origin(NamedTuple):
    """Where the local frame begins, WGS84.

    Attributes:
        latitude, longitude: degrees.
        altitude: above mean sea level, m.
        home_altitude: the same of home, m.
    """

    latitude: float
    longitude: float
    altitude: float
    home_altitude: float
