"""Response of the vehicle's rate loop to commanded rates, for the planner `model-following`."""

from dataclasses import dataclass, replace
from math import atan2, hypot, inf, pi, sqrt

from companion.attitude.limits import SMALLEST_LIMIT

_LONGEST_LAG_OR_DEAD_TIME = 1.0
"""Longest lag, dead time or lead that is accepted, s."""
_SMALLEST_LAG = 1e-3
"""Smallest lag that `model-following` computes with, s."""

FIRST_ORDER_LAG_SHARE = 0.63
"""Lag of the first-order model closest to PX4's second-order response, as a share of the lag of
that response. The rest of that lag acts nearly like a dead time."""
SHARE_OF_LARGEST_GAIN = 0.25
"""Largest feedback gain, as a share of the largest stable gain: a gain margin of 4."""


@dataclass(frozen=True, slots=True)
class AxisResponse:
    """Response of one axis: dead time, then a slew limit, then a lag of gain 1.

    Attributes:
        lag: τ, s, the delay of a slowly changing command; for a lag of second order 2ζ/ω.
        dead_time: time from a sample to the first effect of the rates sent for it, s.
        acceleration: slew limit of the autopilot's rate setpoint, rad/s².
        damping: ζ of a lag of second order; infinite for first order.
    """

    lag: float = 0.0
    dead_time: float = 0.0
    acceleration: float = inf
    damping: float = inf

    def with_least_lag(self) -> "AxisResponse":
        """This response with a lag of at least 1 ms; a shorter lag makes no difference."""
        return replace(self, lag=max(self.lag, _SMALLEST_LAG))

    @property
    def sigma(self) -> float:
        """σ of the lag σ·r̈ + lag·ṙ + r = command, s²; 0 for first order."""
        inverse_frequency = 0.5 * self.lag / self.damping
        return inverse_frequency * inverse_frequency


@dataclass(frozen=True, slots=True)
class RateLoopResponse:
    """Response of the rate loop on all axes.

    Attributes:
        roll, pitch, yaw: response of each axis.
        frame_lead: time by which ArduPilot's attitude target leads the body in yaw, s; ArduPilot
            applies body rates along the axes of that target. None: `lead_time` estimates it.

    Raises:
        ValueError: a time is negative, longer than 1 s or NaN, or a slew limit or damping is below
            1e-6.
    """

    roll: AxisResponse = AxisResponse()
    pitch: AxisResponse = AxisResponse()
    yaw: AxisResponse = AxisResponse()
    frame_lead: float | None = None

    def __post_init__(self) -> None:
        if self.frame_lead is not None:
            _check_time("frame_lead", self.frame_lead)
        axes = {"": self.roll, "pitch_": self.pitch, "yaw_": self.yaw}
        for prefix, axis in axes.items():
            _check_time(f"{prefix}lag", axis.lag)
            _check_time(f"{prefix}dead_time", axis.dead_time)
            _check_large_enough(f"{prefix}acceleration", axis.acceleration)
            _check_large_enough(f"{prefix}damping", axis.damping)

    @property
    def lead_time(self) -> float:
        """How far the attitude target leads the body in yaw: `frame_lead` or an estimate, s.

        An autopilot with a slew limit in yaw is assumed to behave like ArduPilot: its attitude
        target turns as soon as roll and pitch begin to respond, and the body follows after the dead
        time and lag of yaw. Without a slew limit (PX4) rates are along the body's axes, and the
        lead is 0.
        """
        if self.frame_lead is not None:
            return self.frame_lead
        if self.yaw.acceleration == inf:
            return 0.0
        return max(0.0, self.yaw.dead_time + self.yaw.lag - self.tilt.dead_time)

    @property
    def tilt(self) -> AxisResponse:
        """First-order response: mean lag and dead time of roll and pitch, the lower slew limit."""
        roll, pitch = self.roll, self.pitch
        return AxisResponse(
            0.5 * (roll.lag + pitch.lag),
            0.5 * (roll.dead_time + pitch.dead_time),
            min(roll.acceleration, pitch.acceleration),
        )


def _check_time(name: str, value: float) -> None:
    if not 0.0 <= value <= _LONGEST_LAG_OR_DEAD_TIME:
        raise ValueError(f"{name} must be from 0 to {_LONGEST_LAG_OR_DEAD_TIME:g} s, not {value}")


def _check_large_enough(name: str, value: float) -> None:
    if not value >= SMALLEST_LIMIT:
        raise ValueError(f"{name} must be at least {SMALLEST_LIMIT:g}, not {value}")


def largest_gain(lag: float, dead_time: float, sigma: float = 0.0) -> float:
    """Largest stable feedback gain (1/s) of an integrator in series with e^(−θs)/(σs² + τs + 1).

    At the frequency ω where ωθ + ∠(1 − σω² + jωτ) = π/2 the phase of the loop is −180°. The loop is
    stable while its magnitude is below 1 there, so k = ω·|1 − σω² + jωτ|. With a lag of first order
    and no dead time every gain is stable, and the result is infinite.

    Args:
        lag: τ, s.
        dead_time: θ, s.
        sigma: σ, s²; 0 for a lag of first order.
    """
    if dead_time <= 0.0 and sigma <= 0.0:
        return inf
    low, high = 0.0, 0.5 * pi / dead_time if dead_time > 0.0 else inf
    if sigma > 0.0:
        high = min(high, 1.0 / sqrt(sigma))  # there the phase of the lag alone is −90°
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * dead_time + atan2(middle * lag, 1.0 - sigma * middle * middle) < 0.5 * pi:
            low = middle
        else:
            high = middle
    return low * hypot(1.0 - sigma * low * low, low * lag)


def feedback_gain(gain: float, axis: AxisResponse) -> float:
    """The wanted `gain`, 1/s, reduced where `axis` would have a gain margin below 4."""
    largest_allowed = SHARE_OF_LARGEST_GAIN * largest_gain(axis.lag, axis.dead_time, axis.sigma)
    return min(gain, largest_allowed)
