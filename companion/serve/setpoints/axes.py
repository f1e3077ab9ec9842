"""Follows a stream of commands directly, and a jump of the command by a motion within limits.

The commanded state is extrapolated between setpoints (`CommandedState`). When it jumps, the
difference between the present and the commanded state becomes an error, which a jerk-limited motion
reduces to zero (`Approach`). The state is the sum of the commanded state and this error.
"""

from collections.abc import Sequence
from math import hypot, inf
from typing import NamedTuple

from companion.attitude.rotation import clamp
from companion.guidance.reference import LARGEST_JERK, change_rate
from companion.serve.setpoints.approach import (
    Approach,
    AxisLimits,
    AxisMotion,
    AxisState,
    AxisValues,
    CommandedState,
    are_far_apart,
    plus,
)
from companion.serve.setpoints.request import AxisDemand

MAX_STREAM_PERIOD = 0.25
"""Setpoints at most this time apart, s, form a stream; its derivatives are estimated."""
_DERIVATIVE_WEIGHT = 0.5
"""Weight of a new derivative in the exponential average."""
_LARGEST_ACCELERATION = 15.0
"""Largest estimated acceleration, m/s²; faster changes of the velocity are jumps."""
_MAX_BRAKING_FACTOR = 2.0
"""Largest acceleration at the beginning of a motion, as a multiple of the acceleration limit."""
_MAX_LEAD_DISTANCE = 1.5
"""Largest distance between reference and vehicle if no position is commanded, m."""
_MAX_LEAD_SPEED = 2.0
"""Largest difference between the velocities of reference and vehicle if only accelerations are
commanded, m/s."""

_MIN_LIMIT_SHARE = 0.25
"""Every axis gets at least this share of its limits, whatever the direction of the motion."""


class JumpLimits(NamedTuple):
    """Largest jumps of a stream that are still followed directly."""

    position: float
    """Largest jump of the position, m or rad."""
    velocity: float
    """Largest jump of the velocity, m/s or rad/s."""


class CommandFollower:
    """Follows commands along one or more axes.

    Args:
        limits: limits of motions after a jump, one for each axis. A motion along several axes is
            limited along its direction.
        jump_limits: largest jumps that are followed directly.
        timeout: time for which a command repeated unchanged is extrapolated, s. After this time a
            commanded position stands still, and a commanded velocity stays constant.
    """

    def __init__(
        self, limits: Sequence[AxisLimits], jump_limits: JumpLimits, timeout: float
    ) -> None:
        self._limits, self._jump_limits, self._timeout = limits, jump_limits, timeout
        self._zero: AxisValues = (0.0,) * len(limits)
        self._newest_demand: AxisDemand | None = None
        self._commanded_at = 0.0
        self._approach: Approach | None = None
        self._commanded_state = CommandedState(self._zero, self._zero, self._zero, self._zero, 0.0)

    def begin(self, state: AxisState, now: float) -> None:
        """Start from a state, and come to rest unless a command comes first."""
        self._newest_demand, self._approach = None, None
        self._commanded_state = CommandedState(*state, self._zero, now)
        self.stop(now)

    def at(self, time: float) -> AxisState:
        """State at a time, s: the commanded state plus the remaining error."""
        commanded = self._commanded_state.at(time)
        if self._approach is None:
            return commanded
        error = self._approach.at(time)
        return AxisState(
            plus(commanded.position, error.position),
            plus(commanded.velocity, error.velocity),
            plus(commanded.acceleration, error.acceleration),
        )

    def stop(self, now: float, actual: AxisMotion | None = None) -> None:
        """Come to rest within limits, and stay there.

        If the state is too far from `actual`, the motion of the vehicle, the stop begins at
        `actual`.
        """
        if actual is not None:
            current = self.at(now)
            if are_far_apart(
                current.position, actual.position, _MAX_LEAD_DISTANCE
            ) or are_far_apart(current.velocity, actual.velocity, _MAX_LEAD_SPEED):
                self._newest_demand, self._approach = None, None
                self._commanded_state = CommandedState(*actual, self._zero, self._zero, now)
        self.command(AxisDemand(None, self._zero, None), now)

    def command(self, demand: AxisDemand, now: float, actual: AxisMotion | None = None) -> None:
        """Follow a new command at the time `now`, s.

        Without a commanded position, the state stays close to `actual`, the motion of the vehicle.

        Raises:
            UnplannableError: no motion fulfils the command; the previous command stays in force.
        """
        if demand == self._newest_demand:
            self._repeat(demand, now, actual)
            return
        current = self.at(now)
        if demand.position is not None:
            self._follow_position(demand, current, now)
        else:
            self._follow_motion(demand, _moved_near_vehicle(current, actual, demand), now)
        self._newest_demand, self._commanded_at = demand, now

    def _repeat(self, demand: AxisDemand, now: float, actual: AxisMotion | None) -> None:
        """Follow an unchanged command; extrapolate it for `timeout` only: its sender may hang."""
        if demand.position is None:
            self._repeat_motion(demand, now, actual)
            return
        is_moving = any(demand.velocity or ()) or any(demand.acceleration or ())
        if is_moving and now - self._commanded_at > self._timeout:
            self._follow_position(AxisDemand(demand.position, None, None), self.at(now), now)
            self._commanded_at = inf

    def _repeat_motion(self, demand: AxisDemand, now: float, actual: AxisMotion | None) -> None:
        """Follow a repeated velocity or acceleration.

        The reference stays within `_MAX_LEAD_DISTANCE` of the vehicle.
        """
        current = self.at(now)
        if demand.velocity is not None and now - self._commanded_at > self._timeout:
            demand = AxisDemand(None, demand.velocity, None)
        is_far_away = actual is not None and are_far_apart(
            current.position, actual.position, _MAX_LEAD_DISTANCE
        )
        still_accelerates = demand.acceleration is None and any(self._commanded_state.acceleration)
        if demand.velocity is None or is_far_away or still_accelerates:
            self._follow_motion(demand, _moved_near_vehicle(current, actual, demand), now)

    def _follow_position(self, demand: AxisDemand, current: AxisState, now: float) -> None:
        assert demand.position is not None
        velocity = demand.velocity or self._zero
        acceleration, jerk = self._derivatives(demand, now)
        target = CommandedState(demand.position, velocity, acceleration, jerk, now)
        error = target.error_of(current)
        if demand.velocity is not None and self._is_within_jump_limits(error):
            approach = None
        else:
            approach = self._plan(error, error.position, now, by_velocity=False)
        self._commanded_state, self._approach = target, approach

    def _follow_motion(self, demand: AxisDemand, current: AxisState, now: float) -> None:
        velocity = current.velocity if demand.velocity is None else demand.velocity
        acceleration = demand.acceleration or self._zero
        target = CommandedState(current.position, velocity, acceleration, self._zero, now)
        approach = None
        if demand.velocity is not None:
            error = target.error_of(current)
            approach = self._plan(error, error.velocity, now, by_velocity=True)
        self._commanded_state, self._approach = target, approach

    def _plan(
        self, error: AxisState, direction: AxisValues, now: float, *, by_velocity: bool
    ) -> Approach:
        """Plan a motion of `error` to zero; the limits hold along `direction`, not per axis."""
        length = hypot(*direction)
        limits = [
            each if length == 0.0 else _scaled(each, max(_MIN_LIMIT_SHARE, abs(component) / length))
            for each, component in zip(self._limits, direction, strict=True)
        ]
        acceleration = tuple(
            clamp(value, _MAX_BRAKING_FACTOR * each.acceleration)
            for value, each in zip(error.acceleration, self._limits, strict=True)
        )
        start = error._replace(acceleration=acceleration)
        return Approach(start, limits, now, by_velocity=by_velocity)

    def _derivatives(self, demand: AxisDemand, now: float) -> tuple[AxisValues, AxisValues]:
        """Acceleration and jerk of a demand.

        A derivative that is not commanded is estimated from the last two demands if they are a
        stream of positions and velocities; otherwise it is 0.
        """
        before, interval = self._newest_demand, now - self._commanded_at
        commanded = demand.acceleration
        if (
            before is None
            or before.position is None
            or before.velocity is None
            or demand.velocity is None
            or not 0.0 < interval <= MAX_STREAM_PERIOD
        ):
            return commanded or self._zero, self._zero
        if commanded is None:
            rate = change_rate(before.velocity, demand.velocity, interval, _LARGEST_ACCELERATION)
            if rate is None:
                return self._zero, self._zero
            return _blend(self._commanded_state.acceleration, rate), self._zero
        if before.acceleration is None:
            return commanded, self._zero
        jerk = change_rate(before.acceleration, commanded, interval, LARGEST_JERK)
        return commanded, self._zero if jerk is None else _blend(self._commanded_state.jerk, jerk)

    def _is_within_jump_limits(self, error: AxisState) -> bool:
        return (
            hypot(*error.position) <= self._jump_limits.position
            and hypot(*error.velocity) <= self._jump_limits.velocity
        )


def _scaled(limits: AxisLimits, share: float) -> AxisLimits:
    return AxisLimits(*(share * each for each in limits))


def _blend(old: AxisValues, new: AxisValues) -> AxisValues:
    return tuple(a + _DERIVATIVE_WEIGHT * (b - a) for a, b in zip(old, new, strict=True))


def _moved_near_vehicle(
    current: AxisState, actual: AxisMotion | None, demand: AxisDemand
) -> AxisState:
    """The state `current`; its position or velocity is that of `actual` if the two are far apart.

    `actual` is the motion of the vehicle. A commanded velocity is never replaced.
    """
    if actual is None:
        return current
    position, velocity, acceleration = current
    if are_far_apart(position, actual.position, _MAX_LEAD_DISTANCE):
        position = actual.position
    if demand.velocity is None and are_far_apart(velocity, actual.velocity, _MAX_LEAD_SPEED):
        velocity = actual.velocity
    return AxisState(position, velocity, acceleration)
