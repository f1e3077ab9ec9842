"""Compares the result with the unchanged configuration on unseen cases, with 95 % intervals."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from companion.campaign.tune.scores import Floats, Score, pooled_rms

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
    """Two configurations compared on the same cases, with the same noise and gusts."""

    before: Interval
    """RMS horizontal distance of the true position from the reference, m, with the configuration
    before the search."""
    after: Interval
    """RMS horizontal distance of the true position from the reference, m, with the result of the
    search."""
    ratio: Interval
    """`after` / `before`."""
    estimated_errors: tuple[float, float]
    """RMS horizontal distance of the estimated position from the reference, m, before and after."""
    estimator_errors: tuple[float, float]
    """RMS horizontal distance of the estimated from the true position, m, before and after."""
    better_samples: int
    """Number of samples in which the result has the smaller RMS error."""
    samples: int


def compare(before: Score, after: Score, samples: int) -> Comparison | None:
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
    errors = [np.array(score.true_errors).reshape(samples, -1) for score in (before, after)]
    is_complete = np.isfinite(np.hstack(errors)).all(axis=1)
    count = int(is_complete.sum())
    if count < 2:
        return None
    mean_squares = [np.mean(np.square(each[is_complete]), axis=1) for each in errors]

    def pooled_complete(values: tuple[float, ...]) -> float:
        return pooled_rms(np.array(values).reshape(samples, -1)[is_complete])

    return Comparison(
        _interval(_rms, mean_squares[0]),
        _interval(_rms, mean_squares[1]),
        _interval(_ratio, *mean_squares),
        (pooled_complete(before.estimated_errors), pooled_complete(after.estimated_errors)),
        (pooled_complete(before.estimator_errors), pooled_complete(after.estimator_errors)),
        int(np.sum(mean_squares[1] < mean_squares[0])),
        count,
    )


def _rms(mean_squares: Floats, axis: int = -1) -> Any:
    """RMS error, m, from the mean squared error of each sample, m²."""
    return np.sqrt(np.mean(mean_squares, axis=axis))


def _ratio(before: Floats, after: Floats, axis: int = -1) -> Any:
    return _rms(after, axis) / _rms(before, axis)


def _interval(statistic: Callable[..., Any], *samples: Floats) -> Interval:
    """A statistic of paired samples, each (samples,), with its interval by bootstrap."""
    from scipy.stats import bootstrap  # noqa: PLC0415  takes a second to import

    interval = bootstrap(
        samples,
        statistic,
        paired=True,
        n_resamples=_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(_SEED),
    ).confidence_interval
    return Interval(float(statistic(*samples)), float(interval.low), float(interval.high))
