"""Settings of the predictive controller: vehicle, horizon, and weights of the cost."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of the squared errors, each integrated over the horizon.

    Attributes:
        position: weight of the position error, 1/m².
        velocity: weight of the velocity error, s²/m².
        heading: weight of the heading error, 1/rad².
        turning: weight of the commanded attitude rate minus that of the reference, s²/rad².
        thrust: weight of the specific thrust minus that of the reference, s⁴/m².
        final: weights of position and velocity at the end of the horizon, divided by the weights
            over it, s.
    """

    position: float = 20.0
    velocity: float = 2.0
    heading: float = 2.0
    turning: float = 0.1
    thrust: float = 0.02
    final: float = 0.5


@dataclass(frozen=True, slots=True)
class Settings:
    """Vehicle, horizon and solver.

    Attributes:
        gain: p of the planner that flies the targets, 1/s.
        yaw_gain: heading gain of that planner, 1/s.
        lag: τ of that planner's response τ·c̈ + ċ = p·(c_d − c), s.
        dead_time: time from sending a target to the first response of the vehicle, s.
        gravity: m/s².
        max_tilt: tilt limit of the planner, rad.
        max_tilt_rate: tilt rate limit W_M of the planner, rad/s.
        max_yaw_rate: yaw rate limit of the planner, rad/s.
        min_thrust, max_thrust: limits of the specific thrust, m/s².
        weights: weights of the cost.
        horizon: length of the prediction, s.
        steps: number of steps of the horizon; the control is constant in each.
        iterations: largest number of SQP iterations per solve; 1 is the real-time iteration.
        lead: time from a request to the use of its answer, s.
        deadline: time allowed for an answer, s of wall time.
        niceness: niceness of the solver's process relative to the flight's, 0 to 19.

    Raises:
        ValueError: a configuration allows it, but this controller does not: `yaw_gain` or
            `min_thrust` is 0, gravity is not between the limits of the thrust, or `lag` is too
            short for the step of the horizon.
    """

    gain: float = 5.0
    yaw_gain: float = 2.0
    lag: float = 0.05
    dead_time: float = 0.0
    gravity: float = 9.80665
    max_tilt: float = 0.7
    max_tilt_rate: float = 2.0
    max_yaw_rate: float = 1.0
    min_thrust: float = 2.0
    max_thrust: float = 18.0
    weights: Weights = Weights()
    horizon: float = 1.0
    steps: int = 20
    iterations: int = 1
    lead: float = 0.02
    deadline: float = 0.02
    niceness: int = 5

    def __post_init__(self) -> None:
        for name in ("yaw_gain", "min_thrust"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive and finite, not {getattr(self, name)}")
        if not self.min_thrust < self.gravity < self.max_thrust:
            raise ValueError("gravity must lie between min_thrust and max_thrust")
        if self.lag < 0.5 * self.step:
            raise ValueError(
                f"lag must be at least half a step of the horizon ({0.5 * self.step:g} s),"
                f" not {self.lag}"
            )

    @property
    def step(self) -> float:
        """Length of one step of the horizon, s."""
        return self.horizon / self.steps
