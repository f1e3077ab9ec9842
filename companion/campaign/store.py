"""Stores the results of a campaign: one Parquet file for each unit of work, whole or not at all."""

import json
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.campaign.campaign_file import CampaignFile
from companion.campaign.outcomes import OUTCOME_LABELS
from companion.campaign.swept import Value
from companion.config.units import unit_of
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError

if TYPE_CHECKING:
    import pyarrow as pa

RESULTS_FOLDER = "results"
"""Folder of the units' Parquet files, in the folder of a campaign."""
METADATA_KEY = b"companion.campaign"
"""Key in the metadata of the Parquet schema; its value is JSON with `name`, `kind`, `factors`."""
_OUTCOMES = {
    "flights": (
        ("ok", "bool"),
        ("result", "string"),
        ("failed_checks", "string"),
        ("phase", "string"),
        ("crashed", "bool"),
        ("as_documented", "bool"),
        *((name, "float64") for name in OUTCOME_LABELS),
        ("setpoints", "int64"),
        ("digest", "string"),
    ),
    "batch": (
        ("ok", "bool"),
        ("result", "string"),
        ("model_deviation_max", "float64"),
        ("time_constant_s", "float64"),
        ("cross_axis_max", "float64"),
        ("rate_rms_rad_s", "float64"),
        ("rate_max_rad_s", "float64"),
        ("digest", "string"),
    ),
}
"""Columns of the outcomes by kind of campaign."""


def schema(file: CampaignFile) -> "pa.Schema":
    """The columns of the results, derived from the campaign's file."""
    import pyarrow as pa  # noqa: PLC0415  an extra

    factors = [(name, _column_type(file, name)) for name in file.sweep]
    columns = [("case", "int64"), ("seed", "int64"), *factors, *_OUTCOMES[file.kind]]
    factor_metadata = {
        name: {**swept.description(), "unit": unit_of(name)} for name, swept in file.sweep.items()
    }
    campaign_metadata = {"name": file.name, "kind": file.kind, "factors": factor_metadata}
    return pa.schema(columns, metadata={METADATA_KEY: json.dumps(campaign_metadata).encode()})


def _column_type(file: CampaignFile, name: str) -> str:
    swept = file.sweep[name]
    if swept.is_bool:
        return "bool"
    return "float64" if swept.is_number else "string"


def table(file: CampaignFile, rows: Sequence[Mapping[str, Value]]) -> "pa.Table":
    """Convert rows to a table with the columns of `schema`."""
    import pyarrow as pa  # noqa: PLC0415  an extra

    columns = schema(file)
    data = {
        field.name: [_cell_value(row.get(field.name), field.type) for row in rows]
        for field in columns
    }
    return pa.table(data, schema=columns)


def _cell_value(value: Value, column_type: Any) -> Value:
    """A value as stored in a column; in a column of text, any other value becomes JSON text."""
    if str(column_type) == "string" and value is not None and not isinstance(value, str):
        return json.dumps(value)
    return value


def write_unit(
    folder: Path,
    file: CampaignFile,
    number: int,
    rows: Sequence[Mapping[str, Value]],
    timing: Mapping[str, Any],
) -> None:
    """Write the rows of a unit of work; when the function returns, the rows are on the disk.

    `timing` (wall times and worker) gets a file of its own, because it differs between runs.

    Raises:
        OSError: a file cannot be written; no results of the unit are left.
    """
    import pyarrow.parquet as pq  # noqa: PLC0415  an extra

    path = unit_file(folder, number)
    write_whole(path.with_suffix(".json"), json.dumps(timing) + "\n")
    parquet = BytesIO()
    pq.write_table(table(file, rows), parquet)
    write_whole(path, parquet.getvalue())


def unit_file(folder: Path, number: int) -> Path:
    """The Parquet file of a unit."""
    return folder / RESULTS_FOLDER / f"unit-{number:05d}.parquet"


def finished_units(folder: Path) -> frozenset[int]:
    """The numbers of the units whose results are on the disk."""
    paths = (folder / RESULTS_FOLDER).glob("unit-*.parquet")
    return frozenset(int(path.stem.removeprefix("unit-")) for path in paths)


def read(folder: Path) -> "pa.Table":
    """All results of a campaign so far, ordered by case.

    Raises:
        ConfigError: there are no results, or a file is damaged.
    """
    import pyarrow as pa  # noqa: PLC0415  an extra

    numbers = sorted(finished_units(folder))
    if not numbers:
        raise ConfigError(f"{folder}: there are no results of a campaign")
    message = (
        f"{folder / RESULTS_FOLDER} holds files of different campaigns; start the campaign again "
        "with another --out"
    )
    units = [read_unit(folder, number) for number in numbers]
    if any(not (unit.schema.metadata or {}).get(METADATA_KEY) for unit in units):
        raise ConfigError(message)
    try:
        return pa.concat_tables(units).sort_by("case")
    except pa.ArrowException as error:
        raise ConfigError(message) from error


def read_unit(folder: Path, number: int) -> "pa.Table":
    """The results of one unit.

    Raises:
        ConfigError: the file is damaged.
    """
    import pyarrow as pa  # noqa: PLC0415  an extra
    import pyarrow.parquet as pq  # noqa: PLC0415  an extra

    path = unit_file(folder, number)
    try:
        return pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        reason = " ".join(str(error).split()).rstrip(".")  # Arrow's may end in a line break
        raise ConfigError(
            f"{path}: cannot be read: {reason}; delete this file and continue the campaign: only "
            "its flights are flown again"
        ) from error


def metadata(results: "pa.Table") -> dict[str, Any]:
    """Name, kind and factors of the campaign that a table of results belongs to."""
    contents: dict[str, Any] = json.loads((results.schema.metadata or {})[METADATA_KEY])
    return contents
