"""The error of the estimated vertical speed, found by comparison with the estimated height."""

from companion.attitude.rotation import clamp

_FILTER_BANDWIDTH = 0.5
"""Both poles of the filter, rad/s: slower than the height hold, quicker than a lap of a circle."""
_LONGEST_GAP = 0.5
"""Longest time between two positions from which the bias is learned, s."""
_LARGEST_BIAS = 0.15
"""The learned bias is clamped to ± this, m/s."""


class ClimbBias:
    """Corrects the vertical speed so that over seconds it agrees with the change of the height.

    If the accelerometer is wrong while the vehicle is tilted, the estimated vertical speed differs
    from the change of the estimated height: on a real PX4 by 0.02 to 0.04 m/s in circles at 5 to
    10 m/s. A height hold that uses this speed keeps a height error of 0.02 to 0.03 m.

    Attributes:
        bias: reported minus true vertical speed, m/s, positive down.
    """

    def __init__(self) -> None:
        self.bias = 0.0
        self._last_time = 0.0
        self._last_down: float | None = None
        self._last_speed = 0.0

    def corrected_speed(self, time: float, down: float, speed: float) -> float:
        """Take a vertical position and speed; return the speed without its bias, m/s.

        Args:
            time: vehicle time of position and speed, s.
            down: vertical position, m, positive down.
            speed: vertical speed, m/s, positive down.
        """
        dt, last_down = time - self._last_time, self._last_down
        mean_speed = 0.5 * (self._last_speed + speed)
        self._last_time, self._last_speed = time, speed
        if last_down is None or not 0.0 < dt < _LONGEST_GAP:
            self._last_down = down
            return speed - self.bias
        predicted = last_down + dt * (mean_speed - self.bias)
        position_error = down - predicted
        self._last_down = predicted + min(2.0 * _FILTER_BANDWIDTH * dt, 1.0) * position_error
        self.bias = clamp(self.bias - _FILTER_BANDWIDTH**2 * dt * position_error, _LARGEST_BIAS)
        return speed - self.bias
