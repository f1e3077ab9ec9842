"""What can be followed: curves in space with a time law, sampled up to the jerk."""

from companion.trajectory.computable import computable
from companion.trajectory.csv_file import Table
from companion.trajectory.csv_file import read as read_csv
from companion.trajectory.demand import Motion
from companion.trajectory.facing import turned_first
from companion.trajectory.feasibility import Envelope, Violation, judge, slow_down, violations
from companion.trajectory.figures import (
    Hover,
    Laps,
    bernoulli_eight,
    circle,
    gerono_eight,
    helix,
    line,
)
from companion.trajectory.from_samples import Frame, HeadingFrom, SampleOptions, from_samples
from companion.trajectory.retimed import Slowed
from companion.trajectory.sample import (
    FARTHEST,
    FASTEST,
    LONGEST,
    Sample,
    Trajectory,
    TrajectoryError,
    Vector,
)
from companion.trajectory.waypoints import waypoints

__all__ = [
    "FARTHEST",
    "FASTEST",
    "LONGEST",
    "Envelope",
    "Frame",
    "HeadingFrom",
    "Hover",
    "Laps",
    "Motion",
    "Sample",
    "SampleOptions",
    "Slowed",
    "Table",
    "Trajectory",
    "TrajectoryError",
    "Vector",
    "Violation",
    "bernoulli_eight",
    "circle",
    "computable",
    "from_samples",
    "gerono_eight",
    "helix",
    "judge",
    "line",
    "read_csv",
    "slow_down",
    "turned_first",
    "violations",
    "waypoints",
]
