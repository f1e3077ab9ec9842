"""Measured dead time of a flight, compared with the configured one."""

from dataclasses import dataclass, field
from math import nan
from typing import NamedTuple

_TOLERATED_SHARE = 0.3
"""Share of the configured dead time by which the measured one may differ."""
_TOLERATED_DIFFERENCE = 0.008
"""Difference that is always tolerated, s: no rate loop is exactly a lag with a dead time, so the
result depends on the maneuver: by up to 3 ms over a flight, by up to 7 ms over a few seconds."""


class AxisDeadTime(NamedTuple):
    """Dead time of one axis: from a sample to the first effect of its setpoint, s."""

    measured: float | None = None
    """Measured dead time, s; None: too little undisturbed rotation, or the lag is unknown."""
    configured: float | None = None
    """Configured dead time, s; None: not configured."""

    @property
    def is_wrong(self) -> bool:
        """Whether measured and configured dead time differ by more than 30 % and by more than 8 ms.

        False if one of them is unknown.
        """
        if self.measured is None or self.configured is None:
            return False
        difference = abs(self.measured - self.configured)
        return difference > max(_TOLERATED_SHARE * self.configured, _TOLERATED_DIFFERENCE)


class SampleAge(NamedTuple):
    """Age of samples at arrival by TIMESYNC, s: the link's share of the dead time.

    TIMESYNC measures only the round trip, so the age is wrong by half the difference between the
    delays in the two directions.
    """

    p50: float = nan
    p99: float = nan


@dataclass(frozen=True, slots=True)
class DeadTimes:
    """Dead times measured in a flight."""

    axes: dict[str, AxisDeadTime] = field(
        default_factory=lambda: dict.fromkeys(("roll", "pitch", "yaw"), AxisDeadTime())
    )
    """Dead time by axis: roll, pitch, yaw."""
    sample_age: SampleAge = field(default_factory=SampleAge)
    """Age of samples at arrival; NaN without TIMESYNC."""
    lag_known: bool = False
    """Whether the lag is configured, which the measurement needs."""

    def warning(self) -> str | None:
        """A sentence on wrong dead times and their remedy; None if none is wrong."""
        wrong = [
            f"{name} {1e3 * axis.measured:.0f} ms (configured {1e3 * axis.configured:.0f} ms)"
            for name, axis in self.axes.items()
            if axis.is_wrong and axis.measured is not None and axis.configured is not None
        ]
        if not wrong:
            return None
        return (
            f"dead time is not as configured: {', '.join(wrong)}; the link or this "
            "computer is slow, or the configured lag is wrong: find what delays the messages, or "
            "measure lag and dead time anew with `companion identify`"
        )
