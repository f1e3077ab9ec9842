"""Time laws: the phase of a curve (progress along it) as a function of time."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, inf, pi, sin, sqrt
from typing import Any, NamedTuple, Protocol

from companion.guidance.trajectory.sample import TrajectoryError

SEPTIC_SLOPE = 2.1875
"""Largest slope of the septic blend 35u⁴ − 84u⁵ + 70u⁶ − 20u⁷, at u = 1/2: 140·(1/2)⁶."""


class Progress(NamedTuple):
    """The phase of a curve at one time, and its derivatives by time.

    Attributes:
        phase: phase in the curve's unit (rad, m or s).
        first_derivative, second_derivative, third_derivative: of the phase by time, in its unit
            per s, s², s³.
    """

    phase: float
    first_derivative: float = 0.0
    second_derivative: float = 0.0
    third_derivative: float = 0.0


Triple = tuple[Any, Any, Any]
"""A vector of numbers, or of arrays with the values at many times."""


def derivatives(
    progress: Progress, first: Triple, second: Triple, third: Triple
) -> tuple[Triple, Triple, Triple]:
    """Velocity, acceleration and jerk along a curve, by the chain rule.

    `first`, `second` and `third` are the derivatives of the curve by its phase.
    """
    _, r, s, t = progress
    return (
        _weighted_sum(first, r, second, 0.0, third, 0.0),
        _weighted_sum(first, s, second, r * r, third, 0.0),
        _weighted_sum(first, t, second, 3.0 * r * s, third, r * r * r),
    )


def _weighted_sum(a: Triple, x: Any, b: Triple, y: Any, c: Triple, z: Any) -> Triple:
    """x·a + y·b + z·c."""
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
    )


class Piece(NamedTuple):
    """A part of a time law in which its derivatives are smooth.

    Attributes:
        begin, end: times, s.
        is_steady: whether the rate of the phase is constant.
    """

    begin: float
    end: float
    is_steady: bool


class TimeLaw(Protocol):
    """Progress along a curve over time."""

    def pieces(self) -> Sequence[Piece]:
        """The smooth parts of the law, in order, from 0 to the duration."""

    @property
    def duration(self) -> float:
        """Duration, s."""

    def at(self, time: float) -> Progress:
        """Progress at `time`; at rest before 0 and past the duration."""


Ramp = Callable[[float, float, float], Progress]
"""(steady rate, 1/s; duration, s; time, s) → progress while the rate rises from 0."""


def septic_ramp(rate: float, duration: float, time: float) -> Progress:
    """Progress at the phase rate `rate`·(35u⁴ − 84u⁵ + 70u⁶ − 20u⁷), where u = time/duration."""
    u = time / duration
    v = 1.0 - u
    u3 = u * u * u
    return Progress(
        rate * duration * u3 * u * u * (7.0 + u * (-14.0 + u * (10.0 - 2.5 * u))),
        rate * u3 * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u))),
        rate / duration * 140.0 * u3 * v * v * v,
        rate / (duration * duration) * 420.0 * u * u * v * v * (1.0 - 2.0 * u),
    )


def cosine_ramp(rate: float, duration: float, time: float) -> Progress:
    """Progress whose rate is a raised cosine: the jerk jumps where the ramp begins and ends."""
    omega = pi / duration
    phase = omega * time
    return Progress(
        0.5 * rate * (time - sin(phase) / omega),
        0.5 * rate * (1.0 - cos(phase)),
        0.5 * rate * omega * sin(phase),
        0.5 * rate * omega * omega * cos(phase),
    )


@dataclass(frozen=True, slots=True)
class Cruise:
    """A steady rate with a ramp at each end.

    Without ramps the rate is steady from the start, for curves that are at rest at their ends.

    Attributes:
        length: phase at the end; the phase begins at 0.
        rate: steady rate of the phase, per s.
        rise_time: time in which the rate rises, s.
        fall_time: time in which the rate falls, s.
        ramp: how the rate rises and, mirrored, falls. The mean rate of a ramp must be half the
            steady rate.
    """

    length: float
    rate: float
    rise_time: float = 0.0
    fall_time: float = 0.0
    ramp: Ramp = septic_ramp

    @property
    def duration(self) -> float:
        """Time for the whole length at the steady rate, plus half of each ramp, s."""
        return self.length / self.rate + 0.5 * (self.rise_time + self.fall_time)

    def pieces(self) -> list[Piece]:
        """Three parts: speeding up, steady, slowing down."""
        fall_begin = self.duration - self.fall_time
        return [
            Piece(0.0, self.rise_time, False),
            Piece(self.rise_time, fall_begin, True),
            Piece(fall_begin, self.duration, False),
        ]

    def at(self, time: float) -> Progress:
        """Progress at `time`."""
        remaining = self.duration - time
        if time < 0.0:
            return Progress(0.0)
        if remaining < 0.0:
            return Progress(self.length)
        if time < self.rise_time:
            return self.ramp(self.rate, self.rise_time, time)
        if remaining < self.fall_time:
            phase, first, second, third = self.ramp(self.rate, self.fall_time, remaining)
            return Progress(self.length - phase, first, -second, third)
        return Progress(self.rate * (time - 0.5 * self.rise_time), self.rate)


_CRUISING_PIECE = 3
"""Index of the piece at constant speed among the seven pieces of constant jerk."""


class LimitedJerk:
    """From rest to rest in seven pieces of constant jerk: the fastest within the three limits.

    Biagiotti & Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008),
    section 3.4, double S with equal limits in both directions.
    """

    def __init__(self, length: float, speed: float, acceleration: float, jerk: float) -> None:
        """Compute the seven pieces.

        Args:
            length: distance, m.
            speed: largest speed, m/s; reached if `length` allows.
            acceleration: largest acceleration, m/s².
            jerk: largest jerk, m/s³.

        Raises:
            TrajectoryError: a value is not positive and finite.
        """
        if not all(0.0 < value < inf for value in (length, speed, acceleration, jerk)):
            raise TrajectoryError(
                "length, speed, acceleration and jerk of a line must be positive and finite"
            )
        jerk_time = min(acceleration / jerk, sqrt(speed / jerk))
        ramp = jerk_time + speed / (jerk * jerk_time)
        cruise_time = length / speed - ramp
        if cruise_time < 0.0:
            cruise_time = 0.0
            jerk_time = min(acceleration / jerk, (length / (2.0 * jerk)) ** (1.0 / 3.0))
            ramp = jerk_time / 2.0 + sqrt(jerk_time**2 / 4.0 + length / (jerk * jerk_time))
        steady_time = max(ramp - 2.0 * jerk_time, 0.0)
        self._length = length
        rise = ((jerk_time, jerk), (steady_time, 0.0), (jerk_time, -jerk))
        fall = ((jerk_time, -jerk), (steady_time, 0.0), (jerk_time, jerk))
        self._pieces = _joined_pieces((*rise, (cruise_time, 0.0), *fall))
        self._piece_ends = [start for start, _, _ in self._pieces[1:]]
        self.duration = 2.0 * ramp + cruise_time

    def pieces(self) -> list[Piece]:
        """The seven pieces of constant jerk."""
        begins = [start for start, _, _ in self._pieces]
        time_spans = zip(begins, [*begins[1:], self.duration], strict=True)
        return [
            Piece(begin, end, k == _CRUISING_PIECE) for k, (begin, end) in enumerate(time_spans)
        ]

    def at(self, time: float) -> Progress:
        """Progress at `time`."""
        if time < 0.0:
            return Progress(0.0)
        if time >= self.duration:
            return Progress(self._length)
        index = bisect_right(self._piece_ends, time)
        start, state, jerk = self._pieces[index]
        return _after_constant_jerk(state, jerk, time - start)


_JerkPiece = tuple[float, Progress, float]
"""(beginning in s, progress there, jerk)."""


def _joined_pieces(jerks: Sequence[tuple[float, float]]) -> list[_JerkPiece]:
    """Join pieces (duration s, constant jerk) into one motion that begins at rest."""
    pieces = []
    start, state = 0.0, Progress(0.0)
    for duration, jerk in jerks:
        pieces.append((start, state, jerk))
        start, state = start + duration, _after_constant_jerk(state, jerk, duration)
    return pieces


def _after_constant_jerk(state: Progress, jerk: float, time: float) -> Progress:
    """State after `time` s of constant jerk."""
    s, v, a, _ = state
    return Progress(
        s + time * (v + time * (a / 2.0 + time * jerk / 6.0)),
        v + time * (a + time * jerk / 2.0),
        a + time * jerk,
        jerk,
    )
