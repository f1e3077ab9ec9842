"""The words of the trajectory room. World NED, SI units, radians; plain floats."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple, Protocol

import numpy as np

Vector = tuple[float, float, float]
"""(north, east, down)."""


LONGEST = 3600.0
"""A trajectory lasts no longer than this, s."""

FARTHEST = 10_000.0
"""No place that a file names lies farther from the beginning along any axis, m."""

FASTEST = 100.0
"""No file asks for more along any axis, m/s."""

LEAST_WAY = 1e-3
"""Places nearer to each other than this are the same, m."""


class TrajectoryError(ValueError):
    """What was asked for cannot be flown or made; the message is complete and for the user."""


class Sample(NamedTuple):
    """Where the vehicle ought to be at one instant, relative to where the trajectory begins.

    Attributes:
        position: m; (0, 0, 0) is where it begins.
        velocity: m/s.
        acceleration: m/s².
        jerk: m/s³.
        heading: tilt-yaw heading, rad, not wrapped. It counts from north, but from the heading at
            the start for a trajectory that `holds_heading`.
        heading_rate: rad/s.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    jerk: Vector
    heading: float
    heading_rate: float


class Trajectory(Protocol):
    """What can be followed: it begins and ends at rest, and can be asked at any time."""

    @property
    def name(self) -> str:
        """What the user calls it."""
        ...

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        ...

    @property
    def holds_heading(self) -> bool:
        """Whether it keeps the heading it finds; `heading` of its samples is 0 then."""
        ...

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the beginning; at rest before it and past the end."""
        ...

    def check_times(self) -> Sequence[float]:
        """When to look at it to judge all of it, s: see `guidance.trajectory.check_times`.

        Raises:
            TrajectoryError: it is too long to be judged.
        """
        ...


@contextmanager
def computable() -> Iterator[None]:
    """Turn what overflows, or determines nothing, into an error for the user.

    The ranges of files exclude what is known to; this is for what nobody thought of.

    Raises:
        TrajectoryError: an overflow, a division by zero, equations without a solution.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise TrajectoryError(
            "its numbers cannot be computed with: they are too large, too small or too far apart"
        ) from error
