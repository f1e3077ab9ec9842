"""Predicted motion of a maneuver, from its reference and its open-loop commands.

In open loop the acceleration follows from the commanded tilt at constant height. The delay of the
tilt is neglected, because a delay hardly changes the motion.
"""

from collections.abc import Iterator
from math import sqrt, tan
from typing import NamedTuple

from companion.drag import NO_DRAG, Drag
from companion.guidance.maneuvers import Maneuver
from companion.guidance.reference import GRAVITY, NorthEast, Pose, Reference, Vector, rotate

_LARGEST_TILT = 1.4
"""The predicted tilt is clamped to this, rad: no maneuver tilts further."""


class PredictedMotion(NamedTuple):
    """The predicted motion at one time of a maneuver, NED.

    Attributes:
        time: time since the maneuver began, s.
        offset: position from where the maneuver began, m.
        velocity: velocity, m/s.
        acceleration: acceleration, m/s². In open loop the horizontal part is the acceleration by
            tilt alone, without drag.
    """

    time: float
    offset: Vector
    velocity: Vector
    acceleration: Vector


def predict(
    maneuver: Maneuver, heading: float = 0.0, drag: Drag = NO_DRAG
) -> Iterator[PredictedMotion]:
    """The predicted motion at each of the maneuver's `check_times`, beginning at rest.

    `heading`: heading at the beginning, rad. `drag`: drag in still air.

    Raises:
        TrajectoryError: the maneuver is too long to be checked.
    """
    start = Pose((0.0, 0.0, 0.0), heading)
    last_time, open_loop = 0.0, _OpenLoop(heading, drag)
    for time in maneuver.check_times():
        reference = maneuver.at(time, start)
        midway = maneuver.at(0.5 * (last_time + time), start)
        motion = PredictedMotion(
            time, reference.position_ned, reference.velocity_ned, reference.acceleration_ned
        )
        yield motion if midway.closed_loop else open_loop.advance(motion, midway, time - last_time)
        if reference.closed_loop:
            open_loop = _OpenLoop(heading, drag)
        last_time = time


class _OpenLoop:
    """Integrates the horizontal motion by commanded tilt, from rest."""

    def __init__(self, heading: float, drag: Drag) -> None:
        self._heading, self._drag = heading, drag
        self._offset = self._velocity = (0.0, 0.0)
        self._roll = self._pitch = 0.0

    def advance(
        self, motion: PredictedMotion, reference: Reference, duration: float
    ) -> PredictedMotion:
        """Integrate the commands of `reference` over `duration` s.

        Returns:
            `motion`, with the integrated motion as its horizontal motion.
        """
        (north, east), (v_north, v_east) = self._offset, self._velocity
        tilt_acceleration = self._acceleration(reference, duration)
        drag = self._drag.deceleration((v_north, v_east, 0.0))
        a_north, a_east = tilt_acceleration[0] - drag[0], tilt_acceleration[1] - drag[1]
        self._offset = (
            north + duration * (v_north + 0.5 * duration * a_north),
            east + duration * (v_east + 0.5 * duration * a_east),
        )
        self._velocity = v_north + duration * a_north, v_east + duration * a_east
        return motion._replace(
            offset=(*self._offset, motion.offset[2]),
            velocity=(*self._velocity, motion.velocity[2]),
            acceleration=(*tilt_acceleration, motion.acceleration[2]),
        )

    def _acceleration(self, reference: Reference, duration: float) -> NorthEast:
        if reference.coefficients is not None:
            north, east = reference.coefficients
            lift = sqrt(max(1.0 - north * north - east * east, 0.01))
            return GRAVITY * north / lift, GRAVITY * east / lift
        if reference.body_rates is not None:
            self._roll += duration * reference.body_rates.roll
            self._pitch += duration * reference.body_rates.pitch
        forward = -GRAVITY * tan(min(max(self._pitch, -_LARGEST_TILT), _LARGEST_TILT))
        right = GRAVITY * tan(min(max(self._roll, -_LARGEST_TILT), _LARGEST_TILT))
        return rotate(forward, right, self._heading)
