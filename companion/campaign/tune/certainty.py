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
    errors = [np.array(score.true).reshape(samples, -1) for score in scores]
    complete = np.isfinite(np.hstack(errors)).all(axis=1)
    count = int(complete.sum())
    if count < 2:
        return None
    old, new = (each[complete] for each in errors)

    def pooled_compared(values: tuple[float, ...]) -> float:
        return pooled(np.array(values).reshape(samples, -1)[complete])

    draws = np.random.default_rng(_SEED).integers(count, size=(_RESAMPLES, count))
    old_resampled, new_resampled = _resampled(old, draws), _resampled(new, draws)
    better = np.mean(np.square(new), axis=1) < np.mean(np.square(old), axis=1)
    return Comparison(
        _interval(pooled(old), old_resampled),
        _interval(pooled(new), new_resampled),
        _interval(pooled(new) / pooled(old), new_resampled / old_resampled),
        (pooled_compared(before.estimated), pooled_compared(after.estimated)),
        (pooled_compared(before.estimate), pooled_compared(after.estimate)),
        int(better.sum()),
        count,
    )


def _resampled(errors: Floats, draws: "np.ndarray[tuple[int, ...], np.dtype[np.int64]]") -> Floats:
    """(resamples,): RMS error over the cases of the drawn samples, m.

    Args:
        errors: (samples, cases of a sample), RMS error of each case, m.
        draws: (resamples, samples), numbers of the drawn samples.
    """
    squares = np.mean(np.square(errors), axis=1)
    resampled: Floats = np.sqrt(np.mean(squares[draws], axis=1))
    return resampled


def _interval(value: float, resampled: Floats) -> Interval:
    """A value with the interval between the quantiles of its (resamples,) bootstrap values."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(resampled, (tail, 1.0 - tail))
    return Interval(value, float(low), float(high))
