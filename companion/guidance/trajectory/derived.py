"""Trajectories made from others: flown more slowly, or preceded by a turn on the spot."""

from dataclasses import dataclass
from math import inf, remainder, tau
from typing import NamedTuple

import numpy as np

from companion.guidance.trajectory.sample import Sample, Trajectory, TrajectoryError
from companion.guidance.trajectory.slower_time import SlowerTime
from companion.guidance.trajectory.time_laws import Cruise, derivatives
from companion.guidance.trajectory.timed_curve import require_duration


@dataclass(frozen=True, slots=True)
class Slowed:
    """A trajectory flown more slowly, completely or in parts, along the same path.

    Attributes:
        trajectory: the original trajectory.
        law: the time of the original trajectory as a function of the time of the slowed one.
        original_times: times of the original trajectory at which to check the slowed one, s. Empty:
            the check times of `trajectory`, which are enough if it is slowed down evenly.
    """

    trajectory: Trajectory
    law: SlowerTime
    original_times: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """Name of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """Duration of the slowed trajectory, s."""
        return self.law.duration

    @property
    def holds_heading(self) -> bool:
        """Whether the trajectory keeps the initial heading."""
        return self.trajectory.holds_heading

    def check_times(self) -> list[float]:
        """Times at which to check the slowed trajectory, s; see `Trajectory.check_times`."""
        times, _ = self.law.stretched_times(
            np.array(self.original_times or self.trajectory.check_times())
        )
        require_duration(float(times[-1]))
        return [float(time) for time in times]

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the beginning."""
        progress = self.law.at(time)
        sample = self.trajectory.at(progress.phase)
        velocity, acceleration, jerk = derivatives(
            progress, sample.velocity, sample.acceleration, sample.jerk
        )
        heading_rate = sample.heading_rate * progress.first_derivative
        return Sample(sample.position, velocity, acceleration, jerk, sample.heading, heading_rate)


def evenly_slowed(trajectory: Trajectory, factor: float) -> Slowed:
    """The trajectory stretched in time by `factor`: 2.0 makes it last twice as long.

    Raises:
        TrajectoryError: the factor is not positive and finite.
    """
    if not 0.0 < factor < inf:
        raise TrajectoryError(f"a trajectory must be slowed by a positive factor, not {factor:g}")
    return Slowed(trajectory, SlowerTime(trajectory.duration, (factor,) * 4))


class SlowedPart(NamedTuple):
    """A part of a trajectory that is flown more slowly.

    Attributes:
        begin, end: times in the slowed trajectory, s.
        factor: the largest factor by which the speed is divided.
        time: time in the slowed trajectory at which `limit` requires the largest factor, s.
        limit: configuration key of the limit that requires this factor; empty: unknown.
    """

    begin: float
    end: float
    factor: float
    time: float
    limit: str


class SlowDown(NamedTuple):
    """Result of `slow_down`: a trajectory that keeps the limits.

    Attributes:
        trajectory: the trajectory that keeps the limits.
        parts: the parts that were slowed down, in order; empty if none was.
        is_even: whether the whole trajectory was slowed down by one factor.
        reason: why the whole trajectory was slowed down, as the end of a sentence.
    """

    trajectory: Trajectory
    parts: tuple[SlowedPart, ...] = ()
    is_even: bool = False
    reason: str = ""


_REST = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class TurnedFirst:
    """A trajectory that begins with a turn on the spot.

    Attributes:
        trajectory: the trajectory after the turn.
        begin: heading at the beginning of the turn, rad.
        sign: +1 to turn clockwise seen from above, −1 anticlockwise.
        turn: the time law of the angle turned.
    """

    trajectory: Trajectory
    begin: float
    sign: float
    turn: Cruise

    @property
    def name(self) -> str:
        """Name of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """Duration including the turn, s."""
        return self.turn.duration + self.trajectory.duration

    @property
    def holds_heading(self) -> bool:
        """False, because the vehicle turns to the heading of the trajectory."""
        return False

    def check_times(self) -> list[float]:
        """See `Trajectory.check_times`; the turn on the spot needs no check."""
        return [0.0, *(self.turn.duration + time for time in self.trajectory.check_times())]

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the turn began."""
        trajectory_time = time - self.turn.duration
        if trajectory_time >= 0.0:
            return self.trajectory.at(trajectory_time)
        angle, rate, _, _ = self.turn.at(time)
        heading = self.begin + self.sign * angle
        return Sample(_REST, _REST, _REST, _REST, heading, self.sign * rate)


def turned_first(trajectory: Trajectory, heading: float, yaw_rate: float) -> Trajectory:
    """The trajectory, preceded by a turn the short way from `heading` to its initial heading.

    Args:
        trajectory: returned unchanged if it holds its heading or already begins with `heading`.
        heading: heading of the vehicle at the start, rad.
        yaw_rate: largest yaw rate in the turn, rad/s.
    """
    if trajectory.holds_heading:
        return trajectory
    first_heading = trajectory.at(0.0).heading
    angle = remainder(first_heading - heading, tau)
    if angle == 0.0:
        return trajectory
    ramp = abs(angle) / yaw_rate
    turn = Cruise(abs(angle), yaw_rate, ramp, ramp)
    return TurnedFirst(trajectory, first_heading - angle, 1.0 if angle > 0.0 else -1.0, turn)
