"""Exports a recorded flight as CSV or Parquet: one file for each channel of numbers that has rows.

Three more tables join several channels: `tracking`, `rates` and `response` (see `FlightTrace`). The
figures of the summary are computed from these three tables.
"""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.extras import require
from companion.recording.flight_record import FlightRecord
from companion.recording.mcap_file.channels import CHANNELS
from companion.recording.measurements.recorded_summary import trace_of

_JOINED_TABLES = ("tracking", "rates", "response")
Columns = dict[str, NDArray[np.generic]]
"""The columns of a table, by name."""


def tables(record: FlightRecord) -> Iterator[tuple[str, Columns]]:
    """Name and columns of each table of a flight that has rows.

    Raises:
        RecordError: the record is not valid.
    """
    for channel in CHANNELS:
        rows = record.rows(channel.name)
        if len(rows):
            yield channel.name, {name: rows[name] for name in channel.columns}
    trace = trace_of(record)
    for name in _JOINED_TABLES:
        series = getattr(trace, name)
        if len(series):
            yield name, dict(zip(series.columns, series.rows().T, strict=True))


def export_csv(record: FlightRecord, folder: Path) -> dict[Path, int]:
    """Write each table as `NAME.csv` into an existing folder; return the files and their rows.

    Numbers have enough digits to be read back exactly.

    Raises:
        OSError: a file cannot be written.
        RecordError: the record is not valid.
    """
    row_counts = {}
    for name, columns in tables(record):
        path = folder / f"{name}.csv"
        with path.open("w", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
        row_counts[path] = _row_count(columns)
    return row_counts


def export_parquet(record: FlightRecord, folder: Path) -> dict[Path, int]:
    """Write each table as `NAME.parquet` into an existing folder; return the files and their rows.

    Raises:
        MissingExtraError: pyarrow is missing.
        OSError: a file cannot be written.
        RecordError: the record is not valid.
    """
    require("pyarrow", "export", "exporting Parquet")
    from pyarrow import Table as ArrowTable  # noqa: PLC0415  an extra
    from pyarrow import parquet  # noqa: PLC0415

    row_counts = {}
    for name, columns in tables(record):
        path = folder / f"{name}.parquet"
        parquet.write_table(ArrowTable.from_pydict(columns), path)
        row_counts[path] = _row_count(columns)
    return row_counts


def _row_count(columns: Columns) -> int:
    return len(next(iter(columns.values())))
