"""Braking of a moving vehicle to the place where it then holds."""

from math import hypot, sqrt
from typing import NamedTuple

from companion.guidance.reference import NorthEast, Reference, Vector, VehicleMotion

_MEAN_DECELERATION_FRACTION = 0.47
"""Mean deceleration of a smooth stop, as a share of the deceleration that the tilt limit allows in
the present wind. The peak is a share of 0.7; the other 0.3 are for gusts and feedback."""
_LARGEST_JERK = 8.0
"""Largest jerk of a smooth stop, m/s³: the vehicle tilts and levels by less than 50°/s."""
_REST_SPEED = 0.1
"""A vehicle slower than this counts as at rest, m/s."""
_UPWIND_PEAK_ACCELERATION = 1.5
"""Largest acceleration of the move upwind, m/s²; it leaves tilt for braking and for the wind."""
_DRIFT_PER_WIND_ACCELERATION = 0.47
"""Drift of a vehicle that leans against wind when PX4 takes over, m per m/s² of acceleration by
wind, s². PX4 in simulation drifted by 1.40 and 1.42 m at 3.0 m/s² and was farthest after 3 s. The
drift grows if MPC_XY_P, MPC_XY_VEL_P_ACC or MPC_XY_VEL_I_ACC is smaller."""
_PEAK_PER_MEAN = 1.5
"""Peak deceleration of a smooth stop (`Braking`), per mean deceleration."""
_LEAST_ACCELERATION = 0.3
"""Lower bound of the acceleration assumed for braking, m/s², so that the stopping distance stays
finite in wind that needs the whole tilt."""
_BREACH_DETECTION_TIME = 0.1
"""Time within which the fence's monitor and guidance notice a breach, s."""


class AssumedBraking(NamedTuple):
    """Braking assumed by the fence's monitor; the vehicle must not need a longer stopping distance.

    Attributes:
        reaction_time: delay before the vehicle brakes, s (`safety.reaction_s`).
        deceleration: constant deceleration after this delay, m/s² (`safety.braking_m_s2`), if the
            tilt allows it; see `mean_deceleration`.
    """

    reaction_time: float
    deceleration: float


def acceleration_beside_wind(largest: float, velocity: NorthEast, wind: NorthEast) -> float:
    """Largest deceleration that the tilt limit allows in wind, m/s²; at least 0.3 m/s².

    The tilt balances the wind's part across the motion first. Wind from ahead helps.

    Args:
        largest: largest horizontal acceleration by tilt, m/s².
        velocity: velocity north and east, m/s.
        wind: acceleration that the wind gives a vehicle at rest, m/s², north and east.
    """
    speed = hypot(*velocity)
    if speed == 0.0:
        return max(largest - hypot(*wind), _LEAST_ACCELERATION)
    wind_along = (wind[0] * velocity[0] + wind[1] * velocity[1]) / speed
    wind_across = (wind[0] * velocity[1] - wind[1] * velocity[0]) / speed
    remaining = sqrt(max(0.0, largest * largest - wind_across * wind_across))
    return max(remaining - wind_along, _LEAST_ACCELERATION)


def mean_deceleration(assumed_deceleration: float, acceleration: float) -> float:
    """Mean deceleration of the hardest stop, m/s².

    Args:
        assumed_deceleration: deceleration that is assumed if the tilt allows it, m/s².
        acceleration: largest acceleration against the motion, m/s².
    """
    return min(assumed_deceleration, acceleration / _PEAK_PER_MEAN)


def braking_time(speed: float, acceleration: float, assumed: AssumedBraking) -> float:
    """Time in which the vehicle brakes from a speed to rest, s; 0 for a vehicle at rest.

    The vehicle stops smoothly. If a smooth stop would need more distance than the fence's monitor
    assumes, the vehicle brakes harder.

    Args:
        speed: horizontal speed, m/s.
        acceleration: largest acceleration against the motion, m/s²; positive.
        assumed: what the monitor of the fence assumes.
    """
    if speed < _REST_SPEED:
        return 0.0
    reaction_time = max(0.0, assumed.reaction_time - _BREACH_DETECTION_TIME)
    longest_time = 2.0 * reaction_time + speed / mean_deceleration(
        assumed.deceleration, acceleration
    )
    smooth_time = max(
        speed / (_MEAN_DECELERATION_FRACTION * acceleration), sqrt(6.0 * speed / _LARGEST_JERK)
    )
    return min(smooth_time, longest_time)


class Braking(NamedTuple):
    """Brakes horizontally and stays where the vehicle stops, at the height where braking began.

    A hold of the present position would let a fast vehicle pass it and swing back. The speed falls
    by the share 3u² − 2u³, where u grows from 0 to 1 over the duration, so the deceleration begins
    and ends with 0.

    Attributes:
        begun_at: when the vehicle begins to brake, s of event-loop time.
        motion: motion of the vehicle at that time.
        heading: the heading to keep, rad.
        duration: duration of braking, s; see `braking_time`.
    """

    begun_at: float
    motion: VehicleMotion
    heading: float
    duration: float

    @property
    def end_time(self) -> float:
        """When the vehicle is at rest, s of event-loop time."""
        return self.begun_at + self.duration

    @property
    def stopping_point(self) -> Vector:
        """Place where the vehicle stops, m NED."""
        return self.at(self.end_time).position_ned

    def at(self, time: float) -> Reference:
        """The reference at `time`, s of event-loop time."""
        duration = self.duration
        if duration == 0.0:
            return Reference(self.motion.position_ned, heading=self.heading)
        u = min(max(0.0, (time - self.begun_at) / duration), 1.0)
        # Distance, speed and deceleration, for an initial speed of 1 m/s.
        distance = duration * u * (1.0 - u * u + 0.5 * u * u * u)
        speed = 1.0 - u * u * (3.0 - 2.0 * u)
        deceleration = 6.0 * u * (1.0 - u) / duration
        (north, east, down), (v_north, v_east, _) = self.motion
        return Reference(
            (north + distance * v_north, east + distance * v_east, down),
            (speed * v_north, speed * v_east, 0.0),
            (-deceleration * v_north, -deceleration * v_east, 0.0),
            self.heading,
        )


class BrakingUpwind(NamedTuple):
    """Brakes, and at the same time moves upwind; then stays at the end of both motions.

    The distance moved grows by the share 10u³ − 15u⁴ + 6u⁵, where u grows from 0 to 1 over the
    duration, so speed and acceleration begin and end with 0.

    Attributes:
        braking: the braking, as if there were no move.
        begun_at: when the move begins, s of event-loop time.
        displacement: where the move ends, from the stopping point of `braking`, m north and east.
        duration: duration of the move, s.
    """

    braking: Braking
    begun_at: float
    displacement: NorthEast
    duration: float

    @property
    def heading(self) -> float:
        """The heading to keep, rad."""
        return self.braking.heading

    @property
    def end_time(self) -> float:
        """When the vehicle is at rest, s of event-loop time."""
        return max(self.braking.end_time, self.begun_at + self.duration)

    @property
    def stopping_point(self) -> Vector:
        """Place where the vehicle stops, m NED."""
        return self.at(self.end_time).position_ned

    def at(self, time: float) -> Reference:
        """The reference at `time`, s of event-loop time."""
        reference, duration = self.braking.at(time), self.duration
        u = min(max(0.0, (time - self.begun_at) / duration), 1.0)
        distance = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
        speed = 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration
        acceleration = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration * duration)

        def add_scaled(vector: Vector, factor: float) -> Vector:
            north, east = self.displacement
            return (vector[0] + factor * north, vector[1] + factor * east, vector[2])

        return reference._replace(
            position_ned=add_scaled(reference.position_ned, distance),
            velocity_ned=add_scaled(reference.velocity_ned, speed),
            acceleration_ned=add_scaled(reference.acceleration_ned, acceleration),
        )


def handover_drift(wind: NorthEast) -> NorthEast:
    """How far the vehicle drifts downwind after the autopilot takes over, m north and east.

    The autopilot's modes begin level, without the tilt that balances the wind
    (`Autopilot.modes_begin_level`).

    Args:
        wind: acceleration that the wind gives a vehicle at rest, m/s², north and east.
    """
    return _DRIFT_PER_WIND_ACCELERATION * wind[0], _DRIFT_PER_WIND_ACCELERATION * wind[1]


def brake_upwind(now: float, braking: Braking, wind: NorthEast) -> BrakingUpwind | Braking:
    """Add a move upwind to `braking`; the move begins now and covers the `handover_drift`.

    Args:
        now: event-loop time, s.
        braking: the braking that is flown.
        wind: as in `handover_drift`.
    """
    north, east = handover_drift(wind)
    distance = hypot(north, east)
    if distance == 0.0:
        return braking
    # The largest acceleration of the move is 10/√3 times distance / duration².
    duration = sqrt(10.0 / sqrt(3.0) * distance / _UPWIND_PEAK_ACCELERATION)
    return BrakingUpwind(braking, now, (-north, -east), duration)


def brake(
    now: float, motion: VehicleMotion, heading: float, acceleration: float, assumed: AssumedBraking
) -> Braking:
    """The braking that begins now.

    Args:
        now: event-loop time, s.
        motion: motion of the vehicle.
        heading: the heading to keep, rad.
        acceleration: largest acceleration against the motion, m/s².
        assumed: what the monitor of the fence assumes.
    """
    speed = hypot(motion.velocity_ned[0], motion.velocity_ned[1])
    return Braking(now, motion, heading, braking_time(speed, acceleration, assumed))
