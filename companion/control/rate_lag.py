"""The time by which the body rates in telemetry lag behind the attitude in the same message.

Autopilots send body rates after a low-pass filter, but integrate the attitude from the unfiltered
gyro. Measured lags: PX4 5 ms, ArduPilot 11 ms. If the lag is ignored, the turn of the heading that
is computed from body rates is wrong by up to 0.5° in a corner at 400°/s.
"""

from companion.attitude import Quaternion
from companion.attitude.rotation import body_error, clamp
from companion.guidance.reference import Vector

_LARGEST_LAG = 0.03
"""Largest lag that is learned, s; a low-pass filter of 20 Hz has 11 ms."""
_HALF_LEARNED_SQUARE_SUM = 0.01
"""Sum of squared rate changes, rad²/s², after which half of the lag is learned."""


class RateLag:
    """Learns the lag of the reported body rates behind the reported attitude.

    The rotation between two attitudes differs from the mean of the two body rates times the time
    between the samples. The difference is the lag times the change of the rates. The lag is learned
    from roll and pitch only, because the estimator also changes the heading of a body at rest.

    All rotations have the same weight. So a lag that changes in flight, for example when a filter
    of the autopilot is switched, is followed slowly. The error is small: on the mock vehicles,
    where the lag grew by 11 ms after `corners`, the heading error in later steps grew by 0.1°;
    without this class it grew by 0.3°. Forgetting old rotations would reduce the growth by only
    0.05°.

    Attributes:
        lag: the learned lag, s; about 0 before the first fast rotation.
    """

    def __init__(self) -> None:
        self.lag = 0.0
        self._product_sum = 0.0
        self._square_sum = _HALF_LEARNED_SQUARE_SUM

    def mean(self, rates_before: Vector, rates_after: Vector, dt: float) -> Vector:
        """The mean body rates between two samples `dt` s apart, corrected for the lag, rad/s."""
        lag_share = self.lag / dt
        p, q, r = rates_before
        new_p, new_q, new_r = rates_after
        return (
            0.5 * (p + new_p) + lag_share * (new_p - p),
            0.5 * (q + new_q) + lag_share * (new_q - q),
            0.5 * (r + new_r) + lag_share * (new_r - r),
        )

    def learn(
        self,
        rates_before: Vector,
        rates_after: Vector,
        predicted_q: Quaternion,
        measured_q: Quaternion,
    ) -> None:
        """Learn from the difference between a measured attitude and the predicted one.

        Args:
            rates_before: body rates of the previous sample, rad/s.
            rates_after: body rates of this sample, rad/s.
            predicted_q: attitude of this sample, predicted from the previous one with `mean`.
            measured_q: measured attitude of this sample.
        """
        _, x, y, _ = body_error(predicted_q, measured_q)
        p, q = rates_after[0] - rates_before[0], rates_after[1] - rates_before[1]
        change_squared = p * p + q * q
        self._product_sum += 2.0 * (x * p + y * q) + self.lag * change_squared
        self._square_sum += change_squared
        self.lag = clamp(self._product_sum / self._square_sum, _LARGEST_LAG)
