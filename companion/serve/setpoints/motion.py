"""The reference that follows from a client's requests."""

from copy import copy
from math import inf
from typing import NamedTuple

from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import clamp
from companion.guidance.reference import Reference, Vector, VehicleMotion, clamp_length
from companion.serve.setpoints.approach import (
    AxisLimits,
    AxisMotion,
    AxisState,
    UnplannableError,
)
from companion.serve.setpoints.axes import MAX_STREAM_PERIOD, CommandFollower, JumpLimits
from companion.serve.setpoints.request import AxisDemand, MotionRequest

_HORIZONTAL_JUMP_LIMITS = JumpLimits(0.3, 0.6)
_VERTICAL_JUMP_LIMITS = JumpLimits(0.3, 0.4)
_HEADING_JUMP_LIMITS = JumpLimits(0.2, 1.0)
VERTICAL_ACCELERATION, _VERTICAL_JERK = 2.0, 6.0
"""Largest vertical acceleration, m/s², and jerk, m/s³: thrust used for climbing is not available
for tilt."""
_YAW_ACCELERATION, _YAW_JERK = 2.0, 10.0
"""Largest yaw acceleration, rad/s², and jerk, rad/s³, after a jump of the commanded yaw. Vehicles
respond slowly in yaw.
"""


class MotionLimits(NamedTuple):
    """Limits of motions after a jump of the setpoints; SI units and radians."""

    speed: float
    """Largest horizontal speed, m/s."""
    acceleration: float
    """Largest acceleration, m/s²; vertically at most `VERTICAL_ACCELERATION`."""
    jerk: float
    """Largest jerk, m/s³; vertically at most `_VERTICAL_JERK`."""
    climb: float
    descent: float
    yaw_rate: float
    timeout: float
    """Time for which a request repeated unchanged is extrapolated, s. After this time a commanded
    position stands still, and a commanded velocity stays constant."""
    commanded_speed: float = inf
    """Largest horizontal speed of a commanded velocity without a position, m/s."""


class CommandedMotion:
    """Turns requests into a reference that jumps by `JumpLimits` at most.

    Positions of requests and of the reference are in the same local frame.
    """

    def __init__(self, limits: MotionLimits) -> None:
        horizontal = AxisLimits(limits.speed, limits.speed, limits.acceleration, limits.jerk)
        vertical = AxisLimits(  # positive down
            limits.descent,
            limits.climb,
            min(limits.acceleration, VERTICAL_ACCELERATION),
            min(limits.jerk, _VERTICAL_JERK),
        )
        yaw_limits = AxisLimits(limits.yaw_rate, limits.yaw_rate, _YAW_ACCELERATION, _YAW_JERK)
        self._horizontal = CommandFollower(
            (horizontal, horizontal), _HORIZONTAL_JUMP_LIMITS, limits.timeout
        )
        self._vertical = CommandFollower((vertical,), _VERTICAL_JUMP_LIMITS, limits.timeout)
        self._heading = CommandFollower((yaw_limits,), _HEADING_JUMP_LIMITS, limits.timeout)
        self._commanded_speed = limits.commanded_speed
        self._climb, self._descent = limits.climb, limits.descent
        self._largest_yaw_rate = limits.yaw_rate
        self._newest_yaw: tuple[float, float, float] | None = None  # request, heading demand, time

    def begin(self, position_ned: Vector, velocity_ned: Vector, heading: float, now: float) -> None:
        """Begin at a position (m), velocity (m/s) and heading (rad), and come to rest."""
        (x, y, z), (u, v, w) = position_ned, velocity_ned
        self._horizontal.begin(AxisState((x, y), (u, v), (0.0, 0.0)), now)
        self._vertical.begin(AxisState((z,), (w,), (0.0,)), now)
        self._heading.begin(AxisState((heading,), (0.0,), (0.0,)), now)
        self._newest_yaw = None

    def command(self, request: MotionRequest, now: float, actual: VehicleMotion) -> None:
        """Follow a request; `actual` is the motion of the vehicle.

        Raises:
            UnplannableError: no motion fulfils the request; the previous request stays in force.
        """
        state_before = (
            copy(self._horizontal),
            copy(self._vertical),
            copy(self._heading),
            self._newest_yaw,
        )
        horizontal, vertical = _by_axes(actual)
        try:
            self._horizontal.command(self._within_speed_limit(request.horizontal), now, horizontal)
            (speed,), (reference_speed,) = vertical.velocity, self._vertical.at(now).velocity
            demand = self._within_vertical_limits(request.vertical, speed, reference_speed)
            self._vertical.command(demand, now, vertical)
            self._heading.command(self._heading_demand(request, now), now)
        except UnplannableError:
            self._horizontal, self._vertical, self._heading, self._newest_yaw = state_before
            raise

    def stop(self, now: float, actual: VehicleMotion) -> None:
        """Come to rest within limits, and stay there; `actual` is the motion of the vehicle."""
        horizontal, vertical = _by_axes(actual)
        self._horizontal.stop(now, horizontal)
        self._vertical.stop(now, vertical)
        self._heading.stop(now)

    def reference(self, time: float) -> Reference:
        """The reference at a time, s."""
        (x, y), (u, v), (a, b) = self._horizontal.at(time)
        (z,), (w,), (c,) = self._vertical.at(time)
        (heading,), (rate,), _ = self._heading.at(time)
        return Reference((x, y, z), (u, v, w), (a, b, c), heading, rate)

    def _within_speed_limit(self, horizontal: AxisDemand) -> AxisDemand:
        """Shorten a commanded velocity to its limit; its direction stays.

        A velocity with a position is not shortened: it would no longer match the position.
        """
        if horizontal.position is not None or horizontal.velocity is None:
            return horizontal
        north, east = horizontal.velocity
        return horizontal._replace(velocity=clamp_length(north, east, self._commanded_speed))

    def _within_vertical_limits(self, vertical: AxisDemand, *speeds: float) -> AxisDemand:
        """Limit a vertical demand that has no position.

        The velocity is limited to the climb and descent limits, and the acceleration to
        `VERTICAL_ACCELERATION`. An acceleration that would lead beyond a speed limit becomes a
        demand for this speed.

        Args:
            vertical: the vertical demand, positive down.
            speeds: vertical speeds of the vehicle and of the reference, m/s, positive down.
        """
        if vertical.position is not None:
            return vertical
        if vertical.velocity is not None:
            (speed,) = vertical.velocity
            vertical = vertical._replace(velocity=(min(max(speed, -self._climb), self._descent),))
        if vertical.acceleration is None:
            return vertical
        acceleration = clamp(vertical.acceleration[0], VERTICAL_ACCELERATION)
        limit = self._descent if acceleration > 0.0 else -self._climb
        # The speed changes further while the acceleration is reduced to zero.
        further_speed_change = 0.5 * acceleration * abs(acceleration) / _VERTICAL_JERK
        if acceleration and any(
            (v + further_speed_change - limit) * acceleration >= 0.0 for v in speeds
        ):
            return AxisDemand(None, vertical.velocity or (limit,), None)
        return vertical._replace(acceleration=(acceleration,))

    def _heading_demand(self, request: MotionRequest, now: float) -> AxisDemand:
        """The demand on the heading: a yaw (by the shorter turn), a yaw rate, or no rotation."""
        if request.yaw is None:
            self._newest_yaw = None
            return AxisDemand(None, (request.yaw_rate or 0.0,), None)
        newest_yaw, self._newest_yaw = self._newest_yaw, None
        rate = request.yaw_rate
        if newest_yaw is not None:
            yaw, heading, commanded_at = newest_yaw
            if request.yaw == yaw and rate is None:
                self._newest_yaw = newest_yaw
                return AxisDemand((heading,), None, None)
            heading += wrap_angle(request.yaw - yaw)
            mean_rate = wrap_angle(request.yaw - yaw) / max(now - commanded_at, 1e-3)
            if (
                rate is None
                and now - commanded_at <= MAX_STREAM_PERIOD
                and abs(mean_rate) <= self._largest_yaw_rate
            ):
                rate = mean_rate
        else:
            (heading,), _, _ = self._heading.at(now)
            heading += wrap_angle(request.yaw - heading)
        self._newest_yaw = request.yaw, heading, now
        return AxisDemand((heading,), None if rate is None else (rate,), None)


def _by_axes(motion: VehicleMotion) -> tuple[AxisMotion, AxisMotion]:
    """The horizontal and the vertical part of a motion."""
    (x, y, z), (u, v, w) = motion
    return AxisMotion((x, y), (u, v)), AxisMotion((z,), (w,))
