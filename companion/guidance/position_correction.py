"""Anticipates the correction that the autopilot's estimator will still make to its position."""

from dataclasses import dataclass
from math import exp

from companion.guidance.reference import Horizontal, VehicleMotion, limited

_LONGEST = 0.5
"""Longest time between two positions that are compared, s."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """How much of the estimator's correction is anticipated.

    Attributes:
        ahead: time constant of the estimator's correction, s: 1/(its gain on a position).
        window: time constant of the two low-pass filters of its correction, s, positive.
        largest: bound on the anticipated correction, m.
        lateness: delay of its position once it has corrected everything, s.
    """

    ahead: float
    window: float
    largest: float
    lateness: float


class PositionCorrection:
    """Corrects horizontal positions by the part that the estimator's velocity does not explain.

    A Kalman filter moves its position by its velocity, and towards GPS. The second part,
    r = ṗ − v, is its gain times the distance to GPS, so ahead·r is that distance. Where GPS is
    later than the filter assumes, the position lags by lateness·v. At rest and without a
    correction nothing changes.

    Args:
        settings: of the correction.
    """

    def __init__(self, settings: CorrectionSettings) -> None:
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Start anew: the estimate has jumped."""
        self._time = 0.0
        self._before: VehicleMotion | None = None
        self._unexplained: Horizontal = (0.0, 0.0)
        self._more: Horizontal = (0.0, 0.0)

    def corrected(self, time: float, measured: VehicleMotion) -> VehicleMotion:
        """A measured motion with its position corrected.

        Args:
            time: of the measurement, vehicle time, s.
            measured: m and m/s, NED.
        """
        settings = self._settings
        before, dt = self._before, time - self._time
        self._time, self._before = time, measured
        if before is None or not 0.0 < dt < _LONGEST:
            self._unexplained = self._more = (0.0, 0.0)
        else:
            self._take(before, measured, dt)
        (north, east, down), velocity = measured
        return VehicleMotion(
            (
                north + self._more[0] + settings.lateness * velocity[0],
                east + self._more[1] + settings.lateness * velocity[1],
                down,
            ),
            velocity,
        )

    def _take(self, before: VehicleMotion, now: VehicleMotion, dt: float) -> None:
        """Add the part of the step since the last position that the velocity does not explain."""
        settings = self._settings
        kept = exp(-dt / settings.window)
        (p_before, v_before), (p_now, v_now) = before, now
        way, more = [0.0, 0.0], [0.0, 0.0]
        for axis in (0, 1):
            explained = 0.5 * dt * (v_before[axis] + v_now[axis])
            step = p_now[axis] - p_before[axis] - explained
            way[axis] = kept * (self._unexplained[axis] + step)
            wanted = settings.ahead / settings.window * way[axis]
            more[axis] = wanted + kept * (self._more[axis] - wanted)
        self._unexplained = limited(way[0], way[1], settings.largest)
        self._more = limited(more[0], more[1], settings.largest)
