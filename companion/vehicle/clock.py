"""The vehicle's clock as we know it: how old a sample is, and what became of the clock itself.

Attitude samples tell how the vehicle's clock stands to ours, up to the time they were under way:
the quickest one is the least late. TIMESYNC tells by how much even the quickest one is late.
"""

from collections.abc import Callable
from enum import Enum
from math import inf, nan
from typing import NamedTuple

from companion.vehicle.clock_rate import ClockRate
from companion.vehicle.telemetry_delay import DelayUnknown, TelemetryDelay

JUMP = 0.05
"""A stamp further ahead than this, s, is no drift; the simulators' clocks slip by up to 0.016."""
_CONFIRMED_BY = 3
_CONFIRMED_FOR = 0.04
"""A clock has jumped when this many samples in a row say so, for this long, s. Fewer are strays."""
_TOGETHER = 0.1
"""Samples whose delays differ by less than this, s, may be of one clock."""
_SETTLES_FOR = 2.0
"""What was queued before we listened may come late and make the first offset wrong, for this, s."""
_REBOOTED = 2.0
"""A clock that goes back by more than this, s, belongs to an autopilot that restarted; by less, it
has only jumped."""
_CERTAINLY_BACK = 0.5
"""TIMESYNC lags the samples' stamps a little; behind the newest by this, s, time has gone back, and
has not only stood still."""
_TIMESYNC_LAG = 0.012
"""TIMESYNC lags the samples' stamps by up to this, s, in the simulators (measured)."""
_WRAP = 2**32 / 1000.0
"""time_boot_ms is a uint32: it wraps after 49.7 days, s."""
_NEAR_WRAP = 600.0
_UNKNOWN_AFTER = 3.0
"""An autopilot that answers TIMESYNC does so within this time, s."""


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


class _Candidate(NamedTuple):
    time: float
    ahead: float
    received: float


class VehicleClock:
    """One vehicle's clock, fed by every attitude sample and TIMESYNC exchange.

    All vehicle times it gives are continued over jumps: what computes with them never sees one.

    Attributes:
        rate: How fast the clock runs.
        delay: How late even the quickest sample is, by TIMESYNC.
        timeline: Rises whenever the clock jumped, wrapped, stood still or restarted.
        restarts: Rises whenever the autopilot restarted: the time since boot went back, by seconds,
            and went on from there.
        last_change: The newest of these changes in words.
        outliers: Samples dropped because they alone were stamped far ahead.
        on_event: Takes what the user should know, in words.

    Args:
        lockstep: Whether the vehicle's clock is ours, so that ages are known without TIMESYNC.
    """

    def __init__(self, *, lockstep: bool = False) -> None:
        self.rate = ClockRate(fixed=lockstep)
        self.delay = TelemetryDelay()
        self.timeline = self.restarts = self.outliers = 0
        self.last_change = ""
        self.on_event: Callable[[str], None] = lambda _: None
        self._lockstep = lockstep
        self._began = inf
        self._shift = 0.0
        self._quickest = self._newest = -inf
        self._received = self._late = 0.0
        self._candidates: list[_Candidate] = []
        self._told_unknown = False
        self._told_outlier = False

    @property
    def age_known(self) -> bool:
        """Whether ages are absolute; else they count from the quickest sample's."""
        return self._lockstep or self.delay.known

    @property
    def offset(self) -> float | None:
        """Vehicle time minus ours, s; None before the first sample."""
        return None if self._began == inf else self._quickest + self.delay.seconds

    def vehicle_time(self, time_boot_ms: int) -> float:
        """The stamp of another message, s, as `Reading.vehicle_time`."""
        return time_boot_ms / 1000.0 + self._shift

    def age(self, vehicle_time: float, now: float) -> float | None:
        """How old what the vehicle stamped so is at `now`, s, never negative.

        None before the first sample.
        """
        offset = self.offset
        return None if offset is None else max(0.0, now + offset - vehicle_time)

    def is_ahead(self, vehicle_time: float, now: float) -> bool:
        """Whether a stamp is ahead of the clock at `now`, further than the clock may drift."""
        if self._began == inf:
            return False
        spread = self.rate.spread(max(0.0, now - self._received))
        return vehicle_time - now > self._quickest + self.delay.seconds + JUMP + spread

    def take(self, time_boot_ms: int, received: float) -> Reading:
        """Take an attitude sample.

        Args:
            time_boot_ms: Its stamp.
            received: When it arrived, s on our clock.
        """
        time = time_boot_ms / 1000.0 + self._shift
        ahead = time - received
        quickest = self._quickest + self.rate.slowest * (received - self._received)
        if time <= self._newest or ahead > quickest + JUMP:
            misfit = self._judge_misfit(time_boot_ms, _Candidate(time, ahead, received), quickest)
            if misfit is not None:
                return Reading(time, nan, misfit)
            time = time_boot_ms / 1000.0 + self._shift
            ahead, quickest = time - received, self._quickest
        elif self._candidates:
            self._end_misfits(time_boot_ms, quickest - ahead)
            time = time_boot_ms / 1000.0 + self._shift
            ahead = time - received
        late = quickest - ahead
        if late < 0.0:
            quickest, late = ahead, 0.0
        self._quickest, self._received, self._newest = quickest, received, time
        self._late = late
        if received >= self.rate.due:
            self.rate.note(received, quickest)
        return Reading(time, late + self.delay.seconds)

    def exchange(self, sent: float, received: float, vehicle_ns: int) -> None:
        """Take a TIMESYNC exchange.

        It also tells when the clock has slipped: simulators lose time on a busy computer and do not
        catch up. Samples then seem late, and no longer than until the next exchange.

        Args:
            sent: When we asked, s on our clock.
            received: When the answer came, s on our clock.
            vehicle_ns: What the vehicle's clock said in between, ns.
        """
        if self._lockstep or self._began == inf:
            return
        time = vehicle_ns * 1e-9 + self._shift
        middle, half = 0.5 * (sent + received), 0.5 * (received - sent)
        quickest = self._quickest + self.rate.rate * (middle - self._received)
        attitude_fits = received - self._received < 1.0 and self._late < JUMP
        error = half + self.rate.spread(max(0.0, received - self._received))
        delay = time - middle - quickest
        behind = self.delay.compare(received, error, delay)
        if behind is None:
            if -delay < JUMP:
                self._quickest -= max(0.0, -delay - error - _TIMESYNC_LAG)
            return
        if attitude_fits:  # then it is TIMESYNC's clock that has changed
            self.delay.forget(DelayUnknown.OTHER_CLOCK)
        else:
            # Its answer may be a little older than the sample that came before it.
            back = time < self._newest - _CERTAINLY_BACK
            self._change(-behind, round(vehicle_ns * 1e-6), restarted=back)

    def look(self, now: float) -> None:
        """Let old exchanges expire and tell once whether ages are known; called once a second."""
        self.delay.expire(now)
        if now - self._began < _UNKNOWN_AFTER or self.age_known is not self._told_unknown:
            return
        self._told_unknown = not self.age_known
        if self._told_unknown:
            self.on_event(
                f"the age of telemetry is not known, because {self.delay.unknown.value}; only what "
                "is later than the quickest sample counts as late"
            )
        else:
            self.on_event("the age of telemetry is known by TIMESYNC")

    def _judge_misfit(
        self, time_boot_ms: int, sample: _Candidate, quickest: float
    ) -> Misfit | None:
        """Why `sample` does not fit; None where it does, or where the clock has changed to fit."""
        if self._began == inf:
            self._began = self._received = sample.received
            self._quickest = 0.0 if self._lockstep else sample.ahead
            return None
        is_ahead = sample.time > self._newest
        if is_ahead and sample.ahead <= quickest + JUMP + self.rate.spread(
            sample.received - self._received
        ):
            self._quickest = quickest
            self._drop_candidates()
            return None
        if is_ahead and self._ends_lateness(sample, quickest):
            return None
        if not self._confirms(sample, quickest):
            return Misfit.AHEAD if is_ahead else Misfit.NOT_NEWER
        by = max(candidate.ahead for candidate in self._candidates) - quickest
        self._candidates.clear()
        self._quickest = quickest
        self._newest = -inf
        self._change(by, time_boot_ms, restarted=by < 0.0)
        return None

    def _ends_lateness(self, sample: _Candidate, quickest: float) -> bool:
        """Whether the link is quicker again: TIMESYNC told that even the quickest sample was late.

        The link then brings samples that seem ahead by no more than it was late. What TIMESYNC says
        after the last sample that fitted does not count: the clock may have jumped before it.
        """
        by = sample.ahead - quickest
        if by > self.delay.most(before=self._received - _TOGETHER):
            return False
        self._quickest = quickest
        self.delay.shorten(by, sample.received)
        self._drop_candidates()
        return True

    def _confirms(self, sample: _Candidate, quickest: float) -> bool:
        """Whether it and the misfits just before it are a clock that goes on elsewhere."""
        seen = self._candidates
        if seen and not (
            sample.time >= seen[-1].time and abs(sample.ahead - seen[-1].ahead) < _TOGETHER
        ):
            self._drop_candidates()
        seen.append(sample)
        return (
            len(seen) >= _CONFIRMED_BY
            and sample.time > seen[0].time
            and sample.received - seen[0].received >= _CONFIRMED_FOR
            and abs(max(each.ahead for each in seen) - quickest) >= JUMP
        )

    def _end_misfits(self, time_boot_ms: int, late: float) -> None:
        """A sample fits again, `late` s: the clock stood still if all in between had one stamp."""
        seen = self._candidates
        stood_still = seen[0].time == seen[-1].time == self._newest
        lasted = seen[-1].received - self._received
        self._drop_candidates()
        if stood_still and min(lasted, late) >= JUMP:
            self._change(-late, time_boot_ms, restarted=False)

    def _drop_candidates(self) -> None:
        """They were strays: the clock goes on as before, or differently again."""
        ahead = sum(each.time > self._newest for each in self._candidates)
        if ahead and not self._told_outlier:
            by = max(each.ahead for each in self._candidates) - self._quickest
            self._told_outlier = True
            self.on_event(
                f"a sample stamped {by:.1f} s ahead of the vehicle's clock was dropped; such "
                "samples are counted"
            )
        self.outliers += ahead
        self._candidates.clear()

    def _change(self, by: float, time_boot_ms: int, *, restarted: bool) -> None:
        """Go on with a clock that has moved by `by` s; vehicle times go on without it."""
        before = self._received + self._quickest - self._shift
        self._shift -= by
        self.delay.retract(self._received - self.delay.seconds - _TOGETHER)
        if self._received - self._began < _SETTLES_FOR and by > -_REBOOTED:
            return
        self.timeline += 1
        wrapped = by < 0.0 and before > _WRAP - _NEAR_WRAP and abs(by + _WRAP) < _NEAR_WRAP
        self.restarts += restarted and not wrapped and by < -_REBOOTED
        now = time_boot_ms / 1000.0
        if wrapped:
            self.last_change = "the vehicle's time since boot wrapped around after 49.7 days"
        elif by > 0.0:
            self.last_change = f"the vehicle's clock jumped ahead by {by:.2f} s"
        elif not restarted:
            self.last_change = f"the vehicle's clock stood still for {-by:.2f} s"
        elif by < -_REBOOTED:
            self.last_change = (
                f"the vehicle's time since boot went back from {before:.1f} s to {now:.1f} s: the "
                "autopilot restarted"
            )
        else:
            self.last_change = f"the vehicle's clock went back by {-by:.2f} s"
        self.on_event(self.last_change)
