"""Trajectories as maneuvers: flown from the pose where the maneuver begins."""

from dataclasses import dataclass
from math import inf, tau

from companion.guidance.reference import Pose, Reference
from companion.guidance.trajectory import Hover, Sample, Trajectory, steady_circle, turned_first


def hover(duration: float) -> "HeldFigure":
    """Maneuver `hover`: stay for `duration` seconds."""
    return HeldFigure(Hover(duration))


def circle(radius: float, speed: float, laps: float) -> "HeldFigure":
    """Maneuver `circle`: a circle from rest at the vehicle's position; it ends at rest.

    Args:
        radius: m.
        speed: speed between speeding up and slowing down, m/s.
        laps: number of laps, in which the vehicle also speeds up and slows down. If it is not
            whole, the circle does not end where it began.
    """
    return HeldFigure(steady_circle(radius, speed, laps, longest=inf))


@dataclass(frozen=True, slots=True)
class HeldFigure:
    """A trajectory that holds its heading and is flown as it is: it is never slowed down.

    Linear guidance always flies it, even if predictive guidance flies each `Follow`.

    Attributes:
        trajectory: a trajectory whose `holds_heading` is true.
    """

    trajectory: Trajectory

    @property
    def name(self) -> str:
        """Name of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """Duration of the trajectory, s."""
        return self.trajectory.duration

    def check_times(self) -> list[float]:
        """The times at which to check the trajectory, s.

        Raises:
            TrajectoryError: the trajectory is too long to be checked.
        """
        return list(self.trajectory.check_times())

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the maneuver began at `start`."""
        return _reference_from(start, self.trajectory.at(time), start.heading)


@dataclass(slots=True)
class Follow:
    """Flies a trajectory.

    Unless it holds the vehicle's heading, a turn on the spot to its initial heading comes first.

    Attributes:
        trajectory: the trajectory to follow.
        yaw_rate: largest yaw rate in the turn before the trajectory, rad/s.
        notes: how its file was read and how it is flown, one sentence each.
    """

    trajectory: Trajectory
    yaw_rate: float
    notes: tuple[str, ...] = ()
    _turned: Trajectory | None = None
    _pose: Pose | None = None

    @property
    def name(self) -> str:
        """Name of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """Duration with the turn before it, s; with the longest turn until the start is known."""
        if self._turned is not None:
            return self._turned.duration
        longest = 0.0 if self.trajectory.holds_heading else tau / self.yaw_rate
        return longest + self.trajectory.duration

    @property
    def turn_duration(self) -> float:
        """Duration of the turn before the trajectory, s; 0 while the start is unknown."""
        return 0.0 if self._turned is None else self._turned.duration - self.trajectory.duration

    def check_times(self) -> list[float]:
        """The times at which to check the trajectory, s; the turn on the spot is not checked.

        Raises:
            TrajectoryError: the trajectory is too long to be checked.
        """
        return list(self.trajectory.check_times())

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the maneuver, with its turn, began at `start`."""
        if self._turned is None or start is not self._pose:
            self._pose = start
            self._turned = turned_first(self.trajectory, start.heading, self.yaw_rate)
        held = start.heading if self.trajectory.holds_heading else 0.0
        return _reference_from(start, self._turned.at(time), held)


def _reference_from(start: Pose, sample: Sample, heading: float) -> Reference:
    """The reference of a sample, moved to `start` and with `heading` (rad) added to its heading."""
    north, east, down = start.position_ned
    return Reference(
        (north + sample.position[0], east + sample.position[1], down + sample.position[2]),
        sample.velocity,
        sample.acceleration,
        heading + sample.heading,
        sample.heading_rate,
    )
