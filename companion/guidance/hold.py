"""Simple guidance: a PD on position and velocity, with the reference's acceleration and drag."""

from dataclasses import dataclass
from math import sqrt

from companion.attitude import Target
from companion.guidance.reference import GRAVITY, Reference, VehicleMotion

_LARGEST_FALL = 0.5 * GRAVITY
_LARGEST_RISE = 0.5 * GRAVITY


@dataclass(frozen=True, slots=True)
class HoldGains:
    """Gains of the hold.

    Attributes:
        position: horizontal acceleration per m, 1/s².
        velocity: horizontal acceleration per m/s, 1/s.
        height: vertical speed per m, 1/s.
        climb: vertical acceleration per m/s, 1/s.
        drag: linear drag per mass, 1/s, fed forward on the reference's velocity.
        max_climb: m/s upwards.
        max_descent: m/s downwards.
        max_horizontal: largest horizontal acceleration asked for, m/s².
    """

    position: float
    velocity: float
    height: float
    climb: float
    drag: float
    max_climb: float
    max_descent: float
    max_horizontal: float


class PositionHold:
    """Turns a reference and the vehicle's motion into a target and the downward acceleration."""

    def __init__(self, gains: HoldGains) -> None:
        self._gains = gains

    def command(self, reference: Reference, motion: VehicleMotion) -> tuple[Target, float]:
        """One step.

        Returns:
            The planner's target, and the wanted acceleration downwards in m/s².
        """
        down = self._acceleration_down(reference, motion)
        if reference.coefficients is not None:
            north, east = reference.coefficients
        else:
            a_north, a_east = (self._horizontal(reference, motion, axis) for axis in (0, 1))
            length = sqrt(a_north * a_north + a_east * a_east)
            if length > self._gains.max_horizontal:
                a_north *= self._gains.max_horizontal / length
                a_east *= self._gains.max_horizontal / length
            # Thrust at the wanted tilt: its vertical part carries g − a_D, the rest is horizontal.
            vertical = GRAVITY - down
            thrust = sqrt(a_north * a_north + a_east * a_east + vertical * vertical)
            north, east = a_north / thrust, a_east / thrust
        return Target(north, east, reference.heading, reference.heading_rate), down

    def _horizontal(self, reference: Reference, motion: VehicleMotion, axis: int) -> float:
        gains = self._gains
        return (
            reference.acceleration_ned[axis]
            + gains.drag * reference.velocity_ned[axis]
            + gains.position * (reference.position_ned[axis] - motion.position_ned[axis])
            + gains.velocity * (reference.velocity_ned[axis] - motion.velocity_ned[axis])
        )

    def _acceleration_down(self, reference: Reference, motion: VehicleMotion) -> float:
        """Cascade, so that a large height error never asks for more than the climb limits."""
        gains = self._gains
        error = reference.position_ned[2] - motion.position_ned[2]
        speed = reference.velocity_ned[2] + gains.height * error
        speed = min(max(speed, -gains.max_climb), gains.max_descent)
        wanted = reference.acceleration_ned[2] + gains.climb * (speed - motion.velocity_ned[2])
        return min(max(wanted, -_LARGEST_RISE), _LARGEST_FALL)
