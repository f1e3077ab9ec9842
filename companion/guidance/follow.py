"""A trajectory as a maneuvers: from the pose where control holds, with the vehicle's own limits."""

from dataclasses import dataclass
from math import tau

from companion.guidance import Pose, Reference
from companion.guidance.trajectory import Trajectory, turned_first


@dataclass(slots=True)
class Follow:
    """Flies a trajectory from where it begins; first it turns to the trajectory's heading.

    Attributes:
        trajectory: what is followed.
        yaw_rate: largest in the turn before it, rad/s.
        slowed: by which factor it was slowed down to be feasible.
    """

    trajectory: Trajectory
    yaw_rate: float
    slowed: float = 1.0
    _turned: Trajectory | None = None
    _pose: Pose | None = None

    @property
    def name(self) -> str:
        """That of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """With the turn before it, the longest there could be until its beginning is known, s."""
        if self._turned is not None:
            return self._turned.duration
        longest = 0.0 if self.trajectory.holds_heading else tau / self.yaw_rate
        return longest + self.trajectory.duration

    @property
    def turns_for(self) -> float:
        """How long it turns before the trajectory begins, as far as that is known, s."""
        return 0.0 if self._turned is None else self._turned.duration - self.trajectory.duration

    def check_times(self) -> list[float]:
        """Those of the trajectory: the turn before it is on the spot."""
        return list(self.trajectory.check_times())

    def at(self, time: float, start: Pose) -> Reference:
        """The reference `time` seconds after the beginning at `start`."""
        if self._turned is None or start is not self._pose:
            self._pose = start
            self._turned = turned_first(self.trajectory, start.heading, self.yaw_rate)
        sample = self._turned.at(time)
        north, east, down = start.position_ned
        held = start.heading if self.trajectory.holds_heading else 0.0
        return Reference(
            (north + sample.position[0], east + sample.position[1], down + sample.position[2]),
            sample.velocity,
            sample.acceleration,
            held + sample.heading,
            sample.heading_rate,
        )
