"""The error of the estimated vertical speed, found by comparison with the estimated height."""

from companion.attitude.rotation import clamp

_FILTER_BANDWIDTH = 0.5
"""Both poles of the filter, rad/s: slower than the height hold, quicker than a lap."""
_LONGEST_GAP = 0.5
"""Longest time between two heights from which the error is learned, s."""
_LARGEST_BIAS = 0.15
"""Largest error that is believed, m/s."""


class ClimbBias:
    """Corrects the vertical speed so that over seconds it agrees with the change of the height.

    An estimator whose accelerometer is wrong while the vehicle is tilted reports a vertical speed
    that its own height does not follow. On a real PX4 the two differ by 0.02 to 0.04 m/s in circles
    at 5 to 10 m/s, and a height hold that believes this speed stays 0.02 to 0.03 m off.

    Attributes:
        bias: reported minus true vertical speed, m/s, positive down.
    """

    def __init__(self) -> None:
        self.bias = 0.0
        self._time = 0.0
        self._height: float | None = None
        self._speed = 0.0

    def corrected(self, time: float, height: float, speed: float) -> float:
        """Take a height and a vertical speed; return the speed without its bias.

        Args:
            time: vehicle time of both, s.
            height: m, positive down.
            speed: m/s, positive down.
        """
        dt, before, mean = time - self._time, self._height, 0.5 * (self._speed + speed)
        self._time, self._speed = time, speed
        if before is None or not 0.0 < dt < _LONGEST_GAP:
            self._height = height
            return speed - self.bias
        predicted = before + dt * (mean - self.bias)
        error = height - predicted
        self._height = predicted + min(2.0 * _FILTER_BANDWIDTH * dt, 1.0) * error
        self.bias = clamp(self.bias - _FILTER_BANDWIDTH**2 * dt * error, _LARGEST_BIAS)
        return speed - self.bias
