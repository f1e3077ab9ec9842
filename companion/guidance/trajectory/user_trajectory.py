"""A trajectory of a user's program as it is flown: an error in it is named as one of its code."""

from collections.abc import Sequence
from math import isfinite

from companion.guidance.trajectory.own_trajectory import require_trajectory
from companion.guidance.trajectory.sample import Sample, Trajectory, TrajectoryError, Vector
from companion.user_code import naming_user_code

_ROLE = "trajectory"


def checked_trajectory(trajectory: Trajectory) -> "UserTrajectory":
    """The trajectory as it is flown; raises as `require_trajectory`, and what its code raises."""
    require_trajectory(trajectory)
    return UserTrajectory(trajectory)


class UserTrajectory:
    """A trajectory of a user's program. What its code raises becomes a `UserCodeError`.

    Args:
        trajectory: the user's trajectory, or one of this program that may contain it.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory

    @property
    def name(self) -> str:
        """Name for messages."""
        with naming_user_code(_ROLE, self.trajectory):
            return str(self.trajectory.name)

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        with naming_user_code(_ROLE, self.trajectory):
            return float(self.trajectory.duration)

    @property
    def holds_heading(self) -> bool:
        """Whether the vehicle keeps its heading."""
        with naming_user_code(_ROLE, self.trajectory):
            return bool(self.trajectory.holds_heading)

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the start.

        Raises:
            UserCodeError: the trajectory raised, or returned something else than finite numbers.
        """
        with naming_user_code(_ROLE, self.trajectory):
            made = Sample(*self.trajectory.at(time))
            sample = Sample(
                _vector(made.position),
                _vector(made.velocity),
                _vector(made.acceleration),
                _vector(made.jerk),
                float(made.heading),
                float(made.heading_rate),
            )
            *vectors, heading, rate = sample
            if not all(map(isfinite, (*(x for each in vectors for x in each), heading, rate))):
                raise ValueError(f"at({time:g}) returned {made}, with a number that is not finite")
            return sample

    def check_times(self) -> Sequence[float]:
        """Times at which to check the trajectory, s; raises TrajectoryError if it is too long."""
        with naming_user_code(_ROLE, self.trajectory, TrajectoryError):
            return self.trajectory.check_times()


def _vector(values: Vector) -> Vector:
    north, east, down = values
    return float(north), float(east), float(down)
