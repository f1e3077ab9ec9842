"""Notes for the user: how a table was read, and how far a curve leaves the lines of its points."""

from math import tau
from pathlib import Path

import numpy as np

from companion.guidance.trajectory import Frame, Table, Trajectory
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.spline_curve import SplineCurve
from companion.guidance.trajectory.timed_curve import TimedCurve
from companion.guidance.trajectory.waypoints import largest_detour

_MOST_COLUMNS_SHOWN = 10
_SMALLEST_REPORTED_DETOUR = 0.05
"""Smallest distance of a curve from the lines between its points that a note reports, m."""
_SHORTEST_RAMP = 0.05
"""Shortest extra duration by ramps that a note reports, s."""
_LARGEST_YAW_RANGE = 13.0
"""Largest range of yaw without a note, rad: a little over two turns; more may be degrees."""
_MOST_ROWS_COMPARED = 2000
"""Tables with more rows are not compared with the path, because their rows are dense."""
_SMALLEST_DEGREES, _LARGEST_DEGREES = 1e-6, 0.01
"""A horizontal range of a table between these, m, may be degrees: of 0.1 m to 1 km."""

_AXES = {
    Frame.ENU: "x east, y north, z up (enu)",
    Frame.NWU: "x north, y west, z up (nwu)",
    Frame.NED: "x north, y east, z down (ned)",
}


def table_notes(
    path: Path, frame: Frame | None, table: Table, trajectory: TimedCurve
) -> tuple[str, ...]:
    """Notes on a table: its frame, its unused columns, and ramps that were added."""
    axes_note = f"{path.name} is read in s, m and rad with {_AXES[frame or Frame.ENU]}"
    if frame is None:
        axes_note += (
            ", because it names no frame; to name one, write `# frame: ned` in the table's first "
            "line, or set csv.frame in the YAML file that names the table"
        )
    notes = [axes_note]
    if table.unused_columns:
        column_names = ", ".join(table.unused_columns[:_MOST_COLUMNS_SHOWN])
        notes.append(f"{path.name}: these columns are not used: {column_names}")
    level_range = float(np.ptp(table.position[:, :2], axis=0).max())
    if _SMALLEST_DEGREES < level_range < _LARGEST_DEGREES:
        notes.append(
            f"{path.name} moves by only {1000.0 * level_range:.1f} mm horizontally; if the columns "
            "are latitude and longitude in degrees, convert them to m"
        )
    if table.yaw is not None and (yaw_range := float(np.ptp(table.yaw))) > _LARGEST_YAW_RANGE:
        notes.append(
            f"{path.name}: its yaw turns by {yaw_range:.4g} rad, {yaw_range / tau:.1f} turns; if "
            "the column is in degrees, convert it to rad"
        )
    table_duration = float(table.times[-1])
    if trajectory.duration > table_duration + _SHORTEST_RAMP:
        notes.append(
            f"{path.name} begins or ends in motion: ramps from and to rest make it last "
            f"{trajectory.duration:.1f} s instead of {table_duration:.1f} s"
        )
    if table.times.size <= _MOST_ROWS_COMPARED:
        notes += detour_notes(trajectory, table.times, "give more rows")
    return tuple(notes)


def detour_notes(
    trajectory: Trajectory, times: Floats | None = None, remedy: str = "set waypoints.stops: true"
) -> tuple[str, ...]:
    """A note on how far a curve leaves the straight lines between its points; may be empty.

    Args:
        trajectory: the trajectory; only a spline has a note.
        times: (k,), times of the points on the spline, s; None: its knots.
        remedy: what to do to fly along the lines.
    """
    if not (isinstance(trajectory, TimedCurve) and isinstance(trajectory.curve, SplineCurve)):
        return ()
    detour = largest_detour(trajectory.curve.spline, times)
    if detour < _SMALLEST_REPORTED_DETOUR:
        return ()
    return (
        f"{trajectory.name}: the curve leaves the straight lines between its points by up to "
        f"{detour:.1f} m; to fly along the lines, {remedy}",
    )
