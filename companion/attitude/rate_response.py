"""How a vehicle's own rate loop answers body rates: what `model-following` plans with."""

from dataclasses import dataclass
from math import inf

_LONGEST = 1.0  # s, of a lag, a dead time or a lead


@dataclass(frozen=True, slots=True)
class AxisResponse:
    """Dead time, then a limit of acceleration, then a first-order lag with a gain of 1.

    Attributes:
        lag: τ, s.
        dead_time: from a sample's time to the beginning of the effect of its answer, s.
        acceleration: the autopilot changes the rate it aims at no faster, rad/s².
    """

    lag: float = 0.0
    dead_time: float = 0.0
    acceleration: float = inf


@dataclass(frozen=True, slots=True)
class RateResponse:
    """The response of all axes.

    Attributes:
        tilt: of roll and pitch.
        yaw: of yaw.
        frame_lead: s by which the axes along which the autopilot takes the rates are ahead of the
            body in yaw: ArduPilot's attitude target turns before the body does. 0 where they are
            the body's own (PX4).

    Raises:
        ValueError: a time is negative, longer than 1 s or not finite, or a limit not positive.
    """

    tilt: AxisResponse = AxisResponse()
    yaw: AxisResponse = AxisResponse()
    frame_lead: float = 0.0

    def __post_init__(self) -> None:
        times = {
            "lag": self.tilt.lag,
            "dead_time": self.tilt.dead_time,
            "yaw_lag": self.yaw.lag,
            "yaw_dead_time": self.yaw.dead_time,
            "frame_lead": self.frame_lead,
        }
        for name, value in times.items():
            if not 0.0 <= value <= _LONGEST:
                raise ValueError(f"{name} must be from 0 to {_LONGEST:g} s, not {value}")
        limits = {"acceleration": self.tilt.acceleration, "yaw_acceleration": self.yaw.acceleration}
        for name, value in limits.items():
            if not value > 0.0:
                raise ValueError(f"{name} must be positive, not {value}")
