"""The variants that are compared (prediction models and solver settings), and their tasks."""

from math import radians
from typing import NamedTuple

from companion.guidance.trajectory.figures import Laps, circle, gerono_eight
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc import Settings
from companion.nmpc.worker import Worker
from companion.study.methods import Method
from companion.study.nmpc.models import MODEL_MAKERS, ModelName

GAIN, YAW_GAIN = 5.0, 2.0
"""Gains of the planner, 1/s."""
LAG_MS, DEAD_TIME_MS = 25, 45
"""Lag and dead time of the rate loop, ms."""
DRAG = 1.0
"""Linear drag of PX4's simulated airframe, 1/s."""
MAX_TILT, MAX_TILT_RATE, MAX_YAW_RATE = radians(50.0), radians(120.0), radians(60.0)
_MIN_THRUST, _MAX_THRUST = 3.0, 18.0
"""Limits of the specific thrust, m/s²."""

RATE_HZ = 50.0
"""Rate of solves, Hz."""
MAX_ITERATIONS = 20
"""Largest number of SQP iterations of a solve that iterates to the tolerance."""

STYLES: dict[ModelName, Method] = {
    "quaternion": Method("", "quaternion (39)", "#E69F00", width=3.0),
    "euler": Method("", "Euler (37)", "#D55E00", (7, 2, 1.5, 2), 1.8),
    "euler-reduced": Method("", "Euler by angle rates, yaw fixed", "#CC79A7", (3, 1.2), 1.8),
    "proposed": Method("", "proposed (34)", "#0072B2", width=1.3),
    "limited": Method("", "ours: (34) with limits", "#332288", width=2.0),
}
"""Label and line style of each model."""
MODELS = tuple(STYLES)
UNLIMITED_MODELS = tuple(model for model in MODELS if model != "limited")
"""The models without limits of tilt or rate: those of the paper, and `euler-reduced`."""


class Variant(NamedTuple):
    """A prediction model and how it is solved."""

    model: ModelName
    """Name of the model."""
    iterations: int = 1
    """Largest number of SQP iterations; 1 is the real-time iteration."""
    knows_dead_time: bool = True
    """Whether the solver knows the dead time, and so predicts the motion over the dead time."""

    @property
    def settings(self) -> Settings:
        """Solver settings with the true values of the vehicle; the dead time is 0 if not known."""
        return Settings(
            gain=GAIN,
            yaw_gain=YAW_GAIN,
            lag=max(0.25 / GAIN, 1e-3 * LAG_MS),  # lag of the planner's reference model
            dead_time=1e-3 * DEAD_TIME_MS if self.knows_dead_time else 0.0,
            max_tilt=MAX_TILT,
            max_tilt_rate=MAX_TILT_RATE,
            max_yaw_rate=MAX_YAW_RATE,
            min_thrust=_MIN_THRUST,
            max_thrust=_MAX_THRUST,
            iterations=self.iterations,
            lead=1.0 / RATE_HZ,
        )

    def solver(self, trajectory: Trajectory) -> Worker:
        """The solver of this variant, in the calling process."""
        return Worker(self.settings, trajectory, MODEL_MAKERS[self.model])

    @property
    def label(self) -> str:
        """Label in tables."""
        return STYLES[self.model].label


class Task(NamedTuple):
    """A trajectory to fly. The vehicle begins level, at rest, at its position at `begin`."""

    name: str
    """Name in tables."""
    trajectory: Trajectory
    """A trajectory of constant heading."""
    begin: float
    """Time on the trajectory at which the flight begins, s."""


CIRCLE = Task("circle", circle(5.0, Laps(5.0, laps=4.0)), 5.0)
"""A circle whose reference moves at 5 m/s from the beginning; the vehicle begins at rest."""
EIGHT = Task("eight", gerono_eight(3.0, Laps(5.0, laps=3.0)), 0.0)
"""A figure-eight that begins at rest, like the vehicle."""
