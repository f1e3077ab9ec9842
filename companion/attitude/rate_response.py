"""How a vehicle's own rate loop answers body rates: what `model-following` plans with."""

from dataclasses import dataclass, replace
from math import atan2, hypot, inf, pi, sqrt

_LONGEST = 1.0  # s, of a lag, a dead time or a lead
_LEAST_LAG = 1e-3  # s

SHARE_OF_LARGEST_GAIN = 0.25
"""The feedback gain is at most this share of the largest stable gain: a gain margin of 4."""


@dataclass(frozen=True, slots=True)
class AxisResponse:
    """Dead time, then a limit of acceleration, then a lag with a gain of 1.

    Attributes:
        lag: τ, s; in second order 2ζ/ω. In both it is the mean delay.
        dead_time: from the time of a sample to the first effect of its answer, s.
        acceleration: slew limit of the rate that the autopilot aims at, rad/s².
        damping: ζ of a lag of second order; infinite in first order.
    """

    lag: float = 0.0
    dead_time: float = 0.0
    acceleration: float = inf
    damping: float = inf

    def with_least_lag(self) -> "AxisResponse":
        """The same with a lag of at least 1 ms: a shorter one makes no difference."""
        return replace(self, lag=max(self.lag, _LEAST_LAG))

    @property
    def square(self) -> float:
        """1/ω², s²: the lag is square·ω̈ + lag·ω̇ + ω = what was commanded."""
        half = 0.5 * self.lag / self.damping
        return half * half


@dataclass(frozen=True, slots=True)
class RateResponse:
    """The response of all axes.

    Attributes:
        roll, pitch, yaw: of each axis.
        frame_lead: time by which the axes along which the autopilot takes the rates lead the body
            in yaw, s: ArduPilot's attitude target turns before the body does. None: `lead` derives
            it from the other times.

    Raises:
        ValueError: a time is negative, longer than 1 s or not finite, or a limit not positive.
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
            if not axis.acceleration > 0.0:
                raise ValueError(f"{prefix}acceleration must be positive, not {axis.acceleration}")

    @property
    def axes(self) -> tuple[AxisResponse, AxisResponse, AxisResponse]:
        """Roll, pitch, yaw."""
        return self.roll, self.pitch, self.yaw

    @property
    def lead(self) -> float:
        """`frame_lead`, or that of an autopilot that limits acceleration as ArduPilot does, s.

        It turns the target as soon as roll and pitch begin to answer, and the body's yaw follows
        one dead time and lag later. Without limits the axes are the body's own (PX4).
        """
        if self.frame_lead is not None:
            return self.frame_lead
        if self.yaw.acceleration == inf:
            return 0.0
        return max(0.0, self.yaw.dead_time + self.yaw.lag - self.tilt.dead_time)

    @property
    def tilt(self) -> AxisResponse:
        """The mean of roll and pitch, limited as the one with the lower limit."""
        roll, pitch = self.roll, self.pitch
        return AxisResponse(
            0.5 * (roll.lag + pitch.lag),
            0.5 * (roll.dead_time + pitch.dead_time),
            min(roll.acceleration, pitch.acceleration),
        )


def _check_time(name: str, value: float) -> None:
    if not 0.0 <= value <= _LONGEST:
        raise ValueError(f"{name} must be from 0 to {_LONGEST:g} s, not {value}")


def largest_gain(lag: float, dead_time: float, square: float = 0.0) -> float:
    """Largest stable feedback gain (1/s) of an integrator in series with e^(−θs)/(σs² + τs + 1).

    At the frequency ω where ωθ + ∠(1 − σω² + jωτ) = π/2 the loop has turned by half a circle; it is
    stable while its magnitude is below 1 there, so k = ω·|1 − σω² + jωτ|. Without a dead time every
    gain is stable with a lag of first order.

    Args:
        lag: τ, s.
        dead_time: θ, s.
        square: σ, s²; 0 for a lag of first order.
    """
    if dead_time <= 0.0 and square <= 0.0:
        return inf
    low, high = 0.0, 0.5 * pi / dead_time if dead_time > 0.0 else inf
    if square > 0.0:
        high = min(high, 1.0 / sqrt(square))  # there the lag alone gives that phase
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * dead_time + atan2(middle * lag, 1.0 - square * middle * middle) < 0.5 * pi:
            low = middle
        else:
            high = middle
    return low * hypot(1.0 - square * low * low, low * lag)


def feedback_gain(gain: float, axis: AxisResponse) -> float:
    """The gain (1/s) that `axis` bears of the wanted `gain` (1/s), with a gain margin of 4."""
    stable = SHARE_OF_LARGEST_GAIN * largest_gain(axis.lag, axis.dead_time, axis.square)
    return min(gain, stable)
