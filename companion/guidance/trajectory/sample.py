"""Types, bounds and errors of trajectories. World NED, SI units, radians; plain floats."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple, Protocol

import numpy as np

Vector = tuple[float, float, float]
"""(north, east, down)."""


LONGEST_DURATION = 3600.0
"""Longest trajectory that is checked, s; the maneuver `circle` may last longer."""

LARGEST_COORDINATE = 10_000.0
"""Largest coordinate that a file may hold, m from the start."""

LARGEST_SPEED = 100.0
"""Largest speed or velocity component that a file may hold, m/s."""

SMALLEST_DISTANCE = 1e-3
"""Points closer together than this count as the same point, m."""


class TrajectoryError(ValueError):
    """A trajectory cannot be made or flown; the message is complete and meant for the user."""


class Sample(NamedTuple):
    """The wanted state of the vehicle at one instant, relative to the start of the trajectory.

    Attributes:
        position: position, m; (0, 0, 0) at the start.
        velocity: velocity, m/s.
        acceleration: acceleration, m/s².
        jerk: jerk, m/s³.
        heading: tilt-yaw heading, rad, not wrapped; from north, or from the vehicle's heading at
            the start if `Trajectory.holds_heading` is true.
        heading_rate: derivative of the heading, rad/s.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    jerk: Vector
    heading: float
    heading_rate: float


class Trajectory(Protocol):
    """A path over time, from rest to rest, that can be sampled at any time."""

    @property
    def name(self) -> str:
        """Name for messages."""

    @property
    def duration(self) -> float:
        """Duration, s."""

    @property
    def holds_heading(self) -> bool:
        """Whether the vehicle keeps its heading; the samples' `heading` is then 0."""

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the start; at rest before the start and after the end."""

    def check_times(self) -> Sequence[float]:
        """Times at which to check the trajectory against limits, s, ascending from 0 to its end.

        Raises:
            TrajectoryError: the trajectory is too long to be checked.
        """


@contextmanager
def reporting_numerical_errors() -> Iterator[None]:
    """Turn numerical errors in the block into an error for the user.

    The checks of files exclude the known causes; this context manager catches the others.

    Raises:
        TrajectoryError: an overflow, a division by zero, or equations without a solution.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise TrajectoryError(
            "it cannot be computed: its numbers are too large, too small or too far apart"
        ) from error
