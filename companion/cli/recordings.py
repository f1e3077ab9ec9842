"""The commands that read recorded flights: `plot`, `report`, `compare`, `export` and `replay`."""

import argparse
from collections.abc import Callable
from pathlib import Path

from companion.cli.exit_codes import EXIT_FLIGHT, EXIT_OK
from companion.config.files import assigned, changed, load
from companion.files.yaml_file import ConfigError
from companion.recording.flight_record import FlightRecord, read_flight


def plot(options: argparse.Namespace) -> int:
    """Draw a recorded flight."""
    from companion.recording.figure import draw_flight  # noqa: PLC0415  no other command needs it

    out = options.out or options.folder / "flight.png"
    try:
        draw_flight(options.folder, out)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write it: {error.strerror}") from error
    print(out)
    return EXIT_OK


def report(options: argparse.Namespace) -> int:
    """Write the page about a flight."""
    from companion.report.page import write_report  # noqa: PLC0415  no other command needs it

    return _write_page(lambda: write_report(options.flight, options.out))


def compare(options: argparse.Namespace) -> int:
    """Write a page that compares flights."""
    from companion.report.page import write_comparison  # noqa: PLC0415  no other command needs it

    return _write_page(lambda: write_comparison(options.flights, options.out))


def _write_page(make: Callable[[], Path]) -> int:
    """Call `make`, and print the path of the page that it has written."""
    try:
        page = make()
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot write there: {error.strerror}") from error
    print(page)
    return EXIT_OK


def export(options: argparse.Namespace) -> int:
    """Write the tables of a recorded flight as CSV or Parquet."""
    from companion.recording.export import export_csv, export_parquet  # noqa: PLC0415

    record = read_flight(options.folder)
    into: Path = options.into or options.folder / "export"
    write = export_parquet if options.parquet else export_csv
    try:
        into.mkdir(parents=True, exist_ok=True)
        written = write(record, into)
    except OSError as error:
        raise ConfigError(f"{into}: cannot write there: {error.strerror}") from error
    for path, rows in written.items():
        print(f"{path}  {rows:,} rows")
    return EXIT_OK if _is_whole(record) else EXIT_FLIGHT


def _is_whole(record: FlightRecord) -> bool:
    """Whether a recording could be read to its end; if not, print where it is damaged."""
    if record.damage is not None:
        print(
            f"{record.folder}: the recording is damaged, and only the part before was read: "
            f"{record.damage}"
        )
    return record.damage is None


def replay(options: argparse.Namespace) -> int:
    """Replay a recorded flight; fail if its own configuration gives different setpoints."""
    from companion.replay.replay import Replay  # noqa: PLC0415  no other command needs it
    from companion.replay.report import words, write_csv  # noqa: PLC0415

    record = read_flight(options.folder)
    own_config = options.config is None and not options.set
    config = load(options.config or options.folder / "config.yaml")
    if options.set:
        config = changed(config, assigned(options.set), "--set")
    replayed = Replay(record, config)
    samples = replayed.run()
    whole = _is_whole(record)
    if not samples:
        raise ConfigError(f"{options.folder}: no attitude sample is recorded there to replay")
    for line in words(samples, record.began, follows_record=replayed.follows_record):
        print(line)
    if options.csv is not None:
        try:
            write_csv(samples, options.csv)
        except OSError as error:
            raise ConfigError(f"{options.csv}: cannot write it: {error.strerror}") from error
        print(options.csv)
    same = not own_config or all(each.same for each in samples)
    return EXIT_OK if whole and same else EXIT_FLIGHT
