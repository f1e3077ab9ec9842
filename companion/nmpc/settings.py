"""Settings of the predictive controller: vehicle, horizon, and weights of the cost."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of the squared errors, each integrated over the horizon."""

    position: float = 20.0
    """Weight of the position error, 1/m²."""
    velocity: float = 2.0
    """Weight of the velocity error, s²/m²."""
    heading: float = 2.0
    """Weight of the heading error, 1/rad²."""
    attitude_rate: float = 0.1
    """Weight of the error of the commanded attitude rate against the reference, s²/rad²."""
    thrust: float = 0.02
    """Weight of the error of the specific thrust against the reference, s⁴/m²."""
    final: float = 0.5
    """Terminal cost: the weights of position and velocity error at the end of the horizon are
    `position` and `velocity` times this factor, s."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Vehicle, horizon and solver.

    Raises:
        ValueError: `yaw_gain` or `min_thrust` is not positive, gravity is not between the limits of
            the thrust, or `lag` is too short for the step of the horizon. A configuration allows
            these values, but this controller does not.
    """

    gain: float = 5.0
    """Gain p of the planner that receives the targets, 1/s."""
    yaw_gain: float = 2.0
    """Gain of the planner on the heading error, 1/s."""
    lag: float = 0.05
    """Lag τ of the planner's response τ·c̈ + ċ = p·(c_d − c), s."""
    dead_time: float = 0.0
    """Time from sending a target to the first response of the vehicle, s."""
    gravity: float = 9.80665
    """Acceleration of gravity, m/s²."""
    max_tilt: float = 0.7
    """Tilt limit of the planner, rad."""
    max_tilt_rate: float = 2.0
    """Tilt rate limit W_M of the planner, rad/s."""
    max_yaw_rate: float = 1.0
    """Yaw rate limit of the planner, rad/s."""
    min_thrust: float = 2.0
    max_thrust: float = 18.0
    """`min_thrust` and `max_thrust`: limits of the specific thrust, m/s²."""
    weights: Weights = Weights()
    horizon: float = 1.0
    """Length of the prediction, s."""
    steps: int = 20
    """Number of steps of the horizon; the control is constant in each."""
    iterations: int = 1
    """Largest number of SQP iterations per solve; 1 is the real-time iteration."""
    lead: float = 0.02
    """Time from sending a request to the solver until guidance uses the answer, s."""
    deadline: float = 0.02
    """Wall time allowed for an answer, s."""
    niceness: int = 5
    """Niceness of the solver's process relative to the flight's, 0 to 19."""

    def __post_init__(self) -> None:
        for name in ("yaw_gain", "min_thrust"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive and finite, not {getattr(self, name)}")
        if not self.min_thrust < self.gravity < self.max_thrust:
            raise ValueError("gravity must lie between min_thrust and max_thrust")
        if self.lag < 0.5 * self.step_duration:
            raise ValueError(
                f"lag must be at least half a step of the horizon ({0.5 * self.step_duration:g} s),"
                f" not {self.lag}"
            )

    @property
    def step_duration(self) -> float:
        """Length of one step of the horizon, s."""
        return self.horizon / self.steps
