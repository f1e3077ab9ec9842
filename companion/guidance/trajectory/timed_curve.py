"""A curve run through by a time law: the chain rule, once, for all trajectories."""

from dataclasses import dataclass
from math import atan2, remainder, tau
from typing import Protocol

from companion.guidance.trajectory.check_times import check_times
from companion.guidance.trajectory.curves import Curve, CurvePoint
from companion.guidance.trajectory.sample import Sample, Vector
from companion.guidance.trajectory.time_laws import TimeLaw


class Heading(Protocol):
    """Heading along a curve."""

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """Heading in rad, and its derivative by the phase, at a point of the curve."""
        ...


class HeldHeading:
    """The heading that was there at the start."""

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """0, always."""
        return 0.0, 0.0


@dataclass(frozen=True, slots=True)
class TangentHeading:
    """Along the curve; for curves whose first derivative is never vertical or zero.

    Attributes:
        middle: the heading never strays further than π from it, so that it does not jump, rad.
        winding: `middle` turns by so much per unit of phase, rad.
    """

    middle: float
    winding: float = 0.0

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """Of the tangent."""
        (north, east, _), (north2, east2, _) = point.first, point.second
        turn = (north * east2 - east * north2) / (north * north + east * east)
        middle = self.middle + self.winding * phase
        return middle + remainder(atan2(east, north) - middle, tau), turn


@dataclass(frozen=True, slots=True)
class TimedCurve:
    """A trajectory: a curve, a time law along it and a heading.

    Attributes:
        name: what the user calls it.
        curve: where.
        law: when.
        heading: facing where.
    """

    name: str
    curve: Curve
    law: TimeLaw
    heading: Heading

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self.law.duration

    @property
    def holds_heading(self) -> bool:
        """Whether it keeps the heading it finds."""
        return isinstance(self.heading, HeldHeading)

    def check_times(self) -> list[float]:
        """When to look at it to judge all of it, s.

        Raises:
            TrajectoryError: it is too long to be judged.
        """
        return check_times(self.curve.looks(), self.law)

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the beginning."""
        phase, r, s, t = self.law.at(time)
        point = self.curve.at(phase)
        position, first, second, third = point
        heading, turn = self.heading.at(phase, point)
        return Sample(
            position,
            _sum(first, r, second, 0.0, third, 0.0),
            _sum(first, s, second, r * r, third, 0.0),
            _sum(first, t, second, 3.0 * r * s, third, r * r * r),
            heading,
            turn * r,
        )


def _sum(a: Vector, x: float, b: Vector, y: float, c: Vector, z: float) -> Vector:
    """x·a + y·b + z·c."""
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
    )
