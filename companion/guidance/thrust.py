"""Thrust: from the wanted vertical acceleration to m/s², and from there to MAVLink's 0..1."""

from companion.guidance.reference import GRAVITY

_MIN_COSINE = 0.5
"""Beyond 60° of tilt height is given up rather than thrust raised without end."""

_WINDOW = 0.2
"""Velocity is differenced over at least this long, s: its noise is divided by the window."""

_LONGEST_WINDOW = 0.5
"""Beyond it the thrust in between is not known well enough to learn from, s."""

_PLAUSIBLE = (0.5 * GRAVITY, 2.0 * GRAVITY)
"""Measured specific thrust outside this is not learned from (free fall, a bump), m/s²."""


def specific_thrust(acceleration_down: float, cos_tilt: float) -> float:
    """T = (g − a_D)/cos(tilt) in m/s², with the tilt there is.

    Beyond 60° of tilt thrust fades instead, to none at 90°: upside down it would push the vehicle
    to the ground.
    """
    wanted = max(0.0, GRAVITY - acceleration_down)
    if cos_tilt < _MIN_COSINE:
        return wanted * max(0.0, cos_tilt) / (_MIN_COSINE * _MIN_COSINE)
    return wanted / cos_tilt


class HoverThrust:
    """Maps specific thrust linearly to 0..1, and corrects the map from how the vehicle moved.

    The normalised thrust at which the vehicle hovers is learned as u·g/T, with T from the measured
    vertical acceleration; bounded about the configured value, and only while `observe` is called,
    which is only in the air and in control.

    Args:
        hover: configured normalised thrust at hover.
        correction_limit: largest correction as a share of `hover`.
        correction_time: time constant of the correction, s.
        lowest: smallest normalised thrust given out.
        highest: largest normalised thrust given out.
    """

    def __init__(
        self,
        hover: float,
        correction_limit: float,
        correction_time: float,
        lowest: float,
        highest: float,
    ) -> None:
        self.hover = hover
        self._bounds = hover * (1.0 - correction_limit), hover * (1.0 + correction_limit)
        self._time_constant = correction_time
        self._lowest = lowest
        self._highest = highest
        self._began: tuple[float, float] | None = None
        self._sum = 0.0
        self._count = 0

    def normalised(self, thrust: float) -> float:
        """Normalised thrust for a specific thrust in m/s², inside the bounds."""
        return min(max(self.hover * thrust / GRAVITY, self._lowest), self._highest)

    def sent(self, vertical: float) -> None:
        """Note the vertical part of a normalised thrust that was really sent: u·cos(tilt)."""
        self._sum += vertical
        self._count += 1

    def observe(self, time: float, velocity_down: float) -> None:
        """Learn from a measured vertical velocity (m/s) at a vehicle time (s)."""
        if self._began is None:
            self._begin(time, velocity_down)
            return
        span = time - self._began[0]
        if 0.0 <= span < _WINDOW:
            return
        if span <= _LONGEST_WINDOW and self._count:
            vertical = GRAVITY - (velocity_down - self._began[1]) / span
            if _PLAUSIBLE[0] <= vertical <= _PLAUSIBLE[1]:
                measured = self._sum / self._count * GRAVITY / vertical
                step = min(1.0, span / self._time_constant)
                corrected = self.hover + step * (measured - self.hover)
                self.hover = min(max(corrected, self._bounds[0]), self._bounds[1])
        self._begin(time, velocity_down)

    def pause(self) -> None:
        """Forget the window that was begun: control ended, or the vehicle is on the ground."""
        self._began = None

    def _begin(self, time: float, velocity_down: float) -> None:
        self._began = (time, velocity_down)
        self._sum = 0.0
        self._count = 0
