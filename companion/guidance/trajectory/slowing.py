"""A trajectory slowed down where it breaks limits, and no more than that takes.

The path stays as it is; only its time changes. First each moment is asked how much slower it would
have to be flown if all were flown so. A smooth slowness at least as large as that (`SlowerTime`)
then takes the speed away before it and gives it back after it. Its ramps need acceleration
themselves, so the limits are checked again with them, and the slowness is raised where they are
broken. If no such slowness is quicker than an even one, all of the trajectory is slowed down alike.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from companion.guidance.trajectory.demand import Floats, Motion, sampled
from companion.guidance.trajectory.derived import Slowed, evenly_slowed
from companion.guidance.trajectory.feasibility import Envelope, Violation, broken_limits, excess
from companion.guidance.trajectory.sample import LONGEST, Trajectory, TrajectoryError, computable
from companion.guidance.trajectory.slower_time import SlowerTime

_SLOWEST = 64.0
"""The largest factor tried."""
_PRECISION = 1e-3
"""Of the factor, as a share of it."""
_HALVINGS = 16
"""Of the range of a moment's factor."""
_WIDTHS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Widths of the pieces of the slowness that are tried, s; a ramp takes four pieces or more."""
_FEWEST_PIECES = 4
_ROUNDS = 60
"""Most times that the slowness is raised."""
_LEAST_RAISE, _LARGEST_RAISE = 0.004, 0.1
_MOST_MOMENTS = 20_000
"""Moments of a trajectory that is slowed down in parts; the search then takes some seconds."""
_EVEN_MOMENTS, _SHORTEST_STEP, _MOMENTS_A_PIECE = 8000, 0.006, 8.0
"""Of them, at equal distances: how many at most, their step in s at least, and how many a piece of
the slowness takes at least, so that no extreme of its ramps is missed."""
_GAP = 3.0
"""A gap between two check times, in usual ones, from which on moments are filled in."""
_WORTH = 0.98
"""Slowing down in parts must last less than this share of slowing down evenly."""
_NOTICEABLE = 1.02
"""A part counts as slowed down from this factor on."""
_NEAR_SLOWEST = 0.9
"""Share of the slowing down from which on a moment is near the slowest."""
_FILLED = 2.0
"""Time between moments that are filled in, in usual gaps."""


class SlowedPart(NamedTuple):
    """A part of a trajectory that is flown more slowly.

    Attributes:
        begin, end: of the slowed trajectory, s.
        factor: the largest, by which the speed is divided.
        time: when it is slowest, s.
        limit: the key of the limit that asks for it.
    """

    begin: float
    end: float
    factor: float
    time: float
    limit: str


class SlowDown(NamedTuple):
    """A trajectory within its limits.

    Attributes:
        trajectory: as it can be flown.
        parts: what was slowed down of it, in order; empty: nothing had to be.
        even: whether all of it was slowed down alike.
        reason: why it was, as the end of a sentence.
    """

    trajectory: Trajectory
    parts: tuple[SlowedPart, ...] = ()
    even: bool = False
    reason: str = ""


def slow_down(trajectory: Trajectory, envelope: Envelope) -> SlowDown:
    """The trajectory as it is if it keeps all limits, else slowed down until it does.

    Raises:
        TrajectoryError: however slowly it is flown, it breaks a limit.
    """
    with computable():
        motion = sampled(trajectory)
        broken = broken_limits(motion, envelope)
        if not broken:
            return SlowDown(trajectory)
        factor = _even_factor(trajectory, motion, broken, envelope)
        even = evenly_slowed(trajectory, factor)
        worst = max(broken, key=lambda one: one.time)
        whole = SlowedPart(0.0, even.duration, factor, factor * worst.time, worst.limit)
        moments = _moments(motion.times)
        if moments.size > _MOST_MOMENTS:
            reason = "it is too long to be slowed down in parts"
            return SlowDown(even, (whole,), True, reason)
        fine = sampled(trajectory, moments.tolist())
        if broken_limits(fine.slowed(factor), envelope):  # a finer look found more
            reason = "it cannot be looked at finely enough"
            return SlowDown(even, (whole,), True, reason)
        best = _best_law(fine, trajectory.duration, envelope)
        if best is None or best.duration > _WORTH * even.duration:
            reason = "slowing down in parts would not be quicker"
            return SlowDown(even, (whole,), True, reason)
        slower = Slowed(trajectory, best, tuple(moments.tolist()))
        return SlowDown(slower, tuple(_parts(fine, best, envelope)))


def _even_factor(
    trajectory: Trajectory, motion: Motion, broken: tuple[Violation, ...], envelope: Envelope
) -> float:
    """The smallest factor by which all of it may be slowed down."""
    for one in broken:
        if not one.slowing_helps:
            raise TrajectoryError(f"{trajectory.name}: {one}; {one.remedy}")
    too_fast, slow = 1.0, 2.0
    while found := broken_limits(motion.slowed(slow), envelope):
        too_fast, slow = slow, 2.0 * slow
        if slow > _SLOWEST:
            raise TrajectoryError(
                f"{trajectory.name}: however slowly it is flown, {found[0]}; {found[0].remedy}"
            )
    while slow - too_fast > _PRECISION * too_fast:
        middle = 0.5 * (too_fast + slow)
        if broken_limits(motion.slowed(middle), envelope):
            too_fast = middle
        else:
            slow = middle
    return slow


def _moments(times: Floats) -> Floats:
    """The check times, with those of laps that are alike filled in: now they may differ."""
    gaps = np.diff(times)
    usual = float(np.median(gaps[gaps > 0.0])) if gaps.size else 1.0
    length = float(times[-1])
    parts = [times, np.linspace(0.0, length, int(length / _step(length)) + 2)]
    for k in np.flatnonzero(gaps > _GAP * usual):
        count = min(int(gaps[k] / (_FILLED * usual)), _MOST_MOMENTS)
        parts.append(np.linspace(times[k], times[k + 1], count + 1))
    return np.unique(np.concatenate(parts))


def _step(length: float) -> float:
    """Largest time between two moments, s."""
    return max(_SHORTEST_STEP, length / _EVEN_MOMENTS)


def _best_law(motion: Motion, length: float, envelope: Envelope) -> SlowerTime | None:
    """The quickest of the slownesses of several widths; None if none keeps the limits."""
    needed = _needed_factors(motion, envelope)
    least = _MOMENTS_A_PIECE * _step(length)
    widths = [w for w in _WIDTHS if w >= least and length / w >= _FEWEST_PIECES]
    laws = [_law(motion, needed, length, width, envelope) for width in widths]
    return min((law for law in laws if law), key=lambda law: law.duration, default=None)


def _needed_factors(motion: Motion, envelope: Envelope) -> Floats:
    """How much slower each moment must be flown if all are flown so, (m,)."""
    low, high = np.zeros_like(motion.times), np.full_like(motion.times, np.log(_SLOWEST))
    high[_over(motion, envelope) <= 0.0] = 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        over = _over(motion.slowed(np.exp(middle)), envelope) > 0.0
        low, high = np.where(over, middle, low), np.where(over, high, middle)
    return np.exp(high)


def _over(motion: Motion, envelope: Envelope) -> Floats:
    """The largest excess of a limit at each moment, (m,)."""
    nothing = np.full_like(motion.times, -1.0)
    over: Floats = np.max([nothing, *excess(motion, envelope).values()], axis=0)
    return over


def _law(
    motion: Motion, needed: Floats, length: float, width: float, envelope: Envelope
) -> SlowerTime | None:
    """The slowness of this width, raised until all limits are kept; None if that fails."""
    count = int(np.ceil(length / width))
    which = np.clip((motion.times * (count / length)).astype(int), 0, count - 1)
    most = np.ones(count)
    np.maximum.at(most, which, needed)
    coefficients = _over_four(most, 1.0)
    for _ in range(_ROUNDS):
        law = SlowerTime(length, tuple(coefficients.tolist()))
        if law.duration > LONGEST or coefficients.max() > _SLOWEST:
            return None
        slower = motion.retimed(*law.of(motion.times))
        over = _over(slower, envelope)
        if envelope.fence is not None and (found := envelope.fence(slower)) is not None:
            late = (slower.times >= found.begins) & (slower.times <= found.time)
            over = np.where(late, np.maximum(over, _LARGEST_RAISE), over)
        if not (over > 0.0).any():
            return law
        raised = np.zeros(count)
        np.maximum.at(raised, which, np.where(over > 0.0, over, 0.0))
        raised = np.where(raised > 0.0, np.clip(0.5 * raised, _LEAST_RAISE, _LARGEST_RAISE), 0.0)
        coefficients *= 1.0 + _over_four(raised, 0.0)
    return None


def _over_four(values: Floats, beyond: float) -> Floats:
    """The largest of the four pieces (n,) that each coefficient (n + 3,) touches."""
    padded = np.concatenate(([beyond] * 3, values, [beyond] * 3))
    largest: Floats = np.max([padded[k : k + values.size + 3] for k in range(4)], axis=0)
    return largest


def _parts(motion: Motion, law: SlowerTime, envelope: Envelope) -> Iterator[SlowedPart]:
    """The parts that a slowness slows down, each with the limit that asks for it."""
    times, progress = law.of(motion.times)
    factors = 1.0 / np.asarray(progress.first)
    slow = np.concatenate(([False], factors > _NOTICEABLE, [False]))
    edges = np.flatnonzero(np.diff(slow.astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        slowest = begin + int(factors[begin:end].argmax())
        near = np.flatnonzero(factors[begin:end] - 1.0 >= _NEAR_SLOWEST * (factors[slowest] - 1.0))
        yield SlowedPart(
            float(times[begin]),
            float(times[end - 1]),
            float(factors[slowest]),
            float(times[slowest]),
            _limit(motion, envelope, begin + near) or _limit(motion, envelope, slice(begin, end)),
        )


def _limit(motion: Motion, envelope: Envelope, moments: Any) -> str:
    """The limit that is exceeded most at some moments at the old speed; the fence if none is."""
    most = {name: float(over[moments].max()) for name, over in excess(motion, envelope).items()}
    limit = max(most, key=most.__getitem__, default="")
    if limit and most[limit] > 0.0:
        return limit
    found = None if envelope.fence is None else envelope.fence(motion)
    return "" if found is None else found.limit
