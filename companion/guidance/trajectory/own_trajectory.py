"""Trajectories of a user's class: checked before the flight, watched for exceptions in flight."""

from collections.abc import Sequence
from itertools import chain, pairwise
from math import inf, isfinite

import numpy as np

from companion.guidance.trajectory.sample import Sample, Trajectory, TrajectoryError, Vector
from companion.user_code import naming_user_code

_REQUIRED_MEMBERS = ("name", "duration", "holds_heading", "at", "check_times")
_ROLE = "trajectory"
_SMALLEST_OFFSET = 1e-3  # m
_SMALLEST_SPEED = 0.01  # m/s

_COMPARED_TIMES = 24
"""Number of times at which derivatives are compared."""
_GOLDEN_RATIO = 0.6180339887498949
"""Multiples of this modulo 1 are spread evenly, and miss the round times at which pieces join."""
_DIFFERENCE_STEP = 1e-3
"""Half the span of a difference quotient, s."""
_ABSOLUTE_TOLERANCE, _RELATIVE_TOLERANCE = 0.1, 0.02
"""A derivative d may be wrong by `_ABSOLUTE_TOLERANCE` (m/s, m/s²) + `_RELATIVE_TOLERANCE`·d."""


def require_trajectory(trajectory: Trajectory) -> None:
    """Check a trajectory of your own class: its members, rest at both ends, and its derivatives.

    Velocity and acceleration are compared with difference quotients at 24 times. Limits are checked
    by `violations`.

    Raises:
        TypeError: the class lacks a member of `Trajectory`, or `at` returns no `Sample`.
        TrajectoryError: the trajectory does not begin at rest at (0, 0, 0), does not end at rest,
            has a number that is not finite, a negative duration, check times that do not ascend
            from 0 to the duration, or a derivative that does not fit.
    """
    for member in _REQUIRED_MEMBERS:
        if not hasattr(trajectory, member):
            raise TypeError(
                f"{type(trajectory).__name__} is no trajectory: it has no `{member}`; see "
                "companion.guidance.trajectory.Trajectory"
            )
    duration = trajectory.duration
    if not 0.0 <= duration < inf:
        raise TrajectoryError(f"its duration must be a time of 0 s or more, not {duration} s")
    _require_rest(_sample(trajectory, 0.0), _sample(trajectory, duration))
    _require_times(trajectory.check_times(), duration)
    if duration > 4.0 * _DIFFERENCE_STEP:
        _require_derivatives(trajectory, "position", "velocity", "m/s")
        _require_derivatives(trajectory, "velocity", "acceleration", "m/s²")


def _sample(trajectory: Trajectory, time: float) -> Sample:
    """The sample at a time.

    Raises:
        TypeError: `at` returned no `Sample`.
        TrajectoryError: a number is not finite.
    """
    sample = trajectory.at(time)
    try:
        float_sample = _as_floats(sample)
    except (TypeError, ValueError):
        raise TypeError(f"at({time:g}) returned {sample!r}, which is no Sample") from None
    if not _is_finite(float_sample):
        raise TrajectoryError(f"at {time:.2f} s a number is not finite: {float_sample}")
    return float_sample


def _as_floats(sample: Sample) -> Sample:
    """The sample as plain floats.

    Raises:
        TypeError, ValueError: `sample` does not hold what a `Sample` holds.
    """
    sample = Sample(*sample)
    return Sample(
        _float_vector(sample.position),
        _float_vector(sample.velocity),
        _float_vector(sample.acceleration),
        _float_vector(sample.jerk),
        float(sample.heading),
        float(sample.heading_rate),
    )


def _float_vector(vector: Vector) -> Vector:
    north, east, down = vector
    return float(north), float(east), float(down)


def _is_finite(sample: Sample) -> bool:
    *vectors, heading, rate = sample
    return all(map(isfinite, (*chain.from_iterable(vectors), heading, rate)))


def _require_rest(begin: Sample, end: Sample) -> None:
    offset = float(np.linalg.norm(begin.position))
    if offset > _SMALLEST_OFFSET:
        raise TrajectoryError(
            f"it begins {offset:.2f} m from (0, 0, 0); positions are relative to the place of the "
            "vehicle at the start"
        )
    for sample, verb in ((begin, "begins"), (end, "ends")):
        speed = float(np.linalg.norm(sample.velocity))
        if speed > _SMALLEST_SPEED:
            raise TrajectoryError(f"it {verb} at {speed:.2f} m/s; it must begin and end at rest")


def _require_times(times: Sequence[float], duration: float) -> None:
    tolerance = 1e-6 * max(1.0, duration)
    is_ascending = all(a <= b for a, b in pairwise(times))
    if not (
        len(times) > 0
        and is_ascending
        and abs(times[0]) <= tolerance
        and abs(times[-1] - duration) <= tolerance
    ):
        raise TrajectoryError(
            f"its check_times() must ascend from 0 to its duration, {duration:g} s: limits and "
            "fence are checked at these times"
        )


def _require_derivatives(trajectory: Trajectory, quantity: str, derivative: str, unit: str) -> None:
    for k in range(_COMPARED_TIMES):
        time = max(trajectory.duration * (k * _GOLDEN_RATIO % 1.0), _DIFFERENCE_STEP)
        before, now, after = (
            _sample(trajectory, time + step) for step in (-_DIFFERENCE_STEP, 0.0, _DIFFERENCE_STEP)
        )
        change = np.subtract(getattr(after, quantity), getattr(before, quantity)) / (
            2.0 * _DIFFERENCE_STEP
        )
        reported = np.array([getattr(sample, derivative) for sample in (before, now, after)])
        size, reported_size = float(np.linalg.norm(change)), float(np.linalg.norm(reported[1]))
        # If the derivative jumps between the samples, the change lies between its values there.
        error = np.linalg.norm(change - np.clip(change, reported.min(axis=0), reported.max(axis=0)))
        if error > _ABSOLUTE_TOLERANCE + _RELATIVE_TOLERANCE * size:
            raise TrajectoryError(
                f"at {time:.2f} s its {quantity} changes by {size:.2f} {unit}, but its {derivative}"
                f" is {reported_size:.2f} {unit}: they must agree in size and direction"
            )


def checked_trajectory(trajectory: Trajectory) -> "UserTrajectory":
    """Check a user's trajectory and wrap it for flight; raises as `require_trajectory`."""
    require_trajectory(trajectory)
    return UserTrajectory(trajectory)


class UserTrajectory:
    """A trajectory of a user's program; an exception of its code becomes a `UserCodeError`.

    Args:
        trajectory: the user's trajectory, or one of ours that may wrap the user's.
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
        """Duration, s."""
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
            sample = _as_floats(self.trajectory.at(time))
            if not _is_finite(sample):
                raise ValueError(
                    f"at({time:g}) returned {sample}, with a number that is not finite"
                )
            return sample

    def check_times(self) -> Sequence[float]:
        """Times at which to check the trajectory, s; raises TrajectoryError if it is too long."""
        with naming_user_code(_ROLE, self.trajectory, TrajectoryError):
            return self.trajectory.check_times()
