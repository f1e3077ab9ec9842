"""The header of a CSV file: which columns hold which quantity, and in which frame."""

import re
from collections.abc import Iterator
from itertools import chain
from typing import Any

from companion.guidance.trajectory.sample import TrajectoryError

_Spellings = tuple[tuple[str, ...], ...]


def _axis_columns(*patterns: str) -> _Spellings:
    return tuple(tuple(pattern.format(axis) for axis in "xyz") for pattern in patterns)


_SPELLINGS: dict[str, _Spellings] = {
    "time": (("t",), ("time",), ("timestamp",)),
    "position": _axis_columns("p_{}", "{}", "p{}", "pos_{}"),
    "velocity": _axis_columns("v_{}", "v{}", "vel_{}", "d{}"),
    "acceleration": _axis_columns("a_lin_{}", "a_{}", "a{}", "acc_{}", "dd{}"),
    "yaw": (("yaw",), ("psi",), ("heading",)),
    "quaternion": (("q_w", "q_x", "q_y", "q_z"), ("qw", "qx", "qy", "qz")),
}
"""Column names of each quantity, in lower case. The first complete set is used."""

_UNIT = re.compile(r"(.*?)(?:_| ?[\[(])(m_s2|m/s\^?2|m/s²|m_s|m/s|rad|m|s)[\])]?")
"""A column name followed by its unit."""
_OTHER_UNIT = re.compile(r"(.*?)(?:_| ?[\[(])(deg|°|ms|us|ns|cm|mm|ft)[\])]?")
"""A column name followed by a unit that is refused."""
_FRAME = re.compile(r"#\s*frame\s*[:=]\s*(\S+)\s*")

_LONGEST_EXCERPT = 60
"""Largest number of characters that a message quotes from the file."""


def rows_of(reader: Any, frames: list[str], name: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the cells of the header and of each sample.

    Args:
        reader: a reader of the `csv` module.
        frames: receives the name of each frame in comments before the header.
        name: the file's name, for error messages.

    Raises:
        TrajectoryError: a comment after the header names a frame. If this comment were ignored, the
            vehicle would fly the table in another frame, such as down instead of up.
    """
    header = True
    for row in reader:
        if not row:
            continue
        if not row[0].lstrip().startswith("#"):
            header = False
            yield reader.line_num, row
        elif found := _FRAME.fullmatch(",".join(row).strip().lower()):
            if not header:
                raise TrajectoryError(
                    f"{name}, line {reader.line_num}: the frame is named below the header; move "
                    "this comment to the first line"
                )
            frames.append(found[1])


def without_unit(column: str) -> str:
    """The name of a column without its unit."""
    match = _UNIT.fullmatch(column)
    return match[1] if match else column


def columns_of(
    header: list[str], columns_with_units: list[str], name: str
) -> dict[str, tuple[str, ...]]:
    """The columns of the file for each quantity.

    Args:
        header: names of the columns, without their units.
        columns_with_units: names of the columns with their units, in lower case.
        name: the file's name, for error messages.

    Raises:
        TrajectoryError: time or position is missing, a column is named twice, or the first line is
            not a header, is not separated by commas, or names a unit that is not read.
    """
    _require_header(columns_with_units, name)
    groups = {}
    for group, spellings in _SPELLINGS.items():
        found = [names for names in spellings if all(column in header for column in names)]
        if found:
            groups[group] = found[0]
        elif group in ("time", "position"):
            raise TrajectoryError(f"{name}: {_missing(group, header)}")
    if "velocity" not in groups:
        groups.pop("acceleration", None)
    for column in chain.from_iterable(groups.values()):
        if header.count(column) > 1:
            raise TrajectoryError(
                f"{name}: the header names the column {column} more than once; keep one of them"
            )
    return groups


def _require_header(columns_with_units: list[str], name: str) -> None:
    """Check that the first line names columns, separated by commas, in units that are read."""
    columns = excerpt(",".join(columns_with_units))
    if len(columns_with_units) == 1 and (found := re.search("[;\t]", columns_with_units[0])):
        separator = "semicolons" if found[0] == ";" else "tabs"
        raise TrajectoryError(
            f"{name}: its columns are separated by {separator}; use commas, and points for decimals"
        )
    if all(_is_number(column) for column in columns_with_units):
        raise TrajectoryError(
            f"{name}: its first line must name the columns, such as t,x,y,z; found {columns}"
        )
    known_columns = {
        column for spellings in _SPELLINGS.values() for names in spellings for column in names
    }
    for column in columns_with_units:
        found = _OTHER_UNIT.fullmatch(column)
        if found and found[1] in known_columns:
            raise TrajectoryError(
                f"{name}: the column {column} is in {found[2]}; give {found[1]} in s, m or rad"
            )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _missing(group: str, header: list[str]) -> str:
    """A message that columns of a quantity are missing; it shows the columns that were found."""
    spellings = _SPELLINGS[group]
    expected = " or ".join(",".join(names) for names in spellings)
    nearest = max(spellings, key=lambda names: sum(column in header for column in names))
    missing = [column for column in nearest if column not in header]
    if len(missing) < len(nearest):
        missing_text = f"the column {' and '.join(missing)} of the {group} is missing"
    else:
        missing_text = f"the header names no {group}"
    frame = " (if in NED, below a line `# frame: ned`)" if group == "position" else ""
    return f"{missing_text}; expected {expected}{frame}, found {excerpt(','.join(header))}"


def excerpt(text: str) -> str:
    """Text of the file, shortened for a message."""
    return text if len(text) <= _LONGEST_EXCERPT else text[:_LONGEST_EXCERPT] + "…"
