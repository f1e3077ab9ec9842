"""Trajectories from CSV files, as Agilicious and others publish them.

A header names the columns, such as Agilicious' `t,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,…,a_lin_x,…` or
`t,x,y,z,yaw,vx,vy,vz,ax,ay,az`. Units are s, m and rad. Time and position are required. Velocity
is used if present, acceleration if velocity is present too. Yaw is used if present, else the
quaternion (w first). Other columns are ignored. A name may end in its unit: `x_m`, `vx_m_s`,
`yaw_rad`. A comment before the header, `# frame: ned`, tells the frame.
"""

import csv
import io
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

import numpy as np

from companion.files.bounded_file import FileRefusedError, read_text
from companion.guidance.trajectory.csv_header import columns_of, excerpt, rows_of, without_unit
from companion.guidance.trajectory.csv_yaw import yaw_of
from companion.guidance.trajectory.sample import LARGEST_COORDINATE, LARGEST_SPEED, TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats

FEWEST_SAMPLES = 4
"""Smallest number of samples of a table; fewer do not determine a smooth curve."""

_MOST_SAMPLES = 50_000
"""Largest number of samples of a table; reading them takes half a second."""

_MOST_BYTES = 20_000_000
"""Largest size of a file, bytes: `_MOST_SAMPLES` samples of twenty columns with all digits."""

_SHORTEST_PERIOD, _LONGEST_PERIOD = 1e-4, 10.0
"""Shortest and longest time between two samples, s."""

_SHORTEST_DURATION = 0.1
"""Shortest duration of a table, s."""

_LARGEST_VALUES = {
    "time": (1e10, "s"),
    "position": (LARGEST_COORDINATE, "m from the first position; write positions in m"),
    "velocity": (LARGEST_SPEED, "m/s"),
    "acceleration": (1000.0, "m/s²"),
    "yaw": (1e4, "rad"),
    "quaternion": (2.0, "for a component"),
}
"""Largest magnitude of each quantity, and its unit in messages."""

_LENGTH_ERROR = 0.1
"""Largest error of a quaternion's length. Files hold rounded numbers."""


@dataclass(frozen=True, slots=True)
class Table:
    """The samples of a file, in the file's own frame.

    Attributes:
        times: (m,), time of each sample, s, increasing from 0.
        position: (m, 3), m.
        derivatives: velocity in m/s, then acceleration in m/s², (m, 3) each, if the file has them.
        yaw: tilt-yaw heading (m,), rad, unwrapped; None if the file has neither yaw nor quaternion.
        frame: the frame that the comment before the header names; None without such a comment.
        unused_columns: names of the columns that are not read, in lower case, without their units.
    """

    times: Floats
    position: Floats
    derivatives: tuple[Floats, ...]
    yaw: Floats | None
    frame: str | None = None
    unused_columns: tuple[str, ...] = ()


def read_csv(path: Path) -> Table:
    """Read a CSV file.

    Raises:
        TrajectoryError: the file cannot be read or is too large, its header lacks a column, names
            one twice or names another unit, a row has too many values, a value is not a number or
            is out of range, a yaw seems to be in degrees, a quaternion does not have length 1, or
            the duration, a time step or the number of samples is out of range.
    """
    try:
        text = read_text(path, _MOST_BYTES)
        return parse_csv(io.StringIO(text, newline=""), str(path))
    except FileRefusedError as error:
        raise TrajectoryError(f"{path}: {error}") from error
    except csv.Error as error:
        raise TrajectoryError(f"{path}: not a CSV file") from error


def parse_csv(lines: Iterable[str], name: str) -> Table:
    """Parse lines of text; the first one that is neither empty nor a comment is the header.

    Args:
        lines: the text. Empty lines and comments, which begin with #, are skipped. But a comment
            before the header may name the frame; a frame after the header is refused.
        name: the file's name, for error messages.

    Raises:
        TrajectoryError: the table is wrong; see `read_csv`.
        csv.Error: the text is not CSV.
    """
    frames: list[str] = []
    rows = list(itertools.islice(rows_of(csv.reader(lines), frames, name), _MOST_SAMPLES + 2))
    too_few_text = f"{name}: needs a header and at least {FEWEST_SAMPLES} samples"
    if not rows:
        raise TrajectoryError(too_few_text)
    if len(rows) > _MOST_SAMPLES + 1:
        raise TrajectoryError(f"{name}: has more than {_MOST_SAMPLES} samples; leave some out")
    columns_with_units = [column.strip().lower() for column in rows[0][1]]
    header = [without_unit(column) for column in columns_with_units]
    groups = columns_of(header, columns_with_units, name)
    if len(rows) <= FEWEST_SAMPLES:
        raise TrajectoryError(too_few_text)
    _require_no_more_values(rows, name)
    data = {group: _numbers(rows[1:], header, names, name) for group, names in groups.items()}
    times = data["time"][:, 0]
    line_numbers = [line for line, _ in rows[1:]]
    _require_steps(times, line_numbers, name)
    for group, values in data.items():
        checked_values = values - values[0] if group == "position" else values
        _require_range(group, checked_values, groups[group], line_numbers, name)
    derivatives = [data[group] for group in ("velocity", "acceleration") if group in data]
    used_columns = {column for names in groups.values() for column in names}
    return Table(
        times - times[0],
        data["position"],
        tuple(derivatives),
        yaw_of(data, name),
        frames[0] if frames else None,
        tuple(column for column in header if column and column not in used_columns),
    )


def _require_no_more_values(rows: Sequence[tuple[int, Sequence[str]]], name: str) -> None:
    """Refuse rows with more values than the header has names; decimal commas make such rows.

    Some published files have rows that are too long. These files are accepted if all rows have the
    same number of values, and decimals have points.

    Raises:
        TrajectoryError: a row has too many values; the message names its line.
    """
    columns = len(rows[0][1])
    longer_row = next(((line, len(row)) for line, row in rows[1:] if any(row[columns:])), None)
    if longer_row is None:
        return
    has_equal_lengths = len({len(row) for _, row in rows[1:]}) == 1
    if has_equal_lengths and any("." in cell for _, row in rows[1:] for cell in row):
        return
    line, values = longer_row
    raise TrajectoryError(
        f"{name}, line {line}: {values} values for {columns} columns; "
        "write decimals with a point, and as many values as the header has names"
    )


def _numbers(
    rows: Sequence[tuple[int, Sequence[str]]], header: list[str], names: tuple[str, ...], name: str
) -> Floats:
    """The values (m, k) of the k columns `names`; messages call the file `name`."""
    columns = [header.index(column) for column in names]
    numbers = np.empty((len(rows), len(columns)))
    for k, (line, row) in enumerate(rows):
        for i, column in enumerate(columns):
            text = row[column] if column < len(row) else ""
            try:
                number = float(text)
            except ValueError:
                number = nan
            # Python would read 1_0 as 10.
            if not isfinite(number) or "_" in text:
                raise TrajectoryError(
                    f"{name}, line {line}: {names[i]} is {excerpt(text)!r}, not a number"
                )
            numbers[k, i] = number
    return numbers


def _require_steps(times: Floats, line_numbers: Sequence[int], name: str) -> None:
    """Check each step in time (`_SHORTEST_PERIOD` to `_LONGEST_PERIOD`) and the duration."""
    steps = np.diff(times)
    wrong_steps = np.flatnonzero(
        ~((steps >= 0.999 * _SHORTEST_PERIOD) & (steps <= _LONGEST_PERIOD))
    )
    if wrong_steps.size:
        step, line = float(steps[wrong_steps[0]]), line_numbers[int(wrong_steps[0]) + 1]
        if step <= 0.0:
            raise TrajectoryError(
                f"{name}, line {line}: time does not increase; leave this sample out"
            )
        raise TrajectoryError(
            f"{name}, line {line}: {step:.3g} s after the previous sample; write time in s, with "
            f"steps from {_SHORTEST_PERIOD:g} to {_LONGEST_PERIOD:g} s"
        )
    if times[-1] - times[0] < _SHORTEST_DURATION:
        raise TrajectoryError(f"{name}: lasts less than {_SHORTEST_DURATION:g} s; write time in s")


def _require_range(
    group: str, values: Floats, names: tuple[str, ...], line_numbers: Sequence[int], name: str
) -> None:
    """Check that a quantity is within its range, and that a quaternion has the length 1.

    Raises:
        TrajectoryError: a value is out of range; the message names the line.
    """
    limit, unit = _LARGEST_VALUES[group]
    outside = np.argwhere(~(np.abs(values) <= limit))
    if outside.size:
        k, i = (int(index) for index in outside[0])
        line, value = line_numbers[k], values[k, i]
        raise TrajectoryError(
            f"{name}, line {line}: {names[i]} is {value:.3g}, more than {limit:g} {unit}"
        )
    if group == "quaternion":
        lengths = np.linalg.norm(values, axis=1)
        wrong = np.flatnonzero(np.abs(lengths - 1.0) > _LENGTH_ERROR)
        if wrong.size:
            raise TrajectoryError(
                f"{name}, line {line_numbers[int(wrong[0])]}: the quaternion has the length "
                f"{lengths[wrong[0]]:.3g}, not 1; give unit quaternions, or leave their columns out"
            )
