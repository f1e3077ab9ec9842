"""Samples whose stamps do not fit the vehicle's clock: outliers, or a clock that has changed."""

from enum import Enum
from typing import NamedTuple

SMALLEST_JUMP = 0.05
"""A stamp further ahead of the clock than this, s, is no drift; simulators slip by up to 0.016."""
SAME_CLOCK_SPREAD = 0.1
"""Two misfits whose offsets differ by less than this, s, may come from the same jump."""
_MIN_JUMP_SAMPLES = 3
"""Number of misfits in a row that shows a jump of the clock; fewer are outliers."""
_MIN_JUMP_DURATION = 0.04
"""Time that the misfits in a row must span to show a jump of the clock, s."""
RESTART_SETBACK = 2.0
"""The autopilot restarted if its clock went back by more than this, s; otherwise it jumped."""
WRAP_PERIOD_NS = 2**32 * 1_000_000
"""Time after which time_boot_ms, a uint32, wraps: 49.7 days in ns."""
_WRAP_PERIOD = 1e-9 * WRAP_PERIOD_NS
_WRAP_TOLERANCE = 600.0
"""Tolerance for recognising a wrap, s."""


class Misfit(Enum):
    """Why a sample does not fit the vehicle's clock."""

    NOT_NEWER = "stamped no later than the one before"
    AHEAD = "stamped far ahead of the vehicle's clock"


class SampleTiming(NamedTuple):
    """Vehicle time and age of one sample."""

    vehicle_time: float
    """Time on the vehicle's clock, s, without the clock's jumps and restarts."""
    age: float
    """Age at arrival, s, never negative; relative to the quickest sample while the delay is not
    known; NaN for a misfit."""
    misfit: Misfit | None = None
    """Why the sample must not be used, or None."""


class Stamp(NamedTuple):
    """One sample's time by the vehicle's clock and by the event loop's."""

    time: float
    """Vehicle time, s."""
    apparent_offset: float
    """`time` minus `received`, s: the offset of the clocks minus the sample's delay."""
    received: float
    """Event-loop time of the sample's arrival, s."""


class MisfitRun:
    """The misfits in a row since the last sample that fitted.

    Attributes:
        stamps: the times of each misfit, oldest first.
    """

    def __init__(self) -> None:
        self.stamps: list[Stamp] = []

    def agrees_with(self, stamp: Stamp) -> bool:
        """Whether another misfit agrees with the earlier ones, as if the clock had jumped."""
        if not self.stamps:
            return True
        last = self.stamps[-1]
        return (
            stamp.time >= last.time
            and abs(stamp.apparent_offset - last.apparent_offset) < SAME_CLOCK_SPREAD
        )

    def show_jump(self, old_offset: float) -> bool:
        """Whether the misfits show a jump of the clock away from `old_offset`, s."""
        first, last = self.stamps[0], self.stamps[-1]
        return (
            len(self.stamps) >= _MIN_JUMP_SAMPLES
            and last.time > first.time
            and last.received - first.received >= _MIN_JUMP_DURATION
            and abs(self.largest_offset() - old_offset) >= SMALLEST_JUMP
        )

    def largest_offset(self) -> float:
        """The largest offset of the misfits (vehicle time minus event-loop time), s."""
        return max(stamp.apparent_offset for stamp in self.stamps)

    def clock_stopped(self, newest_time: float) -> bool:
        """Whether all misfits repeat `newest_time`, the stamp of the last sample that fitted, s."""
        return self.stamps[0].time == self.stamps[-1].time == newest_time


def has_wrapped(jump: float, before: float) -> bool:
    """Whether a clock has wrapped.

    Args:
        jump: how far the clock moved, s.
        before: time since boot before the change, s.
    """
    return before > _WRAP_PERIOD - _WRAP_TOLERANCE and abs(jump + _WRAP_PERIOD) < _WRAP_TOLERANCE


def describe_change(jump: float, before: float, after: float, *, set_back: bool) -> str:
    """A change of the vehicle's clock in words.

    Args:
        jump: how far the clock moved, s.
        before: time since boot before the change, s.
        after: time since boot after the change, s.
        set_back: for a negative `jump`: whether the clock was set back; False: it stood still.
    """
    if has_wrapped(jump, before):
        return "the vehicle's time since boot wrapped around after 49.7 days"
    if jump > 0.0:
        return f"the vehicle's clock jumped ahead by {jump:.2f} s"
    if not set_back:
        return f"the vehicle's clock stood still for {-jump:.2f} s"
    if jump < -RESTART_SETBACK:
        return (
            f"the vehicle's time since boot went back from {before:.1f} s to {after:.1f} s: "
            "the autopilot restarted"
        )
    return f"the vehicle's clock went back by {-jump:.2f} s"
