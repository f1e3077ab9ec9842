"""Detects an estimated height that contradicts its own vertical speed, as by a barometer's jump."""

from collections import deque

from companion.control.estimator_resets import EstimatorResets
from companion.vehicle.records import LocalPosition

_WINDOW = 3.0
"""Time over which height and vertical speed are compared, s."""
_LONGEST_GAP = 0.5
"""Longest time between two positions over which the vertical speed is integrated, s."""


class HeightContradiction:
    """Compares the change of the height in the last `_WINDOW` with the integral of its speed."""

    def __init__(self, resets: EstimatorResets) -> None:
        self._resets = resets
        self._previous: LocalPosition | None = None
        self._speed_integral = 0.0
        # (vehicle time, s; height that the speed does not explain, m)
        self._history: deque[tuple[float, float]] = deque()

    def begin(self) -> None:
        """Forget all positions up to now."""
        self._previous = None
        self._history.clear()

    def unexplained_change(self, position: LocalPosition | None) -> float:
        """Take the newest position; return the change of height that its speed does not explain, m.

        Jumps of the estimate are left out; the monitors of resets judge them.
        """
        history, previous = self._history, self._previous
        if position is not None and position is not previous:
            dt = 0.0 if previous is None else position.vehicle_time - previous.vehicle_time
            if previous is None or not 0.0 <= dt <= _LONGEST_GAP:
                history.clear()
            else:
                mean_speed = 0.5 * (previous.velocity_ned[2] + position.velocity_ned[2])
                self._speed_integral += mean_speed * dt
            self._previous = position
            down = position.position_ned[2] - self._resets.position_shift[2]
            history.append((position.vehicle_time, down - self._speed_integral))
            while position.vehicle_time - history[0][0] > _WINDOW:
                history.popleft()
        return abs(history[-1][1] - history[0][1]) if history else 0.0
