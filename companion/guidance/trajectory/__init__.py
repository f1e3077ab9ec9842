"""What can be followed: curves in space with a time law, sampled up to the jerk."""

from companion.guidance.trajectory.csv_file import Table
from companion.guidance.trajectory.csv_file import read as read_csv
from companion.guidance.trajectory.demand import Motion
from companion.guidance.trajectory.derived import Slowed, turned_first
from companion.guidance.trajectory.feasibility import (
    Envelope,
    Violation,
    judge,
    slow_down,
    violations,
)
from companion.guidance.trajectory.figures import (
    Hover,
    Laps,
    bernoulli_eight,
    circle,
    gerono_eight,
    helix,
    line,
    steady_circle,
)
from companion.guidance.trajectory.from_samples import (
    Frame,
    HeadingFrom,
    SampleOptions,
    from_samples,
)
from companion.guidance.trajectory.sample import (
    FARTHEST,
    FASTEST,
    LONGEST,
    Sample,
    Trajectory,
    TrajectoryError,
    Vector,
    computable,
)
from companion.guidance.trajectory.waypoints import waypoints

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
    "steady_circle",
    "turned_first",
    "violations",
    "waypoints",
]
