"""Who flies: the prediction models, each under one name and one look, and what they know."""

from typing import NamedTuple

from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc import Settings
from companion.nmpc.worker import Worker
from companion.study.methods import Line, Method
from companion.study.nmpc import vehicle as plant
from companion.study.nmpc.models import MAKERS, ModelName

RATE_HZ = 50.0
SQP_ITERATIONS = 20
"""Most of a solve that is let run to its end."""


class Contestant(NamedTuple):
    """A model and how it is solved.

    Attributes:
        model: which.
        iterations: 1 is the real-time iteration.
        told: whether it knows the dead time.
    """

    model: ModelName
    iterations: int = 1
    told: bool = True

    @property
    def settings(self) -> Settings:
        """The vehicle as it is; only the dead time may be kept from it."""
        return Settings(
            gain=plant.GAIN,
            yaw_gain=plant.YAW_GAIN,
            lag=max(0.25 / plant.GAIN, 1e-3 * plant.LAG_MS),  # of the planner's reference model
            dead_time=1e-3 * plant.DEAD_TIME_MS if self.told else 0.0,
            max_tilt=plant.MAX_TILT,
            max_tilt_rate=plant.MAX_TILT_RATE,
            max_yaw_rate=plant.MAX_YAW_RATE,
            min_thrust=plant.THRUSTS[0],
            max_thrust=plant.THRUSTS[1],
            iterations=self.iterations,
            lead=1.0 / RATE_HZ,
        )

    def solver(self, trajectory: Trajectory) -> Worker:
        """The solver of this model, in this process."""
        return Worker(self.settings, trajectory, MAKERS[self.model])

    @property
    def label(self) -> str:
        """For tables and legends."""
        return LOOKS[self.model].label

    @property
    def line(self) -> Line:
        """The look of the model."""
        return LOOKS[self.model].line


LOOKS: dict[ModelName, Method] = {
    "quaternion": Method("", "quaternion (39)", "#E69F00", width=3.0),
    "euler": Method("", "Euler (37)", "#D55E00", (7, 2, 1.5, 2), 1.8),
    "euler-reduced": Method("", "Euler, cancelled, yaw fixed", "#CC79A7", (3, 1.2), 1.8),
    "proposed": Method("", "proposed (34)", "#0072B2", width=1.3),
    "limited": Method("", "ours: (34) with limits", "#332288", width=2.0),
}
MODELS = tuple(LOOKS)
PAPERS = tuple(model for model in MODELS if model != "limited")
"""Those that the paper has, and the baseline; none of them has limits."""
