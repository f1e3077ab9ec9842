"""Anticipates the correction that the autopilot's estimator will make to its position."""

from collections import deque
from dataclasses import dataclass
from math import exp, hypot, sqrt

from companion.guidance.reference import NorthEast, VehicleMotion, clamp_length

_SHORTEST_GAP = 0.0005
"""Shortest time between two positions that are compared, s: time stamps are in whole ms, and two
positions with the same stamp give no velocity."""
_LONGEST_GAP = 0.5
"""Longest time between two positions from which a correction is computed, s."""
_LONGEST_FILTER_TIME = 0.1
"""Time constant of each low-pass filter for noisy positions while the vehicle moves, s; smooth
positions need a shorter one (`CorrectionSettings.filter_time`)."""
_FILTER_TIME_PER_NOISE = 0.1
"""Growth of `filter_time` with the noise of r, s per m/s; r is defined in `PositionCorrection`."""
_SMOOTH_BELOW, _NOISY_ABOVE = 0.2, 0.6
"""Noise of r below which positions count as smooth, and noise above which they count as noisy, m/s.
PX4 and ArduPilot make at most 0.1 m/s; white position noise of 3 mm at 50 Hz makes 0.5 m/s."""
_LARGEST_R_CHANGE = 0.08
"""Each new value of r is clamped to within this distance of the filtered r, m/s. ArduPilot stamps
its position in whole milliseconds: at 5 m/s an error of 1 ms changes one value of r by 0.25 m/s.
Real corrections of its estimator change r by 0.02 m/s, with peaks of 0.1 m/s (measured)."""
_NOISE_TIME = 1.0
"""Time constant with which the noise of r is estimated, s."""
_MOVING_SPEED = 2.0
"""Speed from which the positions are trusted fully, m/s. At lower speed, position errors are small
and mostly noise. With the reduced trust, a real PX4 hovers with the same accuracy, and with half
the body rates."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """How much of the estimator's correction is anticipated.

    Attributes:
        estimator_time: time constant of the estimator's correction, s: 1/(position gain).
        filter_time: time constant of each of the two low-pass filters while the vehicle moves and
            its positions are smooth, s, positive; at rest twice as long.
        largest_correction: largest anticipated correction, m.
        position_delay: delay of the estimator's position that its corrections do not remove, s.
        output_delay: time after which a correction of the estimator shows in its position, s.
    """

    estimator_time: float
    filter_time: float
    largest_correction: float
    position_delay: float
    output_delay: float


class PositionCorrection:
    """Adds to horizontal positions the correction that the estimator has not made yet.

    The autopilot's Kalman filter moves its position p by its velocity v and towards GPS. The motion
    towards GPS, r = ṗ − v, is the filter's gain times the distance to GPS. So the distance to GPS
    is estimator_time·r. If GPS is later than the filter assumes, the position also lags by
    position_delay·v.

    The filter processes late measurements and smooths its output, so r shows the distance to GPS as
    it was output_delay ago. The lag is therefore computed from the velocity at that time, too. The
    sum of both is still the error of the present position, because since then the filter has moved
    the position by measured accelerations.

    r is computed from two positions a short time apart, which amplifies their noise. Low-pass
    filters reduce the noise but delay the correction, so their time constant follows the noise.
    """

    def __init__(self, settings: CorrectionSettings) -> None:
        self._settings = settings
        self.reset()

    def retune(self, settings: CorrectionSettings) -> None:
        """Use other settings from the next position on; the correction continues."""
        self._settings = settings

    def reset(self) -> None:
        """Forget the correction, because the estimate has jumped."""
        self._time = 0.0
        self._last_motion: VehicleMotion | None = None
        self._newest_r: NorthEast = (0.0, 0.0)
        self._filtered_r: NorthEast = (0.0, 0.0)
        self._correction: NorthEast = (0.0, 0.0)
        self._noise_variance = 0.0
        self._speed_fraction = 0.0
        self._velocities = _VelocityHistory()

    @property
    def trust(self) -> float:
        """Trust in the positions, 0 to 1: 1 if they are smooth and the vehicle moves.

        The trust is 0 if positions are noisy or rounded, or if the vehicle is at rest.
        """
        smoothness = (_NOISY_ABOVE - sqrt(self._noise_variance)) / (_NOISY_ABOVE - _SMOOTH_BELOW)
        return min(max(0.0, smoothness), 1.0) * self._speed_fraction

    def corrected_motion(self, time: float, measured: VehicleMotion) -> VehicleMotion:
        """A measured motion with its horizontal position corrected.

        Args:
            time: vehicle time of the measurement, s.
            measured: measured motion, NED.
        """
        settings = self._settings
        last_motion, dt = self._last_motion, time - self._time
        self._time, self._last_motion = time, measured
        self._speed_fraction = min(
            hypot(measured.velocity_ned[0], measured.velocity_ned[1]) / _MOVING_SPEED, 1.0
        )
        if last_motion is None or not _SHORTEST_GAP < dt < _LONGEST_GAP:
            self._newest_r = self._filtered_r = self._correction = (0.0, 0.0)
            self._velocities = _VelocityHistory()
        else:
            self._filter_unexplained_velocity(last_motion, measured, dt)
        (north, east, down), velocity = measured
        self._velocities.add(time, (velocity[0], velocity[1]))
        past_velocity = self._velocities.at(time - settings.output_delay)
        return VehicleMotion(
            (
                north + self._correction[0] + settings.position_delay * past_velocity[0],
                east + self._correction[1] + settings.position_delay * past_velocity[1],
                down,
            ),
            velocity,
        )

    def _filter_unexplained_velocity(
        self, last_motion: VehicleMotion, now: VehicleMotion, dt: float
    ) -> None:
        """Filter r = ṗ − v, the change of the position that the velocity does not explain."""
        settings = self._settings
        (p_before, v_before), (p_now, v_now) = last_motion, now
        new_r, filtered, correction = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        for axis in (0, 1):
            explained_velocity = 0.5 * (v_before[axis] + v_now[axis])
            new_r[axis] = (p_now[axis] - p_before[axis]) / dt - explained_velocity
        old_weight = exp(-dt / self._filter_time(new_r, dt))
        change = clamp_length(
            new_r[0] - self._filtered_r[0], new_r[1] - self._filtered_r[1], _LARGEST_R_CHANGE
        )
        for axis in (0, 1):
            filtered[axis] = self._filtered_r[axis] + (1.0 - old_weight) * change[axis]
            complete_correction = settings.estimator_time * filtered[axis]
            correction[axis] = complete_correction + old_weight * (
                self._correction[axis] - complete_correction
            )
        self._newest_r = new_r[0], new_r[1]
        largest_r = (
            settings.largest_correction / settings.estimator_time
            if settings.estimator_time > 0.0
            else 0.0
        )
        self._filtered_r = clamp_length(filtered[0], filtered[1], largest_r)
        self._correction = clamp_length(correction[0], correction[1], settings.largest_correction)

    def _filter_time(self, new_r: list[float], dt: float) -> float:
        """Update the noise of r with its new value `new_r`, m/s; return the filter time, s."""
        change = hypot(new_r[0] - self._newest_r[0], new_r[1] - self._newest_r[1])
        old_weight = exp(-dt / _NOISE_TIME)
        self._noise_variance = change * change + old_weight * (
            self._noise_variance - change * change
        )
        shortest = self._settings.filter_time
        longest = max(shortest, _LONGEST_FILTER_TIME)
        filter_time = min(shortest + _FILTER_TIME_PER_NOISE * sqrt(self._noise_variance), longest)
        return (2.0 - self._speed_fraction) * filter_time


class _VelocityHistory:
    """The newest horizontal velocities, to look up a delayed one."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, NorthEast]] = deque()

    def add(self, time: float, velocity: NorthEast) -> None:
        """Add a velocity, m/s, with a later time than all others, s."""
        self._rows.append((time, velocity))

    def at(self, time: float) -> NorthEast:
        """The velocity at `time`, or the oldest one; forgets all earlier ones."""
        while len(self._rows) > 1 and self._rows[1][0] <= time:
            self._rows.popleft()
        return self._rows[0][1]
