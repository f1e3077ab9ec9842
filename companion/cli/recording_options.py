"""The options of the commands that read recorded flights."""

from pathlib import Path

from companion.cli.shared_options import add_set
from companion.cli.tool_options import Commands


def add_recordings(commands: Commands) -> None:
    """Add `report`, `compare`, `export` and `replay`."""
    _add_reports(commands)
    _add_export(commands)
    _add_replay(commands)


def _add_export(commands: Commands) -> None:
    export = commands.add_parser("export", help="write a recorded flight as CSV or Parquet")
    export.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    kind = export.add_mutually_exclusive_group(required=True)
    kind.add_argument("--csv", action="store_true", help="one CSV file for each channel")
    kind.add_argument("--parquet", action="store_true", help="the same as Parquet (extra `export`)")
    export.add_argument("--into", type=Path, metavar="FOLDER", help="default: FOLDER/export")
    export.set_defaults(run="recordings.export")


def _add_replay(commands: Commands) -> None:
    replay = commands.add_parser(
        "replay",
        help="run the code again over a recorded flight",
        description="Run the control loop and guidance again over what a flight recorded, and "
        "compare each command. With its own configuration all commands must be those of the "
        "flight, to the bit; with another one it shows what would have been sent.",
    )
    replay.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    replay.add_argument("--config", type=Path, metavar="FILE", help="instead of the flight's own")
    add_set(replay, "planner.gain_per_s=4")
    replay.add_argument(
        "--csv", type=Path, metavar="FILE", help="write both answers to each sample"
    )
    replay.set_defaults(run="recordings.replay")


def _add_reports(commands: Commands) -> None:
    report = commands.add_parser(
        "report", help="one HTML page about a flight, or about any .tlog (extra `report`)"
    )
    report.add_argument(
        "flight", type=Path, metavar="FOLDER", help="the flight's folder, or a .tlog of any program"
    )
    report.add_argument("--out", type=Path, metavar="FILE", help="default: FOLDER/report.html")
    report.set_defaults(run="recordings.report")
    compare = commands.add_parser(
        "compare", help="one HTML page with several flights beside each other (extra `report`)"
    )
    compare.add_argument(
        "flights", type=Path, nargs="+", metavar="FOLDER", help="folders of flights, or .tlog files"
    )
    compare.add_argument(
        "--out",
        type=Path,
        default=Path("compare.html"),
        metavar="FILE",
        help="default: compare.html",
    )
    compare.set_defaults(run="recordings.compare")
