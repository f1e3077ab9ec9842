"""What the autopilot's estimator has still to correct in its position, taken ahead of it."""

from dataclasses import dataclass
from math import exp

from companion.guidance.reference import Horizontal, VehicleMotion, limited

_LONGEST = 0.5
"""Between two positions, s: further apart they do not tell what was corrected in between."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """How far the estimator's own correction is believed.

    Attributes:
        ahead: for how long the estimator would go on correcting, s: 1/(its gain on a position).
        window: over which its correction is averaged, twice, s, positive: positions are noisy.
        largest: of what is taken ahead, m.
        lateness: by which its position is late even when it has corrected all, s.
    """

    ahead: float
    window: float
    largest: float
    lateness: float


class PositionCorrection:
    """Corrects horizontal positions by what the estimator's own velocity does not explain.

    A Kalman filter moves its position by its velocity, and towards GPS. The second part,
    r = ṗ − v, is its gain times what it is off GPS by, so ahead·r is that distance. Where
    GPS is also later than the filter believes, the position stays behind by lateness·v.
    Without a correction and at rest nothing changes.

    Args:
        settings: what it does with them.
    """

    def __init__(self, settings: CorrectionSettings) -> None:
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Forget all: the estimate has jumped."""
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
        """Go on by what the velocity does not explain of the way since the last position."""
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
