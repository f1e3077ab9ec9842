"""What is compared: the prediction models, how each is solved, and the tasks they fly."""

from math import radians
from typing import NamedTuple

from companion.guidance.trajectory.figures import Laps, circle, gerono_eight
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc import Settings
from companion.nmpc.worker import Worker
from companion.study.methods import Method
from companion.study.nmpc.models import MAKERS, ModelName

GAIN, YAW_GAIN = 5.0, 2.0
"""Of the planner, 1/s."""
LAG_MS, DEAD_TIME_MS = 25, 45
"""Of the rate loop."""
DRAG = 1.0
"""1/s, as PX4's simulated airframe has it."""
MAX_TILT, MAX_TILT_RATE, MAX_YAW_RATE = radians(50.0), radians(120.0), radians(60.0)
_MIN_THRUST, _MAX_THRUST = 3.0, 18.0
"""Specific thrust, m/s²."""

RATE_HZ = 50.0
"""Of the solver."""
MAX_ITERATIONS = 20
"""SQP iterations of a solve that runs to its tolerance."""

LOOKS: dict[ModelName, Method] = {
    "quaternion": Method("", "quaternion (39)", "#E69F00", width=3.0),
    "euler": Method("", "Euler (37)", "#D55E00", (7, 2, 1.5, 2), 1.8),
    "euler-reduced": Method("", "Euler, cancelled, yaw fixed", "#CC79A7", (3, 1.2), 1.8),
    "proposed": Method("", "proposed (34)", "#0072B2", width=1.3),
    "limited": Method("", "ours: (34) with limits", "#332288", width=2.0),
}
"""Label and line of each model."""
MODELS = tuple(LOOKS)
UNLIMITED = tuple(model for model in MODELS if model != "limited")
"""The models of the paper, and the baseline; none has limits of tilt or rate."""


class Variant(NamedTuple):
    """A model and how it is solved.

    Attributes:
        model: its name.
        iterations: most of the SQP; 1 is the real-time iteration.
        knows_dead_time: whether it predicts past the dead time.
    """

    model: ModelName
    iterations: int = 1
    knows_dead_time: bool = True

    @property
    def settings(self) -> Settings:
        """The true values of the vehicle; the dead time is 0 if it is not known."""
        return Settings(
            gain=GAIN,
            yaw_gain=YAW_GAIN,
            lag=max(0.25 / GAIN, 1e-3 * LAG_MS),  # of the planner's reference model
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
        """The solver of this model, in this process."""
        return Worker(self.settings, trajectory, MAKERS[self.model])

    @property
    def label(self) -> str:
        """For tables."""
        return LOOKS[self.model].label


class Task(NamedTuple):
    """What is flown, from rest and level at the trajectory's position.

    Attributes:
        name: for tables.
        trajectory: keeps its heading.
        begin: time on the trajectory at which the flight begins, s.
    """

    name: str
    trajectory: Trajectory
    begin: float


CIRCLE = Task("circle", circle(5.0, Laps(5.0, laps=4.0)), 5.0)
"""A standing start into the steady part: the vehicle is at rest where it should have 5 m/s."""
EIGHT = Task("eight", gerono_eight(3.0, Laps(5.0, laps=3.0)), 0.0)
"""From rest, at the speed of the trajectory."""
