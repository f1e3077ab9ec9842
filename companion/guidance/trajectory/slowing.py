"""Slows a trajectory down where it breaks limits.

The path stays the same; only its timing changes. Limits are checked at many times.

1. For each time, find the needed factor: if the whole trajectory were slowed down by it, this
   time would keep all limits except the fence.
2. Find a smooth function of time, the stretch factor (`SlowerTime`), that is nowhere below the
   needed factor. With it the vehicle brakes before a slow part and speeds up after it.
3. Braking needs acceleration: check limits again; where one is broken, raise the stretch factor.

If slowing down in parts saves hardly any time, the whole trajectory is slowed down by one factor.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from companion.guidance.trajectory.demand import Motion, sampled_motion
from companion.guidance.trajectory.derived import (
    SlowDown,
    Slowed,
    SlowedPart,
    evenly_slowed,
)
from companion.guidance.trajectory.feasibility import Envelope, Violation, broken_limits, excess
from companion.guidance.trajectory.sample import (
    LONGEST_DURATION,
    Trajectory,
    TrajectoryError,
    reporting_numerical_errors,
)
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.slower_time import SlowerTime

_LARGEST_FACTOR = 64.0
"""Largest slowing factor that is tried."""
_FACTOR_PRECISION = 1e-3
"""Relative precision of a factor."""
_BISECTIONS = 16
"""Number of bisection steps in the search for the factor of one check time."""
_PIECE_DURATIONS, _FEWEST_PIECES = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2), 4
"""Durations of one piece of the stretch factor to try, s, and the smallest number of pieces."""
_MAX_ITERATIONS = 60
"""Largest number of times that the stretch factor is raised before the search gives up."""
_LEAST_RAISE, _LARGEST_RAISE = 0.004, 0.1
"""Smallest and largest relative increase of the stretch factor in one round."""
_MAX_CHECK_TIMES = 20_000
"""Largest number of check times for slowing down in parts. The search then takes some seconds."""
_MAX_EVEN_CHECK_TIMES = 8000
"""Largest number of evenly spaced check times."""
_SHORTEST_CHECK_STEP = 0.006
"""Shortest step between evenly spaced check times, s."""
_CHECK_TIMES_PER_PIECE = 8.0
"""Smallest number of check times in each piece of the stretch factor; with fewer, an extreme could
be missed."""
_LONG_GAP_FACTOR = 3.0
"""A gap between check times is filled if it is this many times as long as the median gap."""
_WORTHWHILE_FRACTION = 0.98
"""Slowing down in parts is used if it takes less than this share of the time of slowing evenly."""
_NOTICEABLE_FACTOR = 1.02
"""Smallest factor that counts as slowing down."""
_NEAR_SLOWEST = 0.9
"""Times with at least this share of the largest (factor − 1) count as near the slowest time."""
_FILL_STEP_FACTOR = 2.0
"""Time between the check times that fill a gap, as a multiple of the median gap."""


def slow_down(trajectory: Trajectory, envelope: Envelope) -> SlowDown:
    """The trajectory unchanged if it keeps all limits, else slowed down until it does.

    Raises:
        TrajectoryError: the trajectory breaks a limit at any speed, cannot be computed, or is too
            long to be checked, as it is or slowed down.
    """
    with reporting_numerical_errors():
        motion = sampled_motion(trajectory)
        broken = broken_limits(motion, envelope)
        if not broken:
            return SlowDown(trajectory)
        part = _slowed_evenly(trajectory, motion, broken, envelope)
        uniform = SlowDown(evenly_slowed(trajectory, part.factor), (part,), is_even=True)
        slower = _slowed_in_parts(trajectory, motion, uniform, envelope)
        if slower.trajectory.duration > LONGEST_DURATION:
            raise TrajectoryError(
                f"{trajectory.name}: slowed down to keep {part.limit}, it lasts "
                f"{slower.trajectory.duration:.4g} s, and {LONGEST_DURATION:.0f} s is the longest; "
                "make it shorter, or change the limit"
            )
        return slower


def _slowed_in_parts(
    trajectory: Trajectory, motion: Motion, uniform: SlowDown, envelope: Envelope
) -> SlowDown:
    """The trajectory slowed down in parts, or `uniform` with the reason why not."""
    times = _denser_times(motion.times)
    if times.size > _MAX_CHECK_TIMES:
        return uniform._replace(reason="it is too long to be slowed down in parts")
    dense_motion = sampled_motion(trajectory, times.tolist())
    (whole_part,) = uniform.parts
    if broken_limits(dense_motion.slowed(whole_part.factor), envelope):
        return uniform._replace(reason="a finer check found more limits exceeded")
    law = _best_law(dense_motion, trajectory.duration, envelope)
    if law is None or law.duration > _WORTHWHILE_FRACTION * uniform.trajectory.duration:
        return uniform._replace(reason="slowing down in parts would not be quicker")
    slowed = Slowed(trajectory, law, tuple(times.tolist()))
    return SlowDown(slowed, tuple(_slowed_parts(dense_motion, law, envelope)))


def _slowed_evenly(
    trajectory: Trajectory, motion: Motion, broken: tuple[Violation, ...], envelope: Envelope
) -> SlowedPart:
    """The whole trajectory, slowed evenly; raises `TrajectoryError` if no factor is enough."""
    for violation in broken:
        if not violation.slowing_helps:
            raise TrajectoryError(f"{trajectory.name}: {violation}; {violation.remedy}")
    too_small, factor, last = 1.0, 2.0, broken[0]
    while found := broken_limits(motion.slowed(factor), envelope):
        too_small, factor, last = factor, 2.0 * factor, found[0]
        if factor > _LARGEST_FACTOR:
            raise TrajectoryError(
                f"{trajectory.name}: however slowly it is flown, {found[0]}; {found[0].remedy}"
            )
    while factor - too_small > _FACTOR_PRECISION * too_small:
        middle = 0.5 * (too_small + factor)
        if found := broken_limits(motion.slowed(middle), envelope):
            too_small, last = middle, found[0]
        else:
            factor = middle
    end = trajectory.duration * factor
    return SlowedPart(0.0, end, factor, last.time * factor / too_small, last.limit)


def _denser_times(times: Floats) -> Floats:
    """Check times, evenly spaced times, and times that fill long gaps (laps without checks).

    The ends of the pieces of each stretch factor are among them: the jerk has its peaks there.
    """
    gaps = np.diff(times)
    median_gap = float(np.median(gaps[gaps > 0.0])) if gaps.size else 1.0
    duration = float(times[-1])
    time_arrays = [times, np.linspace(0.0, duration, int(duration / _check_step(duration)) + 2)]
    time_arrays += [np.linspace(0.0, duration, count + 1) for count in _piece_counts(duration)]
    for k in np.flatnonzero(gaps > _LONG_GAP_FACTOR * median_gap):
        count = min(int(gaps[k] / (_FILL_STEP_FACTOR * median_gap)), _MAX_CHECK_TIMES)
        time_arrays.append(np.linspace(times[k], times[k + 1], count + 1))
    return np.unique(np.concatenate(time_arrays))


def _check_step(duration: float) -> float:
    """Largest step between the times at which a trajectory of `duration` s is checked, s."""
    return max(_SHORTEST_CHECK_STEP, duration / _MAX_EVEN_CHECK_TIMES)


def _piece_counts(duration: float) -> list[int]:
    """The numbers of pieces to try for the stretch factor of a trajectory of `duration` s."""
    shortest, longest = _CHECK_TIMES_PER_PIECE * _check_step(duration), duration / _FEWEST_PIECES
    return [
        int(np.ceil(duration / each)) for each in _PIECE_DURATIONS if shortest <= each <= longest
    ]


def _best_law(motion: Motion, duration: float, envelope: Envelope) -> SlowerTime | None:
    """The time law by which the flight is shortest; None: none was found that keeps the limits."""
    needed = _needed_factors(motion, envelope)
    counts = _piece_counts(duration)
    laws = [_law_with_pieces(motion, needed, duration, count, envelope) for count in counts]
    return min((law for law in laws if law), key=lambda law: law.duration, default=None)


def _needed_factors(motion: Motion, envelope: Envelope) -> Floats:
    """The needed factor at each time, (m,); see step 1 in the module's docstring."""
    low, high = np.zeros_like(motion.times), np.full_like(motion.times, np.log(_LARGEST_FACTOR))
    high[_largest_excess(motion, envelope) <= 0.0] = 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        is_broken = _largest_excess(motion.slowed(np.exp(middle)), envelope) > 0.0
        low, high = np.where(is_broken, middle, low), np.where(is_broken, high, middle)
    return np.exp(high)


def _largest_excess(motion: Motion, envelope: Envelope) -> Floats:
    """The largest relative excess over any limit but the fence at each time, (m,)."""
    without_limits = np.full_like(motion.times, -1.0)
    return np.asarray(np.max([without_limits, *excess(motion, envelope).values()], axis=0))


def _law_with_pieces(
    motion: Motion, needed: Floats, duration: float, count: int, envelope: Envelope
) -> SlowerTime | None:
    """A stretch factor of at least `needed` (m,), of `count` pieces. None: none was found."""
    index = np.clip((motion.times * (count / duration)).astype(int), 0, count - 1)
    needed_by_piece = np.ones(count)
    np.maximum.at(needed_by_piece, index, needed)
    coefficients = _largest_of_four(needed_by_piece, 1.0)
    for _ in range(_MAX_ITERATIONS):
        law = SlowerTime(duration, tuple(coefficients.tolist()))
        if law.duration > LONGEST_DURATION or coefficients.max() > _LARGEST_FACTOR:
            return None
        slower = motion.retimed(*law.stretched_times(motion.times))
        over = _largest_excess(slower, envelope)
        if envelope.fence is not None and (breach := envelope.fence(slower)) is not None:
            is_outside = (slower.times >= breach.begin_time) & (slower.times <= breach.time)
            over = np.where(is_outside, np.maximum(over, _LARGEST_RAISE), over)
        if not (over > 0.0).any():
            return law
        raises = np.zeros(count)
        np.maximum.at(raises, index, np.where(over > 0.0, over, 0.0))
        raises = np.where(raises > 0.0, np.clip(0.5 * raises, _LEAST_RAISE, _LARGEST_RAISE), 0.0)
        coefficients *= 1.0 + _largest_of_four(raises, 0.0)
    return None


def _largest_of_four(values: Floats, padding: float) -> Floats:
    """(n + 3,), for each B-spline coefficient the largest of the 4 (padded) `values` it affects."""
    padded = np.pad(values, 3, constant_values=padding)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 4).max(axis=1))


def _slowed_parts(motion: Motion, law: SlowerTime, envelope: Envelope) -> Iterator[SlowedPart]:
    """The parts that a stretch factor slows down, each with the limit that requires it."""
    times, progress = law.stretched_times(motion.times)
    factors = 1.0 / np.asarray(progress.first_derivative)
    is_slow = np.concatenate(([False], factors > _NOTICEABLE_FACTOR, [False]))
    edges = np.flatnonzero(np.diff(is_slow.astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        slowest = begin + int(factors[begin:end].argmax())
        near = np.flatnonzero(factors[begin:end] - 1.0 >= _NEAR_SLOWEST * (factors[slowest] - 1.0))
        yield SlowedPart(
            float(times[begin]),
            float(times[end - 1]),
            float(factors[slowest]),
            float(times[slowest]),
            _most_exceeded_limit(motion, envelope, begin + near)
            or _most_exceeded_limit(motion, envelope, slice(begin, end)),
        )


def _most_exceeded_limit(motion: Motion, envelope: Envelope, indices: Any) -> str:
    """Key of the limit exceeded most at `indices`, else of the breached fence limit, else ""."""
    excesses = {name: float(over[indices].max()) for name, over in excess(motion, envelope).items()}
    limit = max(excesses, key=excesses.__getitem__, default="")
    if limit and excesses[limit] > 0.0:
        return limit
    breach = None if envelope.fence is None else envelope.fence(motion)
    return "" if breach is None else breach.limit
