"""A smooth trajectory through the samples of a table, given in ENU, NWU or NED."""

from enum import Enum
from math import inf
from typing import NamedTuple

import numpy as np

from companion.guidance.trajectory.checked_table import checked_table
from companion.guidance.trajectory.csv_file import Table
from companion.guidance.trajectory.sample import TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats, SepticSpline
from companion.guidance.trajectory.spline_curve import (
    HEADING_CHECK_STEP,
    SplineCurve,
    heading_spline,
    smoothing_spline,
    tangent_heading,
)
from companion.guidance.trajectory.time_laws import SEPTIC_SLOPE, Cruise
from companion.guidance.trajectory.timed_curve import (
    Heading,
    HeldHeading,
    TimedCurve,
    require_duration,
)

_REST_SPEED = 0.1
"""Samples that begin or end more slowly than this count as at rest there, m/s."""

_CHECKS_PER_PIECE = 16
"""Checks of each piece of the spline; a piece lasts half a period of the cutoff frequency."""

_MOST_PIECES = 4500
"""Largest number of pieces of the spline; the fit then takes a second."""

_LONGEST_RAMP_FRACTION = 0.5
"""Longest ramp from or to rest, as a share of the duration of the samples."""


class _Quantity(NamedTuple):
    """A derivative in a file, and the RMS by which it may differ from the spline's derivative.

    The permitted RMS is absolute_tolerance + relative_tolerance · RMS of the derivative. It is
    needed because published accelerations may jump, and the acceleration of a spline cannot.

    Attributes:
        name: name of the derivative in messages.
        unit: unit of the derivative and of `absolute_tolerance`.
        relative_tolerance: error allowed for each unit of the derivative's RMS.
        absolute_tolerance: error that is always allowed.
    """

    name: str
    unit: str
    relative_tolerance: float
    absolute_tolerance: float


_DERIVATIVE_QUANTITIES = (
    _Quantity("velocity", "m/s", 0.2, 0.1),
    _Quantity("acceleration", "m/s²", 0.5, 1.0),
)


class Frame(Enum):
    """World frames in which files give positions and yaw."""

    ENU = "enu"
    """x east, y north, z up; yaw anticlockwise from east (ROS, REP 103)."""
    NWU = "nwu"
    """x north, y west, z up; yaw anticlockwise from north."""
    NED = "ned"
    """x north, y east, z down; yaw clockwise from north."""


class _ToNed(NamedTuple):
    """Conversion to NED: a rotation matrix (3, 3), and heading = offset + sign·yaw, rad."""

    rotation: Floats
    offset: float
    sign: float


_TO_NED = {
    Frame.ENU: _ToNed(np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.pi / 2.0, -1.0),
    Frame.NWU: _ToNed(np.diag([1.0, -1.0, -1.0]), 0.0, -1.0),
    Frame.NED: _ToNed(np.eye(3), 0.0, 1.0),
}


class HeadingFrom(Enum):
    """Source of the heading."""

    FIXED = "fixed"
    """Hold the heading at the start."""
    ALONG_PATH = "along"
    """Face along the path."""
    FILE = "file"
    """Follow the samples' yaw; hold the heading if they have none."""


class SampleOptions(NamedTuple):
    """How to interpret the samples.

    Attributes:
        frame: frame of the samples.
        heading: source of the heading.
        cutoff: cutoff frequency, Hz. Faster changes are smoothed away as noise.
        acceleration: largest acceleration along the path, m/s², of the ramp that is added where the
            samples begin or end in motion. Samples of short duration may need more.
    """

    frame: Frame = Frame.ENU
    heading: HeadingFrom = HeadingFrom.FILE
    cutoff: float = 5.0
    acceleration: float = 3.0


def from_samples(table: Table, options: SampleOptions, name: str = "csv") -> TimedCurve:
    """A smooth trajectory through samples, from rest to rest.

    Where the samples begin or end in motion, the trajectory follows them more slowly, by a ramp
    from or to rest. The trajectory then lasts longer than the samples.

    Raises:
        TrajectoryError: velocity or acceleration is not the derivative of the position, the samples
            last too long, or the heading should follow a path that never moves horizontally; the
            table names another frame than the options, has arrays of other shapes than in `Table`,
            or a number that is not finite; an option is out of range.
        ArithmeticError, numpy.linalg.LinAlgError: numerical errors; see
            `reporting_numerical_errors`.
    """
    table = checked_table(table)
    _require_options(table, options)
    _require_short(table, options.cutoff)
    to_ned = _TO_NED[options.frame]
    position = (table.position - table.position[0]) @ to_ned.rotation.T
    derivatives = tuple(values @ to_ned.rotation.T for values in table.derivatives)
    spline = smoothing_spline(table.times, position, options.cutoff, derivatives)
    _require_derivatives(spline, table.times, derivatives)
    speeds = [_speed(spline, end) for end in (spline.begin, spline.end)]
    resting = speeds[0] < _REST_SPEED, speeds[1] < _REST_SPEED
    spline = smoothing_spline(table.times, position, options.cutoff, derivatives, resting)
    rise_time, fall_time = [
        0.0
        if is_resting
        else min(SEPTIC_SLOPE * speed / options.acceleration, _LONGEST_RAMP_FRACTION * spline.end)
        for is_resting, speed in zip(resting, speeds, strict=True)
    ]
    law = Cruise(spline.end, 1.0, rise_time, fall_time)
    heading = _heading(spline, table, options, resting)
    step = inf if isinstance(heading, HeldHeading) else HEADING_CHECK_STEP
    return TimedCurve(name, SplineCurve(spline, _CHECKS_PER_PIECE, step), law, heading)


def _require_options(table: Table, options: SampleOptions) -> None:
    """Check options from a user's program; those from YAML files are checked when they are read."""
    if not isinstance(options.frame, Frame):
        raise TrajectoryError(f"`frame` must be a Frame, such as Frame.NED, not {options.frame!r}")
    if table.frame not in (None, options.frame.value):
        raise TrajectoryError(
            f"the table is in the frame {table.frame}, and the options say {options.frame.value}; "
            f"pass SampleOptions(frame=Frame.{str(table.frame).upper()})"
        )
    if not (0.0 < options.cutoff < inf and 0.0 < options.acceleration < inf):
        raise TrajectoryError(
            f"cutoff and acceleration of samples must be positive, not {options.cutoff} Hz and "
            f"{options.acceleration} m/s²"
        )


def _require_short(table: Table, cutoff: float) -> None:
    """Check that the table is short enough to be fitted within bounded time."""
    duration = float(table.times[-1])
    require_duration(duration)
    if duration * 2.0 * cutoff > _MOST_PIECES:
        longest = _MOST_PIECES / (2.0 * cutoff)
        raise TrajectoryError(
            f"it lasts {duration:.4g} s, and {longest:.4g} s is the longest with cutoff_hz "
            f"{cutoff:g}; lower cutoff_hz, or fly a part of it"
        )


def _speed(spline: SepticSpline, time: float) -> float:
    return float(np.linalg.norm([axis[1] for axis in spline.at(time)]))


def _require_derivatives(
    spline: SepticSpline, times: Floats, derivatives: tuple[Floats, ...]
) -> None:
    """Check that velocity and acceleration are the derivatives of the position."""
    motion = spline.sampled(times)
    for order, (file_derivative, quantity) in enumerate(
        zip(derivatives, _DERIVATIVE_QUANTITIES, strict=False), 1
    ):
        errors = np.linalg.norm(motion[:, :, order] - file_derivative, axis=1)
        sizes = np.linalg.norm(file_derivative, axis=1)
        tolerance = (
            quantity.relative_tolerance * _root_mean_square(sizes) + quantity.absolute_tolerance
        )
        if _root_mean_square(errors) > tolerance:
            worst = int(np.argmax(errors))
            raise TrajectoryError(
                f"the {quantity.name} is not the derivative of the positions: at "
                f"{times[worst]:.2f} s it is off by {errors[worst]:.1f} {quantity.unit}; check its "
                "frame, and that it excludes gravity, or leave its columns out"
            )


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _heading(
    spline: SepticSpline, table: Table, options: SampleOptions, resting: tuple[bool, bool]
) -> Heading:
    if options.heading is HeadingFrom.ALONG_PATH:
        return tangent_heading(spline, resting)
    if options.heading is HeadingFrom.FIXED or table.yaw is None:
        return HeldHeading()
    _, offset, sign = _TO_NED[options.frame]
    return heading_spline(table.times, offset + sign * table.yaw, resting)
