"""Detects a vehicle that does not accelerate where its reported attitude points the thrust."""

from cmath import phase
from math import exp

from companion.control.measured_acceleration import MeasuredAcceleration

_FILTER_TIME = 0.5
"""Time constant of the low-pass filter on thrust, acceleration and velocity, s. It is longer than
any delay of the estimate, and shorter than the time in which drag or wind changes much."""
_MEMORY = 2.5
"""Time constant with which earlier data are forgotten, s."""
_MIN_EXCITATION = 2.0
"""Smallest standard deviation of the filtered acceleration by thrust from which its direction can
be judged, m/s²."""
_MIN_FIT = 0.7
"""Smallest fit, 0 to 1, from which the angle counts. A gust that the thrust balances leaves little
acceleration, so its fit is low."""
_LARGEST_DRAG = 1.5
"""Largest drag per mass that may explain the acceleration, 1/s."""


class ThrustDirection:
    """Fits the rotation about the vertical between thrust and measured acceleration.

    Horizontal vectors are complex numbers, north + j·east. Three of them pass the same low-pass
    filter: the acceleration by thrust f (from the reported attitude), the measured acceleration a
    (from the reported velocity) and the velocity v. The model is a + drag·v = r·f + wind, where
    wind is constant within `_MEMORY`, drag is between 0 and `_LARGEST_DRAG` as it suits an angle of
    zero best, and r has the length 1. Its angle is that of the covariance of a + drag·v and f. The
    fit is twice the length of the covariance by the sum of the variances: it is 1 if the rotated
    thrust explains the acceleration, and low if the two differ in size or have nothing in common.
    """

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Forget all data: control begins, or the heading was reset."""
        self._thrust = self._acceleration = self._velocity = 0j
        self._means = (0j, 0j, 0j)
        self._weight = 0.0
        self._heading_resets: float | None = None
        self._ff = self._aa = self._vv = 0.0
        self._af = self._vf = self._av = 0j

    def observe(self, measured: MeasuredAcceleration) -> None:
        """Take the data between two positions."""
        if measured.heading_resets != self._heading_resets:
            self.begin()
            self._heading_resets = measured.heading_resets
        dt = measured.dt
        share = 1.0 - exp(-dt / _FILTER_TIME)
        self._thrust += share * (complex(*measured.thrust) - self._thrust)
        self._acceleration += share * (complex(*measured.acceleration) - self._acceleration)
        self._velocity += share * (complex(*measured.velocity) - self._velocity)
        self._update_covariances(dt)

    def _update_covariances(self, dt: float) -> None:
        """Update means, variances and covariances with the filtered values."""
        kept = exp(-dt / _MEMORY)
        self._weight = kept * self._weight + dt
        gain = dt / self._weight
        f_mean, a_mean, v_mean = self._means
        f, a, v = self._thrust - f_mean, self._acceleration - a_mean, self._velocity - v_mean
        self._means = f_mean + gain * f, a_mean + gain * a, v_mean + gain * v
        # Old deviation times new deviation, as in Welford's algorithm; the latter is (1 - gain)
        # times the former.
        added = dt * (1.0 - gain)
        f_conjugate = f.conjugate()
        self._ff = kept * self._ff + added * (f * f_conjugate).real
        self._aa = kept * self._aa + added * (a * a.conjugate()).real
        self._vv = kept * self._vv + added * (v * v.conjugate()).real
        self._af = kept * self._af + added * a * f_conjugate
        self._vf = kept * self._vf + added * v * f_conjugate
        self._av = kept * self._av + added * a * v.conjugate()

    @property
    def angle(self) -> float | None:
        """Angle from the thrust to the acceleration, rad, clockwise from above; None: not known."""
        if self._ff <= _MIN_EXCITATION**2 * self._weight:
            return None
        drag = 0.0
        if self._vv > 0.0:
            least_squares = (self._vf - self._av).real / self._vv
            drag = min(max(least_squares, 0.0), _LARGEST_DRAG)
        covariance = self._af + drag * self._vf
        variance = self._aa + drag * (2.0 * self._av.real + drag * self._vv)
        if 2.0 * abs(covariance) < _MIN_FIT * (self._ff + variance):
            return None
        return phase(covariance)
