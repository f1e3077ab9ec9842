"""Detects an estimated heading that drifts from the true one, as by a disturbed compass."""

from collections import deque

from companion.control.estimator_resets import EstimatorResets

_DRIFT_WINDOW = 20.0
"""Time over which the drift is counted, s: a constant error of the gyro must not add up."""
_SCALE_ERROR = 0.05
"""Assumed largest scale error of a gyro. In a turn this error looks like a drift of the heading."""


class HeadingDrift:
    """Sums the estimator's gradual heading corrections over the last `_DRIFT_WINDOW`."""

    def __init__(self, resets: EstimatorResets) -> None:
        self._resets = resets
        self._history: deque[tuple[float, float, float]] = deque()

    def begin(self) -> None:
        """Forget all drift up to now."""
        self._history.clear()

    def drift(self, now: float) -> float:
        """Heading change that neither body rates nor jumps explain, rad; `now` in s.

        What a scale error of the gyro can explain is subtracted.
        """
        history, resets = self._history, self._resets
        history.append((now, resets.heading_corrections, resets.total_turn))
        while now - history[0][0] > _DRIFT_WINDOW:
            history.popleft()
        _, corrections_before, turned_before = history[0]
        unexplained = abs(resets.heading_corrections - corrections_before)
        return max(0.0, unexplained - _SCALE_ERROR * (resets.total_turn - turned_before))
