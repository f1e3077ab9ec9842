"""Options that several commands have."""

import argparse
from pathlib import Path


def add_required_config(command: argparse.ArgumentParser) -> None:
    """Add `--config`, without which the command does not run."""
    command.add_argument(
        "--config", type=Path, required=True, metavar="FILE", help="such as configs/px4.yaml"
    )


def add_endpoint(command: argparse.ArgumentParser) -> None:
    """Add `--endpoint`."""
    command.add_argument("--endpoint", help="instead of link.endpoint")


def add_set(command: argparse.ArgumentParser, example: str) -> None:
    """Add `--set`; `example` stands in its help."""
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help=f"instead of the configuration's, such as {example}; as often as needed",
    )


def add_live(command: argparse.ArgumentParser) -> None:
    """Add `--watch` and `--live`."""
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
