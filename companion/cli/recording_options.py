"""The options of the commands that show recorded flights."""

from pathlib import Path

from companion.cli.tool_options import Commands


def add_report(commands: Commands) -> None:
    """Add `report` and `compare`."""
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
