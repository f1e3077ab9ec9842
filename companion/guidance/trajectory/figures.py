"""Trajectories of a known form: hover, line, circle, eights, helix."""

from dataclasses import dataclass, replace
from math import atan2, hypot, inf, isfinite, pi, sqrt, tau

from companion.guidance.trajectory.curves import (
    BernoulliEight,
    Figure,
    GeronoEight,
    Helix,
    RotatedFigure,
    Straight,
)
from companion.guidance.trajectory.sample import SMALLEST_DISTANCE, Sample, TrajectoryError, Vector
from companion.guidance.trajectory.time_laws import SEPTIC_SLOPE, Cruise, LimitedJerk, cosine_ramp
from companion.guidance.trajectory.timed_curve import HeldHeading, TangentHeading, TimedCurve

_LONGEST_RAMP_FRACTION = 0.5
"""Longest ramp (time in which the phase rate rises or falls), as a share of the time for all laps
at the steady phase rate. So a ramp covers at most a quarter of the path, and the fastest place of
each figure lies between the ramps.
"""

_RAMP_ACCELERATION = 1.0
"""Mean acceleration on a ramp of `steady_circle`, m/s²."""

_REST = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Hover:
    """A hover at the start.

    Attributes:
        duration: duration of the hover, s.
        heading: heading of the vehicle, rad; None: the heading at the start is kept.

    Raises:
        TrajectoryError: the duration is negative or not a number.
    """

    duration: float
    name: str = "hover"
    heading: float | None = None

    def __post_init__(self) -> None:
        if not self.duration >= 0.0:
            raise TrajectoryError(f"a hover must last 0 s or more, not {self.duration:g}")

    @property
    def holds_heading(self) -> bool:
        """Whether the heading at the start is kept."""
        return self.heading is None

    def check_times(self) -> list[float]:
        """The beginning and the end, s."""
        return [0.0, self.duration]

    def at(self, time: float) -> Sample:
        """The sample at rest at the start."""
        return Sample(_REST, _REST, _REST, _REST, self.heading or 0.0, 0.0)


def line(
    displacement: Vector, speed: float, acceleration: float, jerk: float, face_path: bool = False
) -> TimedCurve:
    """A straight line from rest to rest, as fast as three limits allow.

    Args:
        displacement: end point, (north, east, down) from the start, m.
        speed: largest speed, m/s.
        acceleration: largest acceleration, m/s².
        jerk: largest jerk, m/s³.
        face_path: face along the line instead of holding the heading.

    Raises:
        TrajectoryError: the line has no finite length, a limit is not positive, or the line is
            vertical and `face_path` is set.
    """
    length = sqrt(sum(x * x for x in displacement))
    if not isfinite(length):
        raise TrajectoryError("the end point of a line must be finite")
    if length < SMALLEST_DISTANCE:
        raise TrajectoryError("a line must end at another point than its start")
    if face_path and hypot(displacement[0], displacement[1]) == 0.0:
        raise TrajectoryError("a vertical line has no heading to face along")
    north, east, down = (x / length for x in displacement)
    law = LimitedJerk(length, speed, acceleration, jerk)
    heading = TangentHeading(atan2(east, north)) if face_path else HeldHeading()
    return TimedCurve("line", Straight((north, east, down)), law, heading)


@dataclass(frozen=True, slots=True)
class Laps:
    """How laps of a figure are flown: from rest to rest, at a steady phase rate between two ramps.

    Attributes:
        speed: speed at the fastest place, m/s.
        laps: number of laps; both ramps are part of them.
        acceleration: largest acceleration along the path on a ramp, m/s²; exceeded if the laps are
            too short for a ramp with this acceleration.
        direction: direction from the start to the figure, clockwise from north, rad.
        face_path: whether the vehicle faces along the path. Otherwise it holds its heading.
    """

    speed: float
    laps: float = 1.0
    acceleration: float = 3.0
    direction: float = 0.0
    face_path: bool = False


def circle(radius: float, laps: Laps) -> TimedCurve:
    """A circle of `radius` metres whose centre lies in `laps.direction`, anticlockwise from above.

    Raises:
        TrajectoryError: the radius, the speed, the laps or the acceleration is not positive.
    """
    return _flown_laps("circle", radius, Helix(radius), laps, TangentHeading(pi / 2.0, -1.0))


def steady_circle(radius: float, speed: float, laps: float, longest_duration: float) -> TimedCurve:
    """Laps of a circle north of the start; the vehicle leaves eastwards and holds its heading.

    The speed rises and falls as a raised cosine, with a mean acceleration of 1 m/s², or more if the
    laps are too short for 1 m/s².

    Args:
        radius: radius, m.
        speed: speed between the ramps, m/s.
        laps: number of laps; both ramps are part of them.
        longest_duration: longest duration that the checks permit, s.
    """
    length = tau * radius * laps
    ramp = min(speed / _RAMP_ACCELERATION, length / speed)
    law = Cruise(tau * laps, speed / radius, ramp, ramp, cosine_ramp)
    return TimedCurve("circle", Helix(radius), law, HeldHeading(), longest_duration)


def helix(radius: float, rise: float, laps: Laps) -> TimedCurve:
    """A circle that climbs by `rise` metres in each lap, or sinks if `rise` is negative.

    Raises:
        TrajectoryError: see `circle`; also if `rise` is not finite.
    """
    if not isfinite(rise):
        raise TrajectoryError("the rise of a helix must be finite")
    return _flown_laps("helix", radius, Helix(radius, rise), laps, TangentHeading(pi / 2.0, -1.0))


def gerono_eight(half_width: float, laps: Laps) -> TimedCurve:
    """A lemniscate of Gerono, `half_width` metres to both sides along `laps.direction`.

    Its phase advances at a steady rate, as is usual in the literature, so the vehicle is fastest in
    the middle.

    Raises:
        TrajectoryError: see `circle`; also if the number of laps is not whole.
    """
    return _eight("gerono eight", half_width, GeronoEight(half_width), laps)


def bernoulli_eight(half_width: float, laps: Laps) -> TimedCurve:
    """A lemniscate of Bernoulli, `half_width` metres to both sides along `laps.direction`.

    Its phase advances at a steady rate, so the vehicle is fastest at the tips.

    Raises:
        TrajectoryError: see `gerono_eight`.
    """
    return _eight("bernoulli eight", half_width, BernoulliEight(half_width), laps)


def _eight(name: str, half_width: float, curve: Figure, laps: Laps) -> TimedCurve:
    if laps.laps % 1.0:
        raise TrajectoryError("the number of laps of a figure-eight must be a whole number")
    return _flown_laps(name, half_width, curve, laps, TangentHeading(-pi / 2.0))


def _flown_laps(
    name: str, size: float, curve: Figure, laps: Laps, tangent: TangentHeading
) -> TimedCurve:
    if not all(0.0 < value < inf for value in (size, laps.speed, laps.laps, laps.acceleration)):
        raise TrajectoryError(f"size, speed, laps and acceleration of a {name} must be positive")
    length, rate = tau * laps.laps, laps.speed / curve.path_per_phase
    ramp = min(
        SEPTIC_SLOPE * laps.speed / laps.acceleration, _LONGEST_RAMP_FRACTION * length / rate
    )
    if laps.direction:
        curve = RotatedFigure(curve, laps.direction)
        tangent = replace(tangent, middle=tangent.middle + laps.direction)
    heading = tangent if laps.face_path else HeldHeading()
    return TimedCurve(name, curve, Cruise(length, rate, ramp, ramp), heading)
