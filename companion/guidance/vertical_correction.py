"""Corrects the estimated height and vertical speed, which contradict each other."""

from typing import NamedTuple

from companion.attitude.rotation import clamp

_BIAS_BANDWIDTH = 0.5
"""Bandwidth of the observer that corrects the speed, rad/s: slower than the height hold, quicker
than a lap of a circle."""
_CORRECTION_BANDWIDTH = 2.0
"""Bandwidth of the observer that corrects the height, rad/s."""
_LARGEST_BIAS = 0.15
"""Largest magnitude of an observed error of the vertical speed, m/s; each observer clamps its
own."""
_ESTIMATOR_TIME = 1.2
"""Time constant with which the estimator corrects its height, s. The true heights of 54 flights fit
1.0 s on ArduPilot and 1.5 s on PX4."""
_LARGEST_CORRECTION = 0.1
"""Largest correction of the height, m; the largest one in recorded flights was 0.08 m."""
_SMALLEST_JUMP = 0.15
"""A height that differs from the prediction by more than this, m, has jumped; no motion does so."""
_LONGEST_GAP = 0.5
"""Longest time between two positions that are compared, s."""


class VerticalMotion(NamedTuple):
    """Vertical position, m, and vertical speed, m/s, both positive down."""

    down: float
    speed: float


class VerticalCorrection:
    """Corrects the vertical speed by the height, and the height by its filter's next corrections.

    If the accelerometer is wrong while the vehicle is tilted, the estimated vertical speed v
    differs from the change of the estimated height z: on a real PX4 by 0.02 to 0.04 m/s in circles
    at 5 to 10 m/s. A height hold that uses this speed keeps a height error of 0.02 to 0.03 m. So
    over seconds the speed is made to agree with the height.

    The autopilot's Kalman filter moves its height by its vertical speed, and towards the measured
    height. The motion towards the measured height is ż − v, the change that the speed does not
    explain. This change is the distance to the measured height divided by the estimator's time
    constant. So the distance is this time constant times ż − v. It is added to the height.
    """

    def __init__(self) -> None:
        self._bias = _SpeedErrorObserver(_BIAS_BANDWIDTH)
        self._correction = _SpeedErrorObserver(_CORRECTION_BANDWIDTH)

    def corrected(self, time: float, reported: VerticalMotion) -> VerticalMotion:
        """Take a reported height and speed; return them corrected.

        Args:
            time: vehicle time of `reported`, s.
            reported: the autopilot's estimate.
        """
        self._bias.observe(time, reported)
        self._correction.observe(time, reported)
        correction = clamp(-_ESTIMATOR_TIME * self._correction.error, _LARGEST_CORRECTION)
        return VerticalMotion(reported.down + correction, reported.speed - self._bias.error)


class _SpeedErrorObserver:
    """Observes the error of a speed by comparing its integral with the position.

    Both poles of the observer are at `bandwidth`, rad/s.

    Attributes:
        error: speed minus change of the position, m/s.
    """

    def __init__(self, bandwidth: float) -> None:
        self.error = 0.0
        self._bandwidth = bandwidth
        self._time = 0.0
        self._speed = 0.0
        self._down: float | None = None

    def observe(self, time: float, reported: VerticalMotion) -> None:
        """Take a position and speed that belong to `time`, s."""
        dt, down = time - self._time, self._down
        mean_speed = 0.5 * (self._speed + reported.speed)
        self._time, self._speed = time, reported.speed
        if down is None or not 0.0 < dt < _LONGEST_GAP:
            self._down = reported.down
            return
        predicted_down = down + dt * (mean_speed - self.error)
        position_error = reported.down - predicted_down
        if abs(position_error) > _SMALLEST_JUMP:
            self._down = reported.down
            return
        bandwidth = self._bandwidth
        self._down = predicted_down + min(2.0 * bandwidth * dt, 1.0) * position_error
        self.error = clamp(self.error - bandwidth**2 * dt * position_error, _LARGEST_BIAS)
