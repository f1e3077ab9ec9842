"""How certain a result is: it is compared with the unchanged configuration on unseen cases."""

from typing import NamedTuple

import numpy as np

from companion.campaign.tune.scores import Floats, Score, pooled

CONFIDENCE = 0.95
_RESAMPLES = 4000
_SEED = 1


class Interval(NamedTuple):
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3f} ({self.low:.3f} to {self.high:.3f})"


class Comparison(NamedTuple):
    """Two configurations compared on the same cases, with the same noise and gusts.

    Attributes:
        before: RMS of the true horizontal error with the configuration before the search, m.
        after: the same with the result, m.
        ratio: after / before.
        estimated: RMS of the horizontal distance of the estimated position from the reference,
            before and after, m.
        estimate: RMS of the horizontal error of the position estimate itself, before and after, m.
        better: number of samples in which the result is better.
        samples: number of samples that were compared.
    """

    before: Interval
    after: Interval
    ratio: Interval
    estimated: tuple[float, float]
    estimate: tuple[float, float]
    better: int
    samples: int


def compared(before: Score, after: Score, samples: int) -> Comparison | None:
    """Compare two scores on the same cases, by a paired bootstrap over the samples.

    All cases of a sample are drawn together, because their vehicle is the same. A sample with a
    flight that ended early has no error and is left out.

    Args:
        before: score of the configuration before the search.
        after: score of the result.
        samples: number of samples that the cases belong to, in order; all have equally many cases.

    Returns:
        None if fewer than two samples were flown to their end by both.
    """
    scores = before, after
    rows = [np.array(score.true).reshape(samples, -1) for score in scores]
    whole = np.isfinite(np.hstack(rows)).all(axis=1)
    count = int(whole.sum())
    if count < 2:
        return None
    old, new = (each[whole] for each in rows)

    def same_flights(values: tuple[float, ...]) -> float:
        return pooled(np.array(values).reshape(samples, -1)[whole])

    drawn = np.random.default_rng(_SEED).integers(count, size=(_RESAMPLES, count))
    old_spread, new_spread = _resampled(old, drawn), _resampled(new, drawn)
    better = np.mean(np.square(new), axis=1) < np.mean(np.square(old), axis=1)
    return Comparison(
        _interval(pooled(old), old_spread),
        _interval(pooled(new), new_spread),
        _interval(pooled(new) / pooled(old), new_spread / old_spread),
        (same_flights(before.estimated), same_flights(after.estimated)),
        (same_flights(before.estimate), same_flights(after.estimate)),
        int(better.sum()),
        count,
    )


def _resampled(rows: Floats, drawn: "np.ndarray[tuple[int, ...], np.dtype[np.int64]]") -> Floats:
    """(resamples,) RMS over the cases of the drawn samples."""
    squares = np.mean(np.square(rows), axis=1)
    found: Floats = np.sqrt(np.mean(squares[drawn], axis=1))
    return found


def _interval(value: float, spread: Floats) -> Interval:
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(spread, (tail, 1.0 - tail))
    return Interval(value, float(low), float(high))
