"""Curves in space with three exact derivatives; the curve parameter is called the phase.

Each curve begins at (0, 0, 0). Angles are radians, lengths metres, the frame is NED.
"""

from abc import abstractmethod
from dataclasses import dataclass
from math import cos, hypot, sin, sqrt, tau
from typing import NamedTuple, Protocol

from companion.guidance.trajectory.sample import TrajectoryError, Vector


class CurvePoint(NamedTuple):
    """A point of a curve, m, and its first three derivatives by the phase."""

    position: Vector
    first_derivative: Vector
    second_derivative: Vector
    third_derivative: Vector


class PhaseSampling(NamedTuple):
    """Phases at which to check a curve against limits, close enough not to miss an extreme.

    Attributes:
        phase_step: phase between two checks; None if `phases` lists the checks.
        period: phase after which the curve repeats, apart from a steady climb; None if it does not.
        phases: the phases of the checks, ascending; empty if `phase_step` is given.
    """

    phase_step: float | None
    period: float | None = None
    phases: tuple[float, ...] = ()


PATH_STEP = 0.25
"""Longest path between two checks, m."""

MOST_CHECKS = 80_000
"""Largest number of checks of one trajectory; they take about a second."""

_CHECKS_PER_LAP = 720
"""Checks of one lap. An extreme of the k-th harmonic is missed by at most 0.001 k² %."""


def require_checkable(needed: float) -> None:
    """Refuse a trajectory that needs more than `MOST_CHECKS` checks.

    Raises:
        TrajectoryError: `needed`, the number of checks, is larger.
    """
    if not needed <= MOST_CHECKS:
        raise TrajectoryError(
            f"it is too long to be checked: it takes {needed:.3g} samples, more than "
            f"{MOST_CHECKS}; make it shorter, or raise its acceleration"
        )


class Curve(Protocol):
    """A curve over its phase."""

    def at(self, phase: float) -> CurvePoint:
        """The point at `phase`."""

    def sampling(self) -> PhaseSampling:
        """The phases at which to check the curve against limits.

        Raises:
            TrajectoryError: the curve needs too many checks.
        """


class Figure(Curve, Protocol):
    """A curve that is flown in laps, all of them alike; its phase is an angle."""

    @property
    @abstractmethod
    def path_per_phase(self) -> float:
        """Largest length of the first derivative, m per rad."""

    def sampling(self) -> PhaseSampling:
        """The phases at which to check one lap."""
        return PhaseSampling(min(tau / _CHECKS_PER_LAP, PATH_STEP / self.path_per_phase), tau)


@dataclass(frozen=True, slots=True)
class Straight:
    """A straight line. Its phase is the distance from the start, m.

    Attributes:
        direction: unit vector, NED.
    """

    direction: Vector

    def sampling(self) -> PhaseSampling:
        """The phases at which to check the line: at equal distances."""
        return PhaseSampling(PATH_STEP)

    def at(self, phase: float) -> CurvePoint:
        """The point at the distance `phase` (m) from the start."""
        north, east, down = self.direction
        zero = (0.0, 0.0, 0.0)
        return CurvePoint((phase * north, phase * east, phase * down), self.direction, zero, zero)


@dataclass(frozen=True, slots=True)
class Helix(Figure):
    """Laps about a centre north of the start, first eastwards; the phase grows by 2π in each lap.

    Attributes:
        radius: distance of the centre from the start, m.
        rise: climb in each lap, m; 0 makes a circle.
    """

    radius: float
    rise: float = 0.0

    @property
    def path_per_phase(self) -> float:
        """Length of the first derivative, m per rad; constant."""
        return hypot(self.radius, self.rise / tau)

    def at(self, phase: float) -> CurvePoint:
        """The point at the angle `phase`."""
        r, up = self.radius, self.rise / tau
        s, c = r * sin(phase), r * cos(phase)
        return CurvePoint((r - c, s, -up * phase), (s, c, -up), (c, -s, 0.0), (-s, -c, 0.0))


@dataclass(frozen=True, slots=True)
class GeronoEight(Figure):
    """Lemniscate of Gerono, (A sin φ, A sin φ cos φ) north and east; it begins in the middle.

    Attributes:
        half_width: A, m.
    """

    half_width: float

    @property
    def path_per_phase(self) -> float:
        """Largest length of the first derivative, m per rad: in the middle."""
        return sqrt(2.0) * self.half_width

    def at(self, phase: float) -> CurvePoint:
        """The point at the angle `phase`."""
        a = self.half_width
        s, c = a * sin(phase), a * cos(phase)
        s2, c2 = a * sin(2.0 * phase), a * cos(2.0 * phase)
        return CurvePoint(
            (s, 0.5 * s2, 0.0), (c, c2, 0.0), (-s, -2.0 * s2, 0.0), (-c, -4.0 * c2, 0.0)
        )


@dataclass(frozen=True, slots=True)
class BernoulliEight(Figure):
    """Lemniscate of Bernoulli, (A sin φ, A sin φ cos φ)/(1 + cos² φ) north and east.

    Attributes:
        half_width: A, m.
    """

    half_width: float

    @property
    def path_per_phase(self) -> float:
        """Largest length of the first derivative, m per rad: at the tips."""
        return self.half_width

    def at(self, phase: float) -> CurvePoint:
        """The point at the angle `phase`."""
        a = self.half_width
        s, c, s2, c2 = sin(phase), cos(phase), sin(2.0 * phase), cos(2.0 * phase)
        denominator = (0.5 * (3.0 + c2), -s2, -2.0 * c2, 4.0 * s2)
        n = _quotient((a * s, a * c, -a * s, -a * c), denominator)
        e = _quotient((0.5 * a * s2, a * c2, -2.0 * a * s2, -4.0 * a * c2), denominator)
        return CurvePoint(*((n[k], e[k], 0.0) for k in range(4)))


@dataclass(frozen=True, slots=True)
class RotatedFigure(Figure):
    """A figure rotated about the vertical through its start.

    Attributes:
        figure: the figure that is rotated.
        angle: rotation, clockwise seen from above, rad.
    """

    figure: Figure
    angle: float

    @property
    def path_per_phase(self) -> float:
        """`path_per_phase` of the figure."""
        return self.figure.path_per_phase

    def at(self, phase: float) -> CurvePoint:
        """The rotated point at `phase`."""
        s, c = sin(self.angle), cos(self.angle)
        return CurvePoint(*((c * n - s * e, s * n + c * e, d) for n, e, d in self.figure.at(phase)))


_ValueAndDerivatives = tuple[float, float, float, float]
"""A value and its first three derivatives."""


def _quotient(
    numerator: _ValueAndDerivatives, denominator: _ValueAndDerivatives
) -> _ValueAndDerivatives:
    """Value and derivatives of a quotient q, by Leibniz' rule for numerator = q·denominator."""
    n0, n1, n2, n3 = numerator
    d0, d1, d2, d3 = denominator
    q0 = n0 / d0
    q1 = (n1 - q0 * d1) / d0
    q2 = (n2 - 2.0 * q1 * d1 - q0 * d2) / d0
    q3 = (n3 - 3.0 * q2 * d1 - 3.0 * q1 * d2 - q0 * d3) / d0
    return q0, q1, q2, q3
