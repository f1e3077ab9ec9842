"""The plan over time: what was planned, when it acts, and how long a command is held."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Generic, NamedTuple, TypeVar

_TRIMMED = 64
"""Rows older than every delay are dropped in blocks of this many."""


def between(times: Sequence[float], time: float) -> tuple[int, float]:
    """Where `time` lies among at least two ascending times, for a linear look-up.

    Returns:
        The index of the later of the two times around it, and the share of the way from the
        earlier one to it; below 0 before the first time, above 1 past the last.
    """
    later, last = bisect_right(times, time), len(times) - 1
    later = 1 if later < 1 else last if later > last else later
    start = times[later - 1]
    return later, (time - start) / (times[later] - start)


class PlannedTilt(NamedTuple):
    """The plan of the tilt at one time.

    Attributes:
        north, east: coefficients.
        still: integral of R_z, the yaw rate that kept the heading still on the way, rad.
        x, y: body rates that go with it at heading 0, rad/s.
        x_slope, y_slope: their change, rad/s².
        z: R_z, rad/s.
    """

    north: float
    east: float
    still: float
    x: float
    y: float
    x_slope: float
    y_slope: float
    z: float


class PlannedYaw(NamedTuple):
    """The plan of the heading at one time, and how the body turns.

    Attributes:
        heading: rad, not wrapped.
        turned: integral of the yaw rate with which the body answers what it was sent, rad.
        turning: that yaw rate, rad/s.
    """

    heading: float
    turned: float
    turning: float


Row = TypeVar("Row", PlannedTilt, PlannedYaw)


class History(Generic[Row]):
    """Plan over time, linear between rows.

    Args:
        span: the longest delay that is looked up, s.
    """

    __slots__ = ("_rows", "_span", "_times")

    def __init__(self, span: float) -> None:
        self._span = span
        self._times: list[float] = []
        self._rows: list[Row] = []

    def start(self, time: float, row: Row, motion: Row) -> None:
        """Start anew: before `row` the plan moved steadily, by `motion` per second."""
        earlier = type(row)(*[a - self._span * b for a, b in zip(row, motion, strict=True)])
        self._times[:] = [time - self._span, time]
        self._rows[:] = [earlier, row]

    def add(self, time: float, row: Row) -> None:
        """Add a newer row; drop rows that are older than every delay."""
        times = self._times
        times.append(time)
        self._rows.append(row)
        if len(times) > _TRIMMED and times[_TRIMMED] < time - self._span:
            del times[:_TRIMMED], self._rows[:_TRIMMED]

    @property
    def newest(self) -> Row:
        """The row that was added last."""
        return self._rows[-1]

    def at(self, time: float) -> Row:
        """The plan at `time`: linear between rows and beyond them."""
        later, share = between(self._times, time)
        before, after = self._rows[later - 1], self._rows[later]
        return type(before)(*[a + share * (b - a) for a, b in zip(before, after, strict=True)])


class Turn(NamedTuple):
    """How the body is expected to have turned when what is planned for a time acts.

    Attributes:
        angle: of its heading, from a base that each sample measures anew, rad.
        rate: rad/s.
    """

    angle: float
    rate: float


class PlanHistory:
    """The plan of tilt and heading since the start, and when it acts.

    What is planned for a time acts one dead time later. Tilt and heading have their own.

    Args:
        dead_time: of the slower of roll and pitch, s.
        yaw_dead_time: s.
        longest_sample: s.

    Attributes:
        time: up to which there is a plan, s since the start.
        tilt: the plan of the tilt.
        yaw: the plan of the heading.
    """

    __slots__ = ("_dead_time", "_yaw_dead_time", "tilt", "time", "yaw")

    def __init__(self, dead_time: float, yaw_dead_time: float, longest_sample: float) -> None:
        self._dead_time, self._yaw_dead_time = dead_time, yaw_dead_time
        span = max(dead_time, yaw_dead_time) + longest_sample
        self.time = 0.0
        self.tilt: History[PlannedTilt] = History(span)
        self.yaw: History[PlannedYaw] = History(span)

    def add(self, dt: float, tilt: PlannedTilt, yaw: PlannedYaw) -> None:
        """Add the plan for `dt` seconds after the newest row."""
        self.time += dt
        self.tilt.add(self.time, tilt)
        self.yaw.add(self.time, yaw)

    def acting(self, late: float) -> tuple[PlannedTilt, PlannedYaw]:
        """The plan that acts on a sample that came `late` seconds after it was expected."""
        now = self.time + late
        return self.tilt.at(now - self._dead_time), self.yaw.at(now - self._yaw_dead_time)

    def turn_when(self, planned_for: float, plan: PlannedTilt) -> Turn:
        """How the body will have turned when `plan`, made for `planned_for` (s), acts.

        By its yaw rate, less the part of it that keeps the heading still.
        """
        acts = planned_for + self._dead_time
        body = self.yaw.at(acts - self._yaw_dead_time)
        return Turn(body.turned - plan.still, body.turning - plan.z)

    def turn_within(self, lead: float) -> float:
        """How far the body turns within `lead` seconds after the newest plan of the tilt acts."""
        acts = self.time + self._dead_time - self._yaw_dead_time
        return self.yaw.at(acts + lead).turned - self.yaw.at(acts).turned


_SHARE = 0.05
"""Share of the newest sample's period in the period that is expected next."""


class SampleHold:
    """Turns a planned motion into rates that are held until the next sample.

    The plan reaches ahead by the expected sample period. Samples come later or earlier (PX4: after
    4 or 8 ms, ArduPilot: some in pairs); the vehicle then has turned further or less far than
    planned, and a step would bend. The next answer corrects this, after a pause for one period at
    most.

    Attributes:
        late: how much later than expected the sample came, s.
        step: time by which the plan advances, s.
    """

    __slots__ = ("_pitch", "_roll", "_share", "late", "period", "step")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget the rates that were sent."""
        self.period = self.late = self.step = self._roll = self._pitch = self._share = 0.0

    def take(self, dt: float) -> None:
        """Take the time since the last sample, s."""
        before = self.period or dt
        self.late = late = dt - before
        # Bounded, so that the plan always advances.
        self.period = period = before + _SHARE * max(min(late, before), -0.5 * dt / _SHARE)
        self.step = period + late
        self._share = min(late / period, 1.0)

    def rates(self, roll: float, pitch: float) -> tuple[float, float]:
        """Rates to send for the mean rates of the plan's newest step, all in rad/s."""
        self._roll = roll + self._share * (roll - self._roll)
        self._pitch = pitch + self._share * (pitch - self._pitch)
        return self._roll, self._pitch
