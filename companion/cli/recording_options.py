"""The options of the commands that read recorded flights."""

from pathlib import Path

from companion.cli.shared_options import add_set
from companion.cli.tool_options import Commands


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
    plot.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    plot.add_argument(
        "--out", type=Path, metavar="FILE", help="picture (default: FOLDER/flight.png)"
    )
    plot.set_defaults(run="recordings.plot")


def _add_export(commands: Commands) -> None:
    export = commands.add_parser(
        "export",
        help="write a recorded flight as CSV or Parquet",
        description="Write the tables of a recorded flight: samples, setpoints, guidance, events.",
    )
    export.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    kind = export.add_mutually_exclusive_group(required=True)
    kind.add_argument("--csv", action="store_true", help="one CSV file for each channel")
    kind.add_argument(
        "--parquet", action="store_true", help="one Parquet file for each channel (extra `export`)"
    )
    export.add_argument(
        "--into", type=Path, metavar="FOLDER", help="folder for the files (default: FOLDER/export)"
    )
    export.set_defaults(run="recordings.export")


def _add_replay(commands: Commands) -> None:
    replay = commands.add_parser(
        "replay",
        help="run the control loops again on the inputs of a recorded flight",
        description="Run the control loop and guidance again on the recorded inputs of a flight, "
        "and compare each setpoint. With the flight's own configuration, all setpoints must be "
        "equal to the bit. With another one, the command shows what would have been sent.",
    )
    replay.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    replay.add_argument(
        "--config", type=Path, metavar="FILE", help="configuration that replaces the flight's own"
    )
    add_set(replay, "planner.gain_per_s=4")
    replay.add_argument(
        "--csv", type=Path, metavar="FILE", help="write both setpoints for each sample to this file"
    )
    replay.set_defaults(run="recordings.replay")


def _add_reports(commands: Commands) -> None:
    report = commands.add_parser(
        "report",
        help="one HTML page about a flight, or about any .tlog (extra `report`)",
        description="Write one HTML page, without other files, about a flight or any .tlog.",
    )
    report.add_argument(
        "flight", type=Path, metavar="FOLDER", help="the flight's folder, or a .tlog of any program"
    )
    report.add_argument(
        "--out", type=Path, metavar="FILE", help="page (default: FOLDER/report.html)"
    )
    report.set_defaults(run="recordings.report")
    compare = commands.add_parser(
        "compare",
        help="one HTML page that compares flights (extra `report`)",
        description="Write one HTML page that shows the motions of flights, and the "
        "configuration keys and figures in which they differ.",
    )
    compare.add_argument(
        "flights", type=Path, nargs="+", metavar="FOLDER", help="folders of flights, or .tlog files"
    )
    compare.add_argument(
        "--out",
        type=Path,
        default=Path("compare.html"),
        metavar="FILE",
        help="page (default: compare.html)",
    )
    compare.set_defaults(run="recordings.compare")
