"""Estimates the specific thrust per share of full thrust from the measured acceleration."""

from math import copysign

from companion.guidance.reference import GRAVITY

SHORTEST_WINDOW = 0.1
"""Shortest time between two velocities that give an acceleration, s; a longer one is less noisy."""

_FIRST_DEVIATION = 0.4
"""Relative standard deviation of the configured hover thrust."""

_GATE_DEVIATIONS = 3.0
"""An innovation above this number of standard deviations is rejected (PX4: HTE_ACC_GATE)."""

_USUAL_NOISE = 0.2
"""Usual variance of a measured specific thrust, (m/s²)². With this variance the filter has the
configured `time_constant`."""

_FIRST_NOISE, _SMALLEST_NOISE, _LARGEST_NOISE = 1.0, 0.05, 100.0
"""Initial variance of a measured specific thrust and its bounds, (m/s²)².

The initial variance is large because after takeover the rotors still change to the new thrust.
"""

_NOISE_TIME = 2.0
"""Time constant with which the variance of the measurements is learned, s."""

_REJECTION_TIME = 1.0
"""Time constant of the low-pass filter that finds lasting rejections, s."""

_LASTING_REJECTION = 0.2
"""Magnitude of the low-pass filter's output from which a rejection resets the variance.

The output reaches it after about 0.25 s of rejections. The filter's input is the squared ratio of
the innovation to its gate, at most 1, with the sign of the innovation: +1 for a rejected
measurement that is too high, −1 for one that is too low.
"""


class ThrustFilter:
    """Kalman filter with an innovation gate, like PX4's `hover_thrust_estimator`.

    The state is k = g / hover thrust, and the measurement is T = k·share + noise; the share of
    thrust is that of a linear thrust curve. The noise is learned from the residuals (Akhlaghi et
    al., Adaptive Adjustment of Noise Covariance in Kalman Filter for Dynamic State Estimation,
    2017). After a load is picked up or dropped, all measurements would be rejected: if rejections
    last, the variance of the state is reset to its initial value, or to a larger one that accepts
    the measurement.

    PX4 estimates the hover thrust instead of k, and must linearise its measurement. Here the
    measurement is linear in k, so the filter converges from a poor first guess as fast as from a
    good one.

    Args:
        hover: expected share of thrust at hover.
        limit: limit of `gain`: the share at hover, g/gain, is at most `hover`·(1 + limit), and at
            least `hover`/(1 + limit).
        time_constant: time constant with which a slow change is followed, s; it grows with the
            standard deviation of the measurements.

    Attributes:
        measured_gain: k, the specific thrust at full thrust, m/s², as measured, without `limit`.
    """

    def __init__(self, hover: float, limit: float, time_constant: float) -> None:
        self.measured_gain = GRAVITY / hover
        self._bounds = self.measured_gain / (1.0 + limit), self.measured_gain * (1.0 + limit)
        self._first_variance = (_FIRST_DEVIATION * self.measured_gain) ** 2
        # With this process noise the steady-state filter is a low pass of `time_constant`.
        self._process_noise = _USUAL_NOISE * SHORTEST_WINDOW / (time_constant * hover) ** 2
        self._variance = self._first_variance
        self._noise = _FIRST_NOISE
        self._filtered_rejection = 0.0

    @property
    def gain(self) -> float:
        """The specific thrust at full thrust, m/s²: `measured_gain`, clamped by `limit`."""
        return min(max(self.measured_gain, self._bounds[0]), self._bounds[1])

    def learn(
        self, duration: float, share: float, specific_thrust: float, extra_variance: float
    ) -> None:
        """Take one measurement.

        Args:
            duration: duration of the measurement, s.
            share: mean share of full thrust along the measured axis, 0..1.
            specific_thrust: measured mean specific thrust along the same axis, m/s².
            extra_variance: variance to add to the learned variance of the measurements, (m/s²)².
        """
        self._variance = min(
            self._variance + self._process_noise * duration,
            max(self._variance, self._first_variance),
        )
        innovation = specific_thrust - self.measured_gain * share
        innovation_variance = share * share * self._variance + self._noise + extra_variance
        ratio = (
            innovation * innovation / (_GATE_DEVIATIONS * _GATE_DEVIATIONS * innovation_variance)
        )
        new_weight = min(1.0, duration / _REJECTION_TIME)
        self._filtered_rejection += new_weight * (
            copysign(min(ratio, 1.0), innovation) - self._filtered_rejection
        )
        if ratio > 1.0:
            if abs(self._filtered_rejection) > _LASTING_REJECTION:
                self._variance = max(
                    self._first_variance, self._variance_to_accept(innovation, share)
                )
                self._filtered_rejection = 0.0
            return
        kalman_gain = self._variance * share / innovation_variance
        self.measured_gain += kalman_gain * innovation
        self._variance *= 1.0 - kalman_gain * share
        self._learn_noise(duration, share, specific_thrust - self.measured_gain * share)

    @staticmethod
    def _variance_to_accept(innovation: float, share: float) -> float:
        """Variance of the state with which the gate accepts this innovation.

        This variance exceeds the initial one if the configured hover thrust is far off, such as 0.5
        instead of 0.13.
        """
        return (innovation / (_GATE_DEVIATIONS * share)) ** 2 if share > 0.0 else 0.0

    def _learn_noise(self, duration: float, share: float, residual: float) -> None:
        new_noise = residual * residual + share * share * self._variance
        noise = self._noise + min(1.0, duration / _NOISE_TIME) * (new_noise - self._noise)
        self._noise = min(max(noise, _SMALLEST_NOISE), _LARGEST_NOISE)
