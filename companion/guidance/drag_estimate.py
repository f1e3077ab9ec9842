"""Drag, estimated from the measured acceleration less the acceleration by thrust."""

from dataclasses import dataclass
from math import hypot, isfinite, sqrt

import numpy as np

from companion.attitude.rotation import clamp
from companion.drag import AxisDrag, Drag
from companion.guidance.reference import NorthEast, Vector

_SHORTEST_WINDOW = 0.2
"""Shortest duration of one measurement, s; a longer one suffers less from velocity noise."""
_MEASUREMENT_DEVIATION = 0.2
"""Standard deviation of a measurement, m/s², from velocity noise and the thrust's direction."""
_WIND_DEVIATION = 2.0
"""Initial standard deviation of the acceleration by wind, m/s²."""
_WIND_RANDOM_WALK = 0.2
"""Standard deviation of the change of the acceleration by wind in 1 s, m/s²."""
_CLAMP_DEVIATIONS = 3.0
"""An innovation is clamped to this many standard deviations, so that bumps do not count as drag."""
_LARGEST_LINEAR_INCREASE = 2.0
"""Largest excess of the estimated linear drag over the prior's linear drag, 1/s."""
_LARGEST_QUADRATIC = 0.3
"""Largest estimate of the quadratic drag, 1/m, unless the prior's is larger."""
_AXIS_DRAG_DEVIATION, _LARGEST_AXIS_DRAG = 0.03, 0.1
"""Initial standard deviation of `AxisDrag.coefficient`, which begins at 0, and its largest
estimate, 1/m."""
_CERTAIN_DEVIATION = 0.1
"""The drag is certain if the standard deviation of linear + quadratic·`top_speed` is below this,
1/s."""
_GUSTY_INNOVATION = 2.0
"""Above this mean of innovation²/variance the drag is not certain: gusts change faster than the
filter assumes, and the filter may take their effect for drag."""


@dataclass(frozen=True, slots=True)
class DragPrior:
    """Drag and its uncertainty before the vehicle has moved.

    Attributes:
        drag: the most likely drag.
        linear_deviation: standard deviation of the linear drag, 1/s.
        quadratic_deviation: standard deviation of the quadratic drag, 1/m.
    """

    drag: Drag
    linear_deviation: float
    quadratic_deviation: float


ANY_VEHICLE = DragPrior(Drag(0.3), 0.4, 0.03)
"""Prior for an unknown multirotor: between 0.2/s (bare frame) and 1/s (PX4's simulation)."""


class DragEstimate:
    """Kalman filter for drag and wind: v̇ − thrust = wind − (linear + quadratic·|v|)·v − d.

    d is the deceleration of `AxisDrag`. The state is the linear and the quadratic drag and the
    coefficient of `AxisDrag`, which are constant, and the acceleration by wind (north, east), which
    is a random walk. Wind changes slowly, so an acceleration that changes with the velocity counts
    as drag.

    Attributes:
        prior_drag: drag of the prior.
        drag: the drag estimated so far.
        top_speed: largest mean horizontal speed in one measurement so far, m/s.
    """

    def __init__(self, prior: DragPrior) -> None:
        self.begin(prior)

    def begin(self, prior: DragPrior) -> None:
        """Start again from `prior`."""
        self.prior_drag = self.drag = prior.drag
        self.top_speed = 0.0
        self._state = np.array([prior.drag.linear, prior.drag.quadratic, 0.0, 0.0, 0.0])
        drag_deviations = prior.linear_deviation, prior.quadratic_deviation
        other_deviations = _WIND_DEVIATION, _WIND_DEVIATION, _AXIS_DRAG_DEVIATION
        self._covariance = np.diag([each**2 for each in (*drag_deviations, *other_deviations)])
        self._innovation_sum, self._measurement_count = 0.0, 0
        self._forget_window()

    @property
    def axis_coefficient(self) -> float:
        """The coefficient of `AxisDrag` estimated so far, 1/m."""
        return min(max(float(self._state[4]), 0.0), _LARGEST_AXIS_DRAG)

    @property
    def certain(self) -> bool:
        """Whether the vehicle moved fast enough, in calm enough air, for a reliable estimate."""
        if self._innovation_sum > _GUSTY_INNOVATION * self._measurement_count:
            return False
        speed, p = self.top_speed, self._covariance
        variance = p[0, 0] + 2.0 * speed * p[0, 1] + speed * speed * p[1, 1]
        return speed > 0.0 and sqrt(max(variance, 0.0)) < _CERTAIN_DEVIATION

    def observe(
        self, dt: float, velocity: Vector, residual: NorthEast, heading: float = 0.0
    ) -> None:
        """Take a measured acceleration; ignored if a number is not finite or `dt` not positive.

        Args:
            dt: duration over which the acceleration was measured, s.
            velocity: mean velocity in this time, m/s, NED.
            residual: measured acceleration less the acceleration by thrust, m/s², NED.
            heading: heading of the vehicle, rad.
        """
        speed = hypot(*velocity)
        if not (isfinite(dt) and isfinite(speed) and isfinite(hypot(*residual))) or dt <= 0.0:
            return
        along_axes = AxisDrag(1.0, heading).deceleration(velocity[0], velocity[1])
        for axis in (0, 1):
            self._along_axes[axis] += dt * along_axes[axis]
            self._displacement[axis] += dt * velocity[axis]
            self._speed_times_velocity[axis] += dt * speed * velocity[axis]
            self._residual[axis] += dt * residual[axis]
        self._window_duration += dt
        if self._window_duration >= _SHORTEST_WINDOW:
            self._update_filter()
            self._forget_window()

    def _update_filter(self) -> None:
        """Update the filter with the mean residuals since the last update, north and then east."""
        duration = self._window_duration
        self.top_speed = max(self.top_speed, hypot(*self._displacement) / duration)
        for wind_state in (2, 3):
            self._covariance[wind_state, wind_state] += duration * _WIND_RANDOM_WALK**2
        for axis in (0, 1):
            observation = np.zeros(5)
            observation[0] = -self._displacement[axis] / duration
            observation[1] = -self._speed_times_velocity[axis] / duration
            observation[2 + axis] = 1.0
            observation[4] = -self._along_axes[axis] / duration
            cross_covariance = self._covariance @ observation
            variance = float(observation @ cross_covariance) + _MEASUREMENT_DEVIATION**2
            limit = _CLAMP_DEVIATIONS * sqrt(variance)
            innovation = clamp(
                self._residual[axis] / duration - float(observation @ self._state), limit
            )
            gain = cross_covariance / variance
            self._innovation_sum += innovation * innovation / variance
            self._measurement_count += 1
            self._state = self._state + gain * innovation
            self._covariance = self._covariance - np.outer(gain, cross_covariance)
        self.drag = self._drag_within_bounds()

    def _drag_within_bounds(self) -> Drag:
        """The most likely drag within the bounds.

        If the quadratic drag is clamped, the linear drag is the most likely one for the clamped
        quadratic drag.
        """
        (linear, quadratic), p = self._state[:2].tolist(), self._covariance
        clamped = min(max(quadratic, 0.0), max(_LARGEST_QUADRATIC, self.prior_drag.quadratic))
        linear += float(p[0, 1] / p[1, 1]) * (clamped - quadratic) if p[1, 1] > 0.0 else 0.0
        return Drag(
            min(max(linear, 0.0), self.prior_drag.linear + _LARGEST_LINEAR_INCREASE), clamped
        )

    def _forget_window(self) -> None:
        self._window_duration = 0.0
        self._displacement, self._residual = [0.0, 0.0], [0.0, 0.0]
        self._speed_times_velocity, self._along_axes = [0.0, 0.0], [0.0, 0.0]
