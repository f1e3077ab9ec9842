"""Trajectories from CSV files, as Agilicious and others publish them.

A header names the columns: Agilicious' `t,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,…,a_lin_x,…` or
`t,x,y,z,yaw,vx,vy,vz,ax,ay,az` and their like; in s, m and rad, quaternions w first. Time and
position must be there; velocity, acceleration beside velocity, and yaw or else a quaternion are
used if they are; what else stands there is not.
"""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from companion.trajectory.sample import TrajectoryError
from companion.trajectory.septic_spline import Floats

_Spellings = tuple[tuple[str, ...], ...]


def _of_axes(*patterns: str) -> _Spellings:
    return tuple(tuple(pattern.format(axis) for axis in "xyz") for pattern in patterns)


_SPELLINGS: dict[str, _Spellings] = {
    "time": (("t",), ("time",), ("time_s",), ("timestamp",)),
    "position": _of_axes("p_{}", "{}", "p{}", "pos_{}"),
    "velocity": _of_axes("v_{}", "v{}", "vel_{}", "d{}"),
    "acceleration": _of_axes("a_lin_{}", "a_{}", "a{}", "acc_{}", "dd{}"),
    "yaw": (("yaw",), ("psi",), ("heading",)),
    "quaternion": (("q_w", "q_x", "q_y", "q_z"), ("qw", "qx", "qy", "qz")),
}
"""Column names by quantity, in lower case; the first spelling that is complete counts."""

_FEWEST = 4
"""Samples; fewer do not determine a smooth curve."""


@dataclass(frozen=True, slots=True)
class Table:
    """The samples of a file, in the file's own frame.

    Attributes:
        times: (m,), s, increasing from 0.
        position: (m, 3), m.
        derivatives: velocity, or velocity and acceleration, (m, 3) each, as far as the file goes.
        yaw: (m,), rad, of tilt-yaw and without jumps; None if the file does not tell.
    """

    times: Floats
    position: Floats
    derivatives: tuple[Floats, ...]
    yaw: Floats | None


def read(path: Path) -> Table:
    """Read a file.

    Raises:
        TrajectoryError: it cannot be read, a column is missing, a value is not a number, time does
            not increase, or there are too few samples.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return table(file, str(path))
    except OSError as error:
        raise TrajectoryError(f"{path}: cannot read it: {error.strerror}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise TrajectoryError(f"{path}: not a CSV file") from error


def table(lines: Iterable[str], name: str) -> Table:
    """Take the samples from lines of text, the first of them the header.

    Args:
        lines: of the file; empty ones and those that begin with # are passed over.
        name: stands for them in errors.

    Raises:
        TrajectoryError: as `read`.
    """
    reader = csv.reader(lines)
    rows = [(reader.line_num, row) for row in reader if row and not row[0].lstrip().startswith("#")]
    if len(rows) <= _FEWEST:
        raise TrajectoryError(f"{name}: needs a header and at least {_FEWEST} samples")
    header = [column.strip().lower() for column in rows[0][1]]
    groups = _groups(header, name)
    data = {group: _numbers(rows[1:], header, names, name) for group, names in groups.items()}
    times = data["time"][:, 0]
    stuck = np.flatnonzero(np.diff(times) <= 0.0)
    if stuck.size:
        line = rows[int(stuck[0]) + 2][0]
        raise TrajectoryError(f"{name}, line {line}: time does not increase")
    known = [data[group] for group in ("velocity", "acceleration") if group in data]
    return Table(times - times[0], data["position"], tuple(known), _yaw(data))


def _groups(header: list[str], name: str) -> dict[str, tuple[str, ...]]:
    """The columns of each quantity that the file tells."""
    groups = {}
    for group, spellings in _SPELLINGS.items():
        found = [names for names in spellings if all(column in header for column in names)]
        if found:
            groups[group] = found[0]
        elif group in ("time", "position"):
            known = " or ".join(",".join(names) for names in spellings)
            raise TrajectoryError(
                f"{name}: the header names no {group}; expected {known}, found {','.join(header)}"
            )
    if "velocity" not in groups:
        groups.pop("acceleration", None)
    return groups


def _numbers(
    rows: Sequence[tuple[int, Sequence[str]]],
    header: list[str],
    names: tuple[str, ...],
    name: str,
) -> Floats:
    """The columns of these names, (m, k)."""
    columns = [header.index(column) for column in names]
    numbers = np.empty((len(rows), len(columns)))
    for k, (line, row) in enumerate(rows):
        for i, column in enumerate(columns):
            text = row[column] if column < len(row) else ""
            try:
                numbers[k, i] = float(text)
            except ValueError:
                numbers[k, i] = np.nan
            if not np.isfinite(numbers[k, i]):
                raise TrajectoryError(f"{name}, line {line}: {names[i]} is {text!r}, not a number")
    return numbers


def _yaw(data: dict[str, Floats]) -> Floats | None:
    """From the yaw column, else from the quaternion."""
    if "yaw" in data:
        return np.unwrap(data["yaw"][:, 0])
    if "quaternion" in data:
        q = data["quaternion"]
        return np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
    return None
