"""Compares the result with the unchanged configuration on unseen cases, with 95 % intervals."""

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
        before: RMS horizontal distance of the true position from the reference, m, with the
            configuration before the search.
        after: the same distance with the result of the search, m.
        ratio: after / before.
        estimated: RMS horizontal distance of the estimated position from the reference, m, before
            and after.
        estimate: RMS horizontal distance of the estimated from the true position, m, before and
            after.
        better: number of samples in which the result has the smaller RMS error.
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

    All cases of a sample are drawn together, because they have the same vehicle. A sample in which
    a flight ended early is left out, because it has no error.

    Args:
        before: score of the configuration before the search.
        after: score of the result.
        samples: number of samples, all with equally many cases, in the order of the scores.

    Returns:
        None if fewer than two samples were flown to their end with both configurations.
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
    """A value with the 95 % interval of its bootstrap values, (resamples,)."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(resampled, (tail, 1.0 - tail))
    return Interval(value, float(low), float(high))
