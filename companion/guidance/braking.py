"""The way on which a moving vehicle comes to rest, where it is then held."""

from math import hypot, sqrt
from typing import NamedTuple

from companion.guidance.reference import Reference, Vector, VehicleMotion

_JERK = 8.0
"""Largest jerk of braking, m/s³: the vehicle tilts and levels by less than 50°/s."""

_AT_REST = 0.1
"""A slower vehicle is at rest, m/s."""


class Braking(NamedTuple):
    """Brakes smoothly and stays where the vehicle stops.

    A hold of the present position would let a fast vehicle pass it and swing back. The speed falls
    by 3u² − 2u³ with u from 0 to 1, so the deceleration begins and ends with 0.

    Attributes:
        begun_at: when the vehicle begins to brake, s.
        motion: its motion then.
        heading: the heading to keep, rad.
        deceleration: mean one, m/s²; the largest is 1.5 times this.
    """

    begun_at: float
    motion: VehicleMotion
    heading: float
    deceleration: float

    @property
    def duration(self) -> float:
        """Time of braking, s; 0 for a vehicle at rest."""
        speed = hypot(*self.motion.velocity_ned)
        if speed < _AT_REST:
            return 0.0
        return max(speed / self.deceleration, sqrt(6.0 * speed / _JERK))

    @property
    def ends(self) -> float:
        """When the vehicle is at rest, s."""
        return self.begun_at + self.duration

    @property
    def stop(self) -> Vector:
        """Where the vehicle stops, m NED."""
        return self.at(self.ends).position_ned

    def at(self, time: float) -> Reference:
        """The reference at a time, s."""
        duration = self.duration
        if duration == 0.0:
            return Reference(self.motion.position_ned, heading=self.heading)
        u = min(max(0.0, (time - self.begun_at) / duration), 1.0)
        way = duration * u * (1.0 - u * u + 0.5 * u * u * u)
        left = 1.0 - u * u * (3.0 - 2.0 * u)
        slowing = 6.0 * u * (1.0 - u) / duration
        (north, east, down), (v_north, v_east, v_down) = self.motion
        return Reference(
            (north + way * v_north, east + way * v_east, down + way * v_down),
            (left * v_north, left * v_east, left * v_down),
            (-slowing * v_north, -slowing * v_east, -slowing * v_down),
            self.heading,
        )
