"""Samples whose stamps do not fit the vehicle's clock: strays, or a clock that has changed."""

from enum import Enum
from typing import NamedTuple

JUMP = 0.05
"""A stamp further ahead than this, s, is no drift; the simulators' clocks slip by up to 0.016."""
TOGETHER = 0.1
"""Samples whose delays differ by less than this, s, may be of one clock."""
_CONFIRMED_BY = 3
_CONFIRMED_FOR = 0.04
"""A clock has jumped when this many samples in a row say so, for this long, s. Fewer are strays."""
REBOOTED = 2.0
"""A clock that goes back by more than this, s, belongs to an autopilot that restarted; by less, it
has only jumped."""
_WRAP = 2**32 / 1000.0
"""time_boot_ms is a uint32: it wraps after 49.7 days, s."""
_NEAR_WRAP = 600.0


class Misfit(Enum):
    """Why a sample does not fit the vehicle's clock."""

    NOT_NEWER = "stamped no later than the one before"
    AHEAD = "stamped far ahead of the vehicle's clock"


class Reading(NamedTuple):
    """One sample's time.

    Attributes:
        vehicle_time: s on the vehicle's clock; goes on where the clock jumps or restarts.
        age: s at its arrival, never negative; beyond the quickest sample's where the delay is not
            known; NaN for a misfit.
        misfit: Why it must not be used, or None.
    """

    vehicle_time: float
    age: float
    misfit: Misfit | None = None


class Stamp(NamedTuple):
    """One sample's time by both clocks.

    Attributes:
        time: On the vehicle's clock, s.
        ahead: Vehicle time minus ours at its arrival, s.
        received: On our clock, s.
    """

    time: float
    ahead: float
    received: float


class MisfitRun:
    """The misfits in a row since the last sample that fitted.

    Attributes:
        stamps: Of each of them, oldest first.
    """

    def __init__(self) -> None:
        self.stamps: list[Stamp] = []

    def continued_by(self, stamp: Stamp) -> bool:
        """Whether a further misfit agrees with the earlier ones, as of one shifted clock."""
        if not self.stamps:
            return True
        last = self.stamps[-1]
        return stamp.time >= last.time and abs(stamp.ahead - last.ahead) < TOGETHER

    def confirmed(self, quickest: float) -> bool:
        """Whether they are a clock that goes on elsewhere than `quickest`, the old offset, s."""
        first, last = self.stamps[0], self.stamps[-1]
        return (
            len(self.stamps) >= _CONFIRMED_BY
            and last.time > first.time
            and last.received - first.received >= _CONFIRMED_FOR
            and abs(self.most_ahead() - quickest) >= JUMP
        )

    def most_ahead(self) -> float:
        """The largest offset among them (vehicle time minus ours), s."""
        return max(stamp.ahead for stamp in self.stamps)

    def stood_still(self, newest: float) -> bool:
        """Whether all of them repeat the stamp of the last sample that fitted, s."""
        return self.stamps[0].time == self.stamps[-1].time == newest


def wrapped(by: float, before: float) -> bool:
    """Whether a clock that moved by `by` s has wrapped; `before`: its old time since boot, s."""
    return by < 0.0 and before > _WRAP - _NEAR_WRAP and abs(by + _WRAP) < _NEAR_WRAP


def described(by: float, before: float, now: float, *, restarted: bool) -> str:
    """A change of the vehicle's clock in words.

    Args:
        by: How far it moved, s.
        before: Its time since boot before the change, s.
        now: Its time since boot after it, s.
        restarted: Whether its time went back and goes on from there; else it stood still.
    """
    if wrapped(by, before):
        return "the vehicle's time since boot wrapped around after 49.7 days"
    if by > 0.0:
        return f"the vehicle's clock jumped ahead by {by:.2f} s"
    if not restarted:
        return f"the vehicle's clock stood still for {-by:.2f} s"
    if by < -REBOOTED:
        return (
            f"the vehicle's time since boot went back from {before:.1f} s to {now:.1f} s: the "
            "autopilot restarted"
        )
    return f"the vehicle's clock went back by {-by:.2f} s"
