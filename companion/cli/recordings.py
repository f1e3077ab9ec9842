"""The commands that read recorded flights: `plot`, `report`, `compare`, `export` and `replay`."""

import argparse
from collections.abc import Callable
from pathlib import Path

from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.output_file import require_writable
from companion.config.files import load, with_assignments
from companion.files.yaml_file import ConfigError
from companion.recording.flight_record import FlightRecord, read_flight


def plot(options: argparse.Namespace) -> int:
    """Draw a recorded flight."""
    from companion.report.picture import draw_flight  # noqa: PLC0415  no other command needs it

    out = options.out or options.folder / "flight.png"
    try:
        fault = draw_flight(options.folder, out)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write it: {error.strerror}") from error
    if fault is not None:
        print(fault)
    print(out)
    return EXIT_OK if fault is None else EXIT_FAILURE


def report(options: argparse.Namespace) -> int:
    """Write the page about a flight."""
    from companion.report.page import write_report  # noqa: PLC0415  no other command needs it

    return _write_page(lambda on_fault: write_report(options.flight, options.out, on_fault))


def compare(options: argparse.Namespace) -> int:
    """Write a page that compares flights."""
    from companion.report.page import write_comparison  # noqa: PLC0415  no other command needs it

    return _write_page(lambda on_fault: write_comparison(options.flights, options.out, on_fault))


def _write_page(write: Callable[[Callable[[str], None]], Path]) -> int:
    """Write a page by calling `write`; print its path, and the faults of the records on the page.

    The exit code is 1 if a record has a fault, because the page then has gaps.
    """
    faults: list[str] = []
    try:
        page = write(faults.append)
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot write there: {error.strerror}") from error
    for fault in faults:
        print(fault)
    print(page)
    return EXIT_FAILURE if faults else EXIT_OK


def export(options: argparse.Namespace) -> int:
    """Write the tables of a recorded flight as CSV or Parquet."""
    from companion.recording.export import export_csv, export_parquet  # noqa: PLC0415

    record = read_flight(options.folder)
    out_folder: Path = options.into or options.folder / "export"
    write = export_parquet if options.parquet else export_csv
    try:
        out_folder.mkdir(parents=True, exist_ok=True)
        row_counts = write(record, out_folder)
    except OSError as error:
        raise ConfigError(f"{out_folder}: cannot write there: {error.strerror}") from error
    for path, rows in row_counts.items():
        print(f"{path}  {rows:,} rows")
    return EXIT_OK if _is_whole(record) else EXIT_FAILURE


def _is_whole(record: FlightRecord) -> bool:
    """Whether a recording could be read to its end and is not empty; if not, print why."""
    if record.fault is not None:
        print(record.fault)
    return record.fault is None


def replay(options: argparse.Namespace) -> int:
    """Replay a recorded flight.

    With the flight's own configuration, the exit code is 1 if the setpoints differ from the
    recorded ones.
    """
    from companion.replay.replay import Replay  # noqa: PLC0415  no other command needs it
    from companion.replay.report import result_lines, write_csv  # noqa: PLC0415

    if options.csv is not None:  # a long flight takes a minute to replay
        require_writable(options.csv, "--csv", force=True)
    record = read_flight(options.folder)
    uses_own_config = options.config is None and not options.set
    config = load(options.config or options.folder / "config.yaml")
    config = with_assignments(config, options.set)
    replay_run = Replay(record, config)
    samples = replay_run.run()
    is_whole = _is_whole(record)
    if not samples:
        raise ConfigError(f"{options.folder}: no attitude sample is recorded there to replay")
    for line in result_lines(samples, record.start_time, follows_record=replay_run.follows_record):
        print(line)
    if options.csv is not None:
        try:
            write_csv(samples, options.csv)
        except OSError as error:
            raise ConfigError(f"{options.csv}: cannot write it: {error.strerror}") from error
        print(options.csv)
    all_same = not uses_own_config or all(sample.is_same for sample in samples)
    return EXIT_OK if is_whole and all_same else EXIT_FAILURE
