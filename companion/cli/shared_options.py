"""Options that several commands have."""

import argparse
from pathlib import Path


def add_required_config(command: argparse.ArgumentParser) -> None:
    """Add the required option `--config`."""
    command.add_argument(
        "--config",
        type=Path,
        required=True,
        metavar="FILE",
        help="configuration, such as configs/px4.yaml",
    )


def add_endpoint(command: argparse.ArgumentParser) -> None:
    """Add `--endpoint`."""
    command.add_argument("--endpoint", help="endpoint of the vehicle; replaces link.endpoint")


def add_set(command: argparse.ArgumentParser, example: str) -> None:
    """Add `--set`; its help shows `example`."""
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help=f"change a key of the configuration, such as {example}; may be repeated",
    )


def add_live(command: argparse.ArgumentParser) -> None:
    """Add `--watch`, `--live` and `--foxglove`."""
    command.add_argument(
        "--watch",
        action="store_true",
        help="apply edits of the configuration file in flight: limits, gains and weights",
    )
    command.add_argument(
        "--live",
        nargs="?",
        const="127.0.0.1:8090",
        metavar="[HOST][:PORT]",
        help="serve a page to watch the flight, and to change limits with the token shown "
        "(127.0.0.1:8090)",
    )
    command.add_argument(
        "--foxglove",
        nargs="?",
        const="127.0.0.1:8765",
        metavar="[HOST][:PORT]",
        help="stream the flight to Foxglove or Lichtblick, to watch only (127.0.0.1:8765)",
    )
