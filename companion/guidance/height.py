"""Height hold: a cascade, so that no height error asks for more than the climb limits."""

from dataclasses import dataclass

from companion.guidance.reference import GRAVITY, Reference, VehicleMotion

_LARGEST_FALL = 0.5 * GRAVITY
_LARGEST_RISE = 0.5 * GRAVITY


@dataclass(frozen=True, slots=True)
class HeightGains:
    """Gains and limits of the cascade.

    Attributes:
        height: vertical speed per m, 1/s.
        climb: vertical acceleration per m/s, 1/s.
        max_climb: m/s upwards.
        max_descent: m/s downwards.
    """

    height: float
    climb: float
    max_climb: float
    max_descent: float


def acceleration_down(gains: HeightGains, reference: Reference, motion: VehicleMotion) -> float:
    """The wanted acceleration downwards, m/s²."""
    error = reference.position_ned[2] - motion.position_ned[2]
    speed = reference.velocity_ned[2] + gains.height * error
    speed = min(max(speed, -gains.max_climb), gains.max_descent)
    wanted = reference.acceleration_ned[2] + gains.climb * (speed - motion.velocity_ned[2])
    return min(max(wanted, -_LARGEST_RISE), _LARGEST_FALL)
