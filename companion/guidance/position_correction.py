"""What the autopilot's estimator has still to correct in its position, taken ahead of it."""

from dataclasses import dataclass
from math import exp

from companion.guidance.horizontal import Horizontal, limited
from companion.guidance.reference import VehicleMotion

_LONGEST = 0.5
"""Between two positions, s: further apart they do not tell what was corrected in between."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """How far the estimator's own correction is believed.

    Attributes:
        ahead: for how long the estimator would go on correcting, s: 1/(its gain on a position).
        window: over which its correction is averaged, s, positive.
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
            self._unexplained = (0.0, 0.0)
        else:
            self._unexplained = self._moved_on(before, measured, dt)
        scale = settings.ahead / settings.window
        more = limited(scale * self._unexplained[0], scale * self._unexplained[1], settings.largest)
        (north, east, down), velocity = measured
        return VehicleMotion(
            (
                north + more[0] + settings.lateness * velocity[0],
                east + more[1] + settings.lateness * velocity[1],
                down,
            ),
            velocity,
        )

    def _moved_on(self, before: VehicleMotion, now: VehicleMotion, dt: float) -> Horizontal:
        """The way of the latest `window` s that the velocity does not explain, m."""
        kept, most = exp(-dt / self._settings.window), self._settings.largest
        north, east = (
            kept
            * (
                self._unexplained[axis]
                + now.position_ned[axis]
                - before.position_ned[axis]
                - 0.5 * dt * (before.velocity_ned[axis] + now.velocity_ned[axis])
            )
            for axis in (0, 1)
        )
        return limited(north, east, most)
