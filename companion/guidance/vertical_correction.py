"""Corrects the estimated height and vertical speed, which contradict each other."""

from math import exp
from typing import NamedTuple

from companion.attitude.rotation import clamp

_BIAS_BANDWIDTH = 0.5
"""Both poles of the filter of the bias, rad/s: slower than the height hold, quicker than a lap of a
circle."""
_LARGEST_BIAS = 0.15
"""The learned bias is clamped to ± this, m/s."""
_ESTIMATOR_TIME = 1.2
"""Time constant with which the estimator corrects its height, s. The true heights of 54 flights fit
1.0 s on ArduPilot and 1.5 s on PX4."""
_FILTER_TIME = 0.3
"""Time constant of each of the two low-pass filters of r (see `VerticalCorrection`), s."""
_LARGEST_R_CHANGE = 0.3
"""Each new value of r is clamped to within ± this of the filtered r, m/s: a jump of the height is
no correction by the estimator."""
_LARGEST_CORRECTION = 0.1
"""Largest correction of the height, m; the largest one in recorded flights was 0.08 m."""
_LONGEST_GAP = 0.5
"""Longest time between two positions that are compared, s."""


class VerticalMotion(NamedTuple):
    """Vertical position, m, and vertical speed, m/s, both positive down."""

    down: float
    speed: float


class VerticalCorrection:
    """Corrects the vertical speed by the height, and the height by what its estimator does next.

    If the accelerometer is wrong while the vehicle is tilted, the estimated vertical speed v
    differs from the change of the estimated height z: on a real PX4 by 0.02 to 0.04 m/s in circles
    at 5 to 10 m/s. A height hold that uses this speed keeps a height error of 0.02 to 0.03 m. So
    over seconds the speed is made to agree with the height.

    The autopilot's Kalman filter moves its height by its vertical speed, and towards the measured
    height. The motion towards the measured height is the change that the speed does not explain:
    r = ż − v. It is the distance to the measured height divided by the estimator's time constant.
    So the distance is that time constant times r, and is added to the height.

    Attributes:
        bias: reported minus true vertical speed, m/s, positive down.
    """

    def __init__(self) -> None:
        self.bias = 0.0
        self._time = 0.0
        self._reported: VerticalMotion | None = None
        self._predicted_down = 0.0
        self._half_filtered_r = self._filtered_r = 0.0

    def corrected(self, time: float, reported: VerticalMotion) -> VerticalMotion:
        """Take a reported height and speed; return them corrected.

        Args:
            time: vehicle time of `reported`, s.
            reported: the autopilot's estimate.
        """
        dt, last = time - self._time, self._reported
        self._time, self._reported = time, reported
        if last is None or not 0.0 < dt < _LONGEST_GAP:
            self._predicted_down = reported.down
        else:
            mean_speed = 0.5 * (last.speed + reported.speed)
            self._learn_bias(dt, reported.down, mean_speed)
            self._filter_r(dt, (reported.down - last.down) / dt - mean_speed)
        correction = clamp(_ESTIMATOR_TIME * self._filtered_r, _LARGEST_CORRECTION)
        return VerticalMotion(reported.down + correction, reported.speed - self.bias)

    def _learn_bias(self, dt: float, down: float, mean_speed: float) -> None:
        predicted_down = self._predicted_down + dt * (mean_speed - self.bias)
        error = down - predicted_down
        self._predicted_down = predicted_down + min(2.0 * _BIAS_BANDWIDTH * dt, 1.0) * error
        self.bias = clamp(self.bias - _BIAS_BANDWIDTH**2 * dt * error, _LARGEST_BIAS)

    def _filter_r(self, dt: float, new_r: float) -> None:
        new_weight = 1.0 - exp(-dt / _FILTER_TIME)
        change = clamp(new_r - self._half_filtered_r, _LARGEST_R_CHANGE)
        self._half_filtered_r += new_weight * change
        self._filtered_r += new_weight * (self._half_filtered_r - self._filtered_r)
