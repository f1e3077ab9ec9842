"""Specific thrust per share of full thrust, estimated from the measured acceleration."""

from math import copysign

from companion.guidance.reference import GRAVITY

SHORTEST = 0.1
"""Velocity is differenced over at least this long, s: its noise is divided by the span."""

_FIRST_DEVIATION = 0.4
"""Standard deviation of the configured hover thrust, as a share of it."""

_GATE = 3.0
"""Innovations of more standard deviations than this are not believed (PX4: HTE_ACC_GATE)."""

_NOISE = 0.2
"""Usual variance of a measured specific thrust, (m/s²)²; `time_constant` holds for it."""

_FIRST_NOISE, _LEAST_NOISE, _MOST_NOISE = 1.0, 0.05, 100.0
"""Larger at first: the rotors still change from the thrust before takeover. (m/s²)²."""

_NOISE_TIME = 2.0
"""Time constant with which that variance is learned, s."""

_REFUSAL_TIME = 1.0
"""Time constant of the mean of refusals, s."""

_LASTING = 0.2
"""Filtered mean of refusals (+1 too high, −1 too low) that counts as lasting: about 0.25 s."""


class ThrustFilter:
    """Kalman filter with an innovation gate, as PX4's `hover_thrust_estimator` is built.

    The state is k = g / hover thrust, the measurement T = k·share + noise; the share is that of a
    linear thrust curve. The noise is learned from the residuals (Akhlaghi et al., Adaptive
    Adjustment of Noise Covariance in Kalman Filter for Dynamic State Estimation, 2017). A load that
    is picked up or dropped would be refused for ever: when refusals last, the state's variance is
    what it was at first.

    PX4 has the hover thrust itself for its state, and must linearise: H = −g·u/h². In k the
    measurement is linear, so that a first guess that is far off costs no more than a near one.

    Attributes:
        gain: k, m/s² for all of the thrust.

    Args:
        hover: share of thrust that is expected to hover.
        limit: the hover thrust is at most 1 + limit times that, and at least the same part of it.
        time_constant: with which a slow change is followed, s; noisier measurements are followed
            more slowly, with the square root.
    """

    def __init__(self, hover: float, limit: float, time_constant: float) -> None:
        self.gain = GRAVITY / hover
        self._bounds = self.gain / (1.0 + limit), self.gain * (1.0 + limit)
        self._first_variance = (_FIRST_DEVIATION * self.gain) ** 2
        # In the steady state of ẋ = noise the filter is a low pass of this time constant.
        self._drift = _NOISE * SHORTEST / (time_constant * hover) ** 2
        self._variance = self._first_variance
        self._noise = _FIRST_NOISE
        self._refusals = 0.0

    def learn(
        self, span: float, share: float, specific_thrust: float, extra_variance: float
    ) -> None:
        """Take one measurement.

        Args:
            span: since the last one or over which it was taken, s.
            share: of thrust, 0..1, mean over the span.
            specific_thrust: along the same axis, m/s², mean over the span.
            extra_variance: variance that this one has beyond the usual, (m/s²)².
        """
        self._variance = min(self._variance + self._drift * span, self._first_variance)
        innovation = specific_thrust - self.gain * share
        expected = share * share * self._variance + self._noise + extra_variance
        ratio = innovation * innovation / (_GATE * _GATE * expected)
        passed = min(1.0, span / _REFUSAL_TIME)
        self._refusals += passed * (copysign(min(ratio, 1.0), innovation) - self._refusals)
        if ratio > 1.0:
            if abs(self._refusals) > _LASTING:
                self._variance, self._refusals = self._first_variance, 0.0
            return
        kalman = self._variance * share / expected
        self.gain = min(max(self.gain + kalman * innovation, self._bounds[0]), self._bounds[1])
        self._variance *= 1.0 - kalman * share
        self._learn_noise(span, share, specific_thrust - self.gain * share)

    def _learn_noise(self, span: float, share: float, residual: float) -> None:
        seen = residual * residual + share * share * self._variance
        noise = self._noise + min(1.0, span / _NOISE_TIME) * (seen - self._noise)
        self._noise = min(max(noise, _LEAST_NOISE), _MOST_NOISE)
