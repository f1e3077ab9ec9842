"""The options of the commands that read recorded flights."""

from pathlib import Path

from companion.cli.options import Commands, add_flag, add_flight_folder, add_path, add_set


def add_recordings(commands: Commands) -> None:
    """Add `plot`, `report`, `compare`, `export` and `replay`."""
    _add_plot(commands)
    _add_reports(commands)
    _add_export(commands)
    _add_replay(commands)


def _add_plot(commands: Commands) -> None:
    plot = commands.add_parser(
        "plot",
        help="draw a recorded flight (extra `plot`)",
        description="Draw a recorded flight as a picture: its path, its steps, and error, speed, "
        "tilt and height over time, with the place and the reason of an early end.",
    )
    add_flight_folder(plot)
    add_path(plot, "--out", "picture (default: FOLDER/flight.png)")
    plot.set_defaults(run="recordings.plot")


def _add_export(commands: Commands) -> None:
    export = commands.add_parser(
        "export",
        help="write a recorded flight as CSV or Parquet",
        description="Write the tables of a recorded flight: samples, setpoints, guidance, events.",
    )
    add_flight_folder(export)
    kind = export.add_mutually_exclusive_group(required=True)
    add_flag(kind, "--csv", "one CSV file for each channel")
    add_flag(kind, "--parquet", "one Parquet file for each channel (extra `export`)")
    add_path(export, "--into", "folder for the files (default: FOLDER/export)", "FOLDER")
    export.set_defaults(run="recordings.export")


def _add_replay(commands: Commands) -> None:
    replay = commands.add_parser(
        "replay",
        help="run the control loops again on the inputs of a recorded flight",
        description="Run the control loop and guidance again on the recorded inputs of a flight, "
        "and compare each setpoint. With the flight's own configuration, all setpoints must be "
        "equal to the bit. With another one, the command shows what would have been sent.",
    )
    add_flight_folder(replay)
    add_path(replay, "--config", "configuration that replaces the flight's own")
    add_set(replay, "planner.gain_per_s=4")
    add_path(replay, "--csv", "write both setpoints for each sample to this file")
    replay.set_defaults(run="recordings.replay")


def _add_reports(commands: Commands) -> None:
    report = commands.add_parser(
        "report",
        help="one HTML page about a flight, or about any .tlog (extra `report`)",
        description="Write one HTML page, without other files, about a flight or any .tlog.",
    )
    add_path(report, "flight", "the flight's folder, or a .tlog of any program", "FOLDER")
    add_path(report, "--out", "page (default: FOLDER/report.html)")
    report.set_defaults(run="recordings.report")
    compare = commands.add_parser(
        "compare",
        help="one HTML page that compares flights (extra `report`)",
        description="Write one HTML page that shows the motions of flights, and the "
        "configuration keys and figures in which they differ.",
    )
    add_path(compare, "flights", "folders of flights, or .tlog files", "FOLDER", nargs="+")
    add_path(compare, "--out", "page (default: compare.html)", default=Path("compare.html"))
    compare.set_defaults(run="recordings.compare")
