"""Maneuvers: the reference as a function of the time since the maneuver began."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from companion.attitude import Coefficients
from companion.guidance.reference import HorizontalMode, Pose, Reference, TiltCommand

_HOLD_PAUSE = 1.0
"""Pause of the position hold before open-loop steps, s. The hold's corrections would disturb the
attitude from which a step is measured."""
_CHECK_STEP = 0.01
"""Largest time between two checks of a maneuver, s."""


class Maneuver(Protocol):
    """A reference over time, relative to the pose at which the maneuver begins."""

    @property
    def name(self) -> str:
        """Name in the configuration and in messages."""

    @property
    def duration(self) -> float:
        """Duration, s."""

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the maneuver began at `start`."""

    def check_times(self) -> list[float]:
        """Times at which the maneuver is checked against limits and fence, s, ascending.

        Raises:
            TrajectoryError: the maneuver is too long to be checked.
        """


def check_times_between(begin: float, end: float) -> list[float]:
    """Times from `begin` to `end`, both included, at most `_CHECK_STEP` apart, s."""
    count = max(1, math.ceil((end - begin) / _CHECK_STEP))
    return [begin + (end - begin) * k / count for k in range(count + 1)]


@dataclass(frozen=True, slots=True)
class Steps:
    """Acceleration doublets +c, −c, +c (lasting T, 2T, T) along north, east and north-west.

    Before each doublet the position hold pauses, so that the attitude comes to rest. c is added to
    the coefficients of this attitude. With an ideal response and no drag the vehicle ends where it
    began, at rest. Position hold corrects the remaining error for `settle_time` seconds.

    Attributes:
        coefficient: length of the coefficients c: the sine of the tilt.
        step_time: T, the duration of the first part of a doublet, s.
        settle_time: time of position hold after each doublet, s.
    """

    coefficient: float
    step_time: float
    settle_time: float
    name: str = "steps"

    DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (math.sqrt(0.5), -math.sqrt(0.5)))

    @property
    def duration(self) -> float:
        """Three doublets, each with the pause before it and the settling after it, s."""
        return len(self.DIRECTIONS) * self._doublet_period

    @property
    def _doublet_period(self) -> float:
        return _HOLD_PAUSE + 4.0 * self.step_time + self.settle_time

    def check_times(self) -> list[float]:
        """Times 0.01 s apart over each doublet, s; pauses and settling are not checked."""
        times: list[float] = []
        for index in range(len(self.DIRECTIONS)):
            begin = index * self._doublet_period + _HOLD_PAUSE
            times += check_times_between(begin, begin + 4.0 * self.step_time)
        return times

    def at(self, time: float, start: Pose) -> Reference:
        """The reference: a pause, open-loop coefficients in the doublet, then position hold."""
        index = min(max(int(time / self._doublet_period), 0), len(self.DIRECTIONS) - 1)
        doublet_time = time - index * self._doublet_period - _HOLD_PAUSE
        hold = Reference(start.position_ned, heading=start.heading)
        if doublet_time < 0.0:
            return hold._replace(horizontal=HorizontalMode.ACCELERATION)
        if doublet_time >= 4.0 * self.step_time:
            return hold
        sign = -1.0 if self.step_time <= doublet_time < 3.0 * self.step_time else 1.0
        north, east = self.DIRECTIONS[index]
        c = sign * self.coefficient
        coefficients = Coefficients(c * north, c * east)
        return hold._replace(horizontal=TiltCommand(coefficients, trimmed=True))


@dataclass(frozen=True, slots=True)
class Corners:
    """Acceleration steps between the corners of a rectangle; no step passes through level.

    Such steps show the differences between the planners, as in figure 2 of Xu & Pei; a step through
    level is straight with every planner. Before the first step the position hold pauses, so that
    the attitude comes to rest. The corners are added to the coefficients of this attitude. The
    acceleration goes round the rectangle twice, the second time mirrored. With an ideal response
    and no drag the vehicle ends where it began, at rest. Position hold corrects the remaining error
    for `settle_time` seconds.

    Attributes:
        north, east: absolute values of the corners' coefficients; the sine of the tilt is
            √(north² + east²). 0.4 and 0.5 give the step in figure 2 of Xu & Pei.
        corner_time: duration of each corner, s; the corner at which the second round begins lasts
            twice as long.
        settle_time: time of position hold at the end, s.
    """

    north: float
    east: float
    corner_time: float
    settle_time: float
    name: str = "corners"

    _ONE_ROUND = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    CORNERS = (*_ONE_ROUND, *reversed(_ONE_ROUND))

    @property
    def duration(self) -> float:
        """The pause before the steps, all corners, and the settling, s."""
        return _HOLD_PAUSE + len(self.CORNERS) * self.corner_time + self.settle_time

    def check_times(self) -> list[float]:
        """Times 0.01 s apart over the corners, and the end, s."""
        end = _HOLD_PAUSE + len(self.CORNERS) * self.corner_time
        return [*check_times_between(_HOLD_PAUSE, end), self.duration]

    def at(self, time: float, start: Pose) -> Reference:
        """The reference: a pause, steps of the acceleration coefficients to each corner, a hold."""
        hold = Reference(start.position_ned, heading=start.heading)
        if time < _HOLD_PAUSE:
            return hold._replace(horizontal=HorizontalMode.ACCELERATION)
        index = int((time - _HOLD_PAUSE) / self.corner_time)
        if index >= len(self.CORNERS):
            return hold
        north, east = self.CORNERS[index]
        coefficients = Coefficients(self.north * north, self.east * east)
        return hold._replace(horizontal=TiltCommand(coefficients, trimmed=True))


@dataclass(frozen=True, slots=True)
class ManeuverSequence:
    """Maneuvers one after the other, all from the same starting pose.

    Attributes:
        parts: the maneuvers; empty: none is known before the flight, and nothing can be flown.
    """

    parts: Sequence[Maneuver]

    @property
    def name(self) -> str:
        """The names of the parts."""
        return ", ".join(maneuver.name for maneuver in self.parts)

    @property
    def duration(self) -> float:
        """Sum of the durations of the parts, s."""
        return sum(maneuver.duration for maneuver in self.parts)

    def maneuver_at(self, time: float) -> tuple[Maneuver, float]:
        """The maneuver that is flown at `time`, and the time since that maneuver began.

        Before the beginning it is the first maneuver; after the end it is the last one.

        Raises:
            ValueError: the sequence is empty.
        """
        if not self.parts:
            raise ValueError("the sequence has no maneuvers")
        for maneuver in self.parts[:-1]:
            duration = maneuver.duration
            if time < duration:
                return maneuver, time
            time -= duration
        return self.parts[-1], time

    def at(self, time: float, start: Pose) -> Reference:
        """The reference of the maneuver that is flown at `time`."""
        maneuver, maneuver_time = self.maneuver_at(time)
        return maneuver.at(maneuver_time, start)
