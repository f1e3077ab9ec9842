"""The vehicle's clock as we know it: how old a sample is, and how the clock itself changed.

Each attitude sample tells the offset between the vehicle's clock and ours, less the time that the
sample was under way: the quickest sample is the least late. TIMESYNC tells how late that one is.
"""

from collections.abc import Callable
from math import inf, nan

from companion.vehicle.clock_estimates import ClockRate, DelayUnknown, TelemetryDelay
from companion.vehicle.clock_jumps import (
    JUMP,
    REBOOTED,
    TOGETHER,
    Misfit,
    MisfitRun,
    Reading,
    Stamp,
    described,
    wrapped,
)

_SETTLES_FOR = 2.0
"""What was queued before we listened may come late and make the first offset wrong, for this, s."""
_CERTAINLY_BACK = 0.5
"""TIMESYNC lags the samples' stamps a little; behind the newest by this, s, time has gone back, and
has not only stood still."""
_TIMESYNC_LAG = 0.012
"""TIMESYNC lags the samples' stamps by up to this, s, in the simulators (measured)."""
_UNKNOWN_AFTER = 3.0
"""An autopilot that answers TIMESYNC does so within this time, s."""


class VehicleClock:
    """One vehicle's clock, fed by every attitude sample and TIMESYNC exchange.

    All vehicle times that it gives continue over jumps: what computes with them never sees one.

    Attributes:
        rate: How fast the clock runs.
        delay: How late even the quickest sample is, by TIMESYNC.
        timeline: Rises whenever the clock jumped, wrapped, stood still or restarted.
        restarts: Rises whenever the autopilot restarted: its time since boot went back by seconds,
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
        self._misfits = MisfitRun()
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
        """Age at our time `now` of what the vehicle stamped with `vehicle_time`; both in s.

        Never negative; None before the first sample.
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
            misfit = self._judge_misfit(time_boot_ms, Stamp(time, ahead, received), quickest)
            if misfit is not None:
                return Reading(time, nan, misfit)
            time = time_boot_ms / 1000.0 + self._shift
            ahead, quickest = time - received, self._quickest
        elif self._misfits.stamps:
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

        It also shows when the clock has slipped: simulators lose time on a busy computer and do not
        catch up. Samples then seem late until the next exchange.

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
        """Drop expired TIMESYNC exchanges; report when ages become unknown, or known again."""
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

    def _judge_misfit(self, time_boot_ms: int, stamp: Stamp, quickest: float) -> Misfit | None:
        """Why `stamp` does not fit; None where it does, or where the clock has changed to fit."""
        if self._began == inf:
            self._began = self._received = stamp.received
            self._quickest = 0.0 if self._lockstep else stamp.ahead
            return None
        is_ahead = stamp.time > self._newest
        drift = self.rate.spread(stamp.received - self._received)
        if is_ahead and stamp.ahead <= quickest + JUMP + drift:
            self._quickest = quickest
            self._drop_misfits()
            return None
        if is_ahead and self._ends_lateness(stamp, quickest):
            return None
        if not self._misfits.continued_by(stamp):
            self._drop_misfits()
        self._misfits.stamps.append(stamp)
        if not self._misfits.confirmed(quickest):
            return Misfit.AHEAD if is_ahead else Misfit.NOT_NEWER
        by = self._misfits.most_ahead() - quickest
        self._misfits.stamps.clear()
        self._quickest = quickest
        self._newest = -inf
        self._change(by, time_boot_ms, restarted=by < 0.0)
        return None

    def _ends_lateness(self, stamp: Stamp, quickest: float) -> bool:
        """Whether the link is quicker again: by TIMESYNC even the quickest sample was late.

        Samples then seem ahead by at most as much as the link was late. What TIMESYNC says after
        the last sample that fitted does not count: the clock may have jumped before it.
        """
        by = stamp.ahead - quickest
        if by > self.delay.most(before=self._received - TOGETHER):
            return False
        self._quickest = quickest
        self.delay.shorten(by, stamp.received)
        self._drop_misfits()
        return True

    def _end_misfits(self, time_boot_ms: int, late: float) -> None:
        """A sample fits again, `late` s: the clock stood still if all in between had one stamp."""
        stood_still = self._misfits.stood_still(self._newest)
        lasted = self._misfits.stamps[-1].received - self._received
        self._drop_misfits()
        if stood_still and min(lasted, late) >= JUMP:
            self._change(-late, time_boot_ms, restarted=False)

    def _drop_misfits(self) -> None:
        """They were strays: the clock goes on as before, or differently again."""
        ahead = sum(stamp.time > self._newest for stamp in self._misfits.stamps)
        if ahead and not self._told_outlier:
            self._told_outlier = True
            by = self._misfits.most_ahead() - self._quickest
            self.on_event(
                f"a sample stamped {by:.1f} s ahead of the vehicle's clock was dropped; such "
                "samples are counted"
            )
        self.outliers += ahead
        self._misfits.stamps.clear()

    def _change(self, by: float, time_boot_ms: int, *, restarted: bool) -> None:
        """Accept that the vehicle's clock jumped by `by` s; our vehicle times stay continuous."""
        before = self._received + self._quickest - self._shift
        self._shift -= by
        self.delay.retract(self._received - self.delay.seconds - TOGETHER)
        if self._received - self._began < _SETTLES_FOR and by > -REBOOTED:
            return
        self.timeline += 1
        self.restarts += restarted and not wrapped(by, before) and by < -REBOOTED
        self.last_change = described(by, before, time_boot_ms / 1000.0, restarted=restarted)
        self.on_event(self.last_change)
