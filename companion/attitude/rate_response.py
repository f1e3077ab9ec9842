"""How a vehicle's own rate loop answers body rates: what `model-following` plans with."""

from dataclasses import dataclass
from math import inf

_LONGEST = 1.0  # s, of a lag, a dead time or a lead


@dataclass(frozen=True, slots=True)
class AxisResponse:
    """Dead time, then a limit of acceleration, then a lag with a gain of 1.

    Attributes:
        lag: τ, s. In second order 2ζ/ω: in either, by how long it is late on average.
        dead_time: from a sample's time to the beginning of the effect of its answer, s.
        acceleration: the autopilot changes the rate it aims at no faster, rad/s².
        damping: ζ of a lag of second order; infinite in first order.
    """

    lag: float = 0.0
    dead_time: float = 0.0
    acceleration: float = inf
    damping: float = inf

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
        frame_lead: s by which the axes along which the autopilot takes the rates are ahead of the
            body in yaw: ArduPilot's attitude target turns before the body does. None: what `lead`
            makes of the rest.

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
