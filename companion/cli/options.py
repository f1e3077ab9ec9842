"""Options that several commands have, and parsers of their values."""

import argparse
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any, TypeAlias

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
Options: TypeAlias = "argparse.ArgumentParser | argparse._MutuallyExclusiveGroup"


def add_path(
    options: Options, name: str, help: str, metavar: str = "FILE", **argument_options: Any
) -> None:
    """Add an option or an argument whose value is a path; `argument_options` goes to argparse."""
    options.add_argument(name, type=Path, metavar=metavar, help=help, **argument_options)


def add_flight_folder(command: argparse.ArgumentParser) -> None:
    """Add the argument `folder`: the folder of a recorded flight."""
    add_path(command, "folder", "the flight's folder", "FOLDER")


def add_required_config(command: argparse.ArgumentParser) -> None:
    """Add the required option `--config`."""
    add_path(command, "--config", "configuration, such as configs/px4.yaml", required=True)


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


def add_flag(options: Options, name: str, help: str) -> None:
    """Add an option without a value; it is false unless it is given."""
    options.add_argument(name, action="store_true", help=help)


def add_json(
    command: argparse.ArgumentParser, help: str = "print the result as one line of JSON"
) -> None:
    """Add `--json`."""
    add_flag(command, "--json", help)


def add_live(command: argparse.ArgumentParser) -> None:
    """Add `--watch`, `--live` and `--foxglove`."""
    add_flag(
        command,
        "--watch",
        "apply edits of the configuration file in flight: limits, gains and weights",
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


def number_parser(least: float, most: float) -> Callable[[str], float]:
    """Make a parser for a number within bounds; it refuses NaN."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"must be a number from {least:g} to {most:g}")
        return value

    return parse


def whole_number_parser(least: int, most: int) -> Callable[[str], int]:
    """Make a parser for a whole number within bounds."""

    def parse(text: str) -> int:
        if not (text.isascii() and text.isdigit()) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"must be a whole number from {least} to {most}")
        return int(text)

    return parse
