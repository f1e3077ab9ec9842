"""Corrects the autopilot's position ahead of the correction that its estimator will make."""

from dataclasses import dataclass
from math import exp

from companion.guidance.reference import Horizontal, VehicleMotion, limited

_LONGEST = 0.5
"""Longest time between two positions from which a correction is computed, s."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """How much of the estimator's correction is anticipated.

    Attributes:
        ahead: time constant of the estimator's correction, s: 1/(the estimator's position gain).
        window: time constant of the two low-pass filters on the correction, s, positive.
        largest: largest anticipated correction, m.
        lateness: delay of the estimator's position that remains after its corrections, s.
    """

    ahead: float
    window: float
    largest: float
    lateness: float


class PositionCorrection:
    """Corrects horizontal positions by what the estimator has not yet corrected itself.

    The autopilot's Kalman filter moves its position by its velocity and towards GPS. The second
    part, r = ṗ − v, is the filter's gain times the distance to GPS, so ahead·r is that distance. If
    GPS is later than the filter assumes, the position also lags by lateness·v.

    Args:
        settings: settings of the correction.
    """

    def __init__(self, settings: CorrectionSettings) -> None:
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Start again: the estimate has jumped."""
        self._time = 0.0
        self._before: VehicleMotion | None = None
        self._unexplained: Horizontal = (0.0, 0.0)
        self._correction: Horizontal = (0.0, 0.0)

    def corrected(self, time: float, measured: VehicleMotion) -> VehicleMotion:
        """A measured motion with its position corrected.

        Args:
            time: vehicle time of the measurement, s.
            measured: measured motion, NED.
        """
        settings = self._settings
        before, dt = self._before, time - self._time
        self._time, self._before = time, measured
        if before is None or not 0.0 < dt < _LONGEST:
            self._unexplained = self._correction = (0.0, 0.0)
        else:
            self._take(before, measured, dt)
        (north, east, down), velocity = measured
        return VehicleMotion(
            (
                north + self._correction[0] + settings.lateness * velocity[0],
                east + self._correction[1] + settings.lateness * velocity[1],
                down,
            ),
            velocity,
        )

    def _take(self, before: VehicleMotion, now: VehicleMotion, dt: float) -> None:
        """Filter the change of position since the last one that the velocity does not explain."""
        settings = self._settings
        kept = exp(-dt / settings.window)
        (p_before, v_before), (p_now, v_now) = before, now
        way, more = [0.0, 0.0], [0.0, 0.0]
        for axis in (0, 1):
            explained = 0.5 * dt * (v_before[axis] + v_now[axis])
            step = p_now[axis] - p_before[axis] - explained
            way[axis] = kept * (self._unexplained[axis] + step)
            wanted = settings.ahead / settings.window * way[axis]
            more[axis] = wanted + kept * (self._correction[axis] - wanted)
        self._unexplained = limited(way[0], way[1], settings.largest)
        self._correction = limited(more[0], more[1], settings.largest)
