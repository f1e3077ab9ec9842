"""Septic splines as curves and as headings; their phase is the spline's own time in s."""

from dataclasses import dataclass

import numpy as np

from companion.guidance.trajectory.curves import (
    PATH_STEP,
    CurvePoint,
    PhaseSampling,
    require_checkable,
)
from companion.guidance.trajectory.minimum_snap import FixedStates, Observations, minimum_snap
from companion.guidance.trajectory.sample import TrajectoryError
from companion.guidance.trajectory.septic_spline import STATE_SIZE, Floats, SepticSpline

_HEADING_CUTOFF = 2.0
"""Cutoff frequency of every `heading_spline`, Hz: no vehicle follows a faster heading."""

HEADING_CHECK_STEP = 1.0 / (32.0 * _HEADING_CUTOFF)
"""Longest time between two check points of a trajectory whose heading is a `heading_spline`, s."""

_HEADING_STEP = 0.01
"""Sample period of the direction of flight, s."""

_SLOW_FRACTION = 0.1
"""Share of the largest horizontal speed below which the direction of flight is not used."""

_STANDING_SPEED = 0.01
"""Speed below which the direction of flight is not used, m/s."""


@dataclass(frozen=True, slots=True)
class SplineCurve:
    """A spline of north, east and down, in m.

    Attributes:
        spline: the spline, three times continuously differentiable.
        checks_per_piece: smallest number of check points in each piece; an extreme between two of
            them is missed by less than 0.3 %.
        longest_step: largest phase between two check points, s; a heading may need a short step.
    """

    spline: SepticSpline
    checks_per_piece: int = 64
    longest_step: float = np.inf

    def sampling(self) -> PhaseSampling:
        """Evenly spaced check points in each piece, more in long and in fast pieces.

        Raises:
            TrajectoryError: the curve needs too many check points.
        """
        knots = self.spline.knots
        spans = np.diff(knots)
        fractions = np.linspace(0.0, 1.0, 17)
        times = (knots[:-1, None] + spans[:, None] * fractions).ravel()
        velocity = self.spline.sampled(times)[:, :, 1]
        speeds = np.linalg.norm(velocity, axis=1).reshape(spans.size, -1).max(axis=1)
        counts = np.ceil(np.maximum(spans * speeds * 1.05 / PATH_STEP, spans / self.longest_step))
        counts = np.maximum(counts, self.checks_per_piece)
        require_checkable(float(counts.sum()))
        phase_arrays = [
            np.linspace(begin, end, int(count), endpoint=False)
            for begin, end, count in zip(knots[:-1], knots[1:], counts, strict=True)
        ]
        return PhaseSampling(
            None, phases=tuple(np.concatenate((*phase_arrays, knots[-1:])).tolist())
        )

    def at(self, phase: float) -> CurvePoint:
        """The point at the spline's time `phase`."""
        n, e, d = self.spline.at(phase)
        return CurvePoint(
            (n[0], e[0], d[0]), (n[1], e[1], d[1]), (n[2], e[2], d[2]), (n[3], e[3], d[3])
        )


@dataclass(frozen=True, slots=True)
class SplineHeading:
    """A spline of the heading, in rad."""

    spline: SepticSpline

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """Heading and its derivative at the spline's time `phase`."""
        ((heading, slope, _, _),) = self.spline.at(phase)
        return heading, slope


def smoothing_spline(
    times: Floats,
    values: Floats,
    cutoff: float,
    derivatives: tuple[Floats, ...] = (),
    resting: tuple[bool, bool] = (False, False),
) -> SepticSpline:
    """A smoothing spline through the first and last sample: a low-pass filter without delay.

    The spline minimises ∫ residual² dt + ∫ snap²/ω⁸ dt with ω = 2π·cutoff; the residual is sample
    minus spline. Without `derivatives` its frequency response is 1/(1 + (f/cutoff)⁸), which
    attenuates by 0.4 % at half the cutoff, and by 0.0015 % at a quarter.

    Args:
        times: (m,), time of each sample, increasing, s.
        values: (m, n), samples of n series.
        cutoff: cutoff frequency, Hz.
        derivatives: the first, second … derivatives of the samples, each (m, n), if known.
        resting: whether the spline is at rest at the first sample, and at the last.
    """
    omega = 2.0 * np.pi * cutoff
    knots = np.linspace(
        times[0], times[-1], int(np.ceil((times[-1] - times[0]) * 2.0 * cutoff)) + 1
    )
    states = np.zeros((knots.size, STATE_SIZE, values.shape[1]))
    mask = np.zeros((knots.size, STATE_SIZE), dtype=bool)
    for end, is_resting in zip((0, -1), resting, strict=True):
        states[end, 0] = values[end]
        mask[end] = True, is_resting, is_resting, is_resting
    weights = np.gradient(times)
    observations = (
        Observations(times, observed, weights / omega ** (2 * order), order)
        for order, observed in enumerate((values, *derivatives))
    )
    return minimum_snap(knots, FixedStates(states, mask), tuple(observations), omega**-8.0)


def heading_spline(times: Floats, headings: Floats, resting: tuple[bool, bool]) -> SplineHeading:
    """Smoothing spline of headings in rad at times in s, (m,) each."""
    return SplineHeading(
        smoothing_spline(times, headings[:, None], _HEADING_CUTOFF, resting=resting)
    )


def tangent_heading(spline: SepticSpline, resting: tuple[bool, bool]) -> SplineHeading:
    """Direction of flight along a spline of positions, interpolated where the speed is too low.

    Args:
        spline: spline of the positions, m.
        resting: whether the spline is at rest at its beginning, and at its end.

    Raises:
        TrajectoryError: the spline never moves horizontally.
    """
    count = int(np.ceil((spline.end - spline.begin) / _HEADING_STEP)) + 1
    times = np.linspace(spline.begin, spline.end, count)
    velocity = spline.sampled(times)[:, :2, 1]
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    is_moving = speed > max(_SLOW_FRACTION * speed.max(), _STANDING_SPEED)
    if not is_moving.any():
        raise TrajectoryError("the curve never moves horizontally, so it has no heading `along`")
    headings = np.unwrap(np.arctan2(velocity[is_moving, 1], velocity[is_moving, 0]))
    return heading_spline(times, np.interp(times, times[is_moving], headings), resting)
