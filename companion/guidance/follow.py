"""Trajectories as maneuvers: flown from the pose where the maneuver begins."""

from dataclasses import dataclass
from math import inf, tau

from companion.guidance.reference import Pose, Reference
from companion.guidance.trajectory import Hover, Sample, Trajectory, steady_circle, turned_first


def hover(duration: float) -> "HeldHeadingManeuver":
    """Maneuver `hover`: stay for `duration` seconds."""
    return HeldHeadingManeuver(Hover(duration))


def circle(radius: float, speed: float, laps: float) -> "HeldHeadingManeuver":
    """Maneuver `circle`: a circle from rest at the vehicle's position; it ends at rest.

    Args:
        radius: radius of the circle, m.
        speed: steady speed after speeding up and before slowing down, m/s.
        laps: number of laps, including speeding up and slowing down. If it is not whole, the
            circle does not end where it began.
    """
    return HeldHeadingManeuver(steady_circle(radius, speed, laps, longest_duration=inf))


@dataclass(frozen=True, slots=True)
class HeldHeadingManeuver:
    """Flies a trajectory with constant heading, and never slows it down to keep limits.

    Linear guidance flies this maneuver, even with `guidance.kind: nmpc`.

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
        """The times at which to check the trajectory; see `Maneuver.check_times`."""
        return list(self.trajectory.check_times())

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the maneuver began at `start`."""
        return _reference_from(start, self.trajectory.at(time), start.heading)


@dataclass(slots=True)
class Follow:
    """Flies a trajectory.

    If the trajectory has a heading of its own, the vehicle first turns to it on the spot.

    Attributes:
        trajectory: the trajectory to follow.
        yaw_rate: largest yaw rate in the turn before the trajectory, rad/s.
        notes: sentences for the user: how the trajectory's file was read and how it is flown.
    """

    trajectory: Trajectory
    yaw_rate: float
    notes: tuple[str, ...] = ()
    _turned_trajectory: Trajectory | None = None
    _pose: Pose | None = None

    @property
    def name(self) -> str:
        """Name of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """Duration including the turn before the trajectory, s.

        Before the maneuver begins, the angle of the turn is unknown and counts as 360°.
        """
        if self._turned_trajectory is not None:
            return self._turned_trajectory.duration
        longest_turn_duration = 0.0 if self.trajectory.holds_heading else tau / self.yaw_rate
        return longest_turn_duration + self.trajectory.duration

    @property
    def turn_duration(self) -> float:
        """Duration of the turn before the trajectory, s; 0 until the start is known."""
        return (
            0.0
            if self._turned_trajectory is None
            else self._turned_trajectory.duration - self.trajectory.duration
        )

    def check_times(self) -> list[float]:
        """See `Maneuver.check_times`; the turn before the trajectory is not checked."""
        return list(self.trajectory.check_times())

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the maneuver (its turn first) began at `start`."""
        if self._turned_trajectory is None or start is not self._pose:
            self._pose = start
            self._turned_trajectory = turned_first(self.trajectory, start.heading, self.yaw_rate)
        heading = start.heading if self.trajectory.holds_heading else 0.0
        return _reference_from(start, self._turned_trajectory.at(time), heading)


def _reference_from(start: Pose, sample: Sample, heading: float) -> Reference:
    """Convert a sample, relative to the pose `start` and the heading `heading`, to a reference."""
    north, east, down = start.position_ned
    return Reference(
        (north + sample.position[0], east + sample.position[1], down + sample.position[2]),
        sample.velocity,
        sample.acceleration,
        heading + sample.heading,
        sample.heading_rate,
    )
