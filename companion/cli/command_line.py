"""The options of the command line. No command is imported, so that `--help` answers at once."""

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from companion.cli import tool_options
from companion.cli.campaign_options import add_campaign, with_campaign_run
from companion.cli.hinting_parser import HintingParser
from companion.cli.options import (
    Commands,
    add_endpoint,
    add_flag,
    add_json,
    add_live,
    add_path,
    add_required_config,
    add_set,
    number_parser,
)

_PACKAGE = "mavlink-companion"


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line; ends the program for `--help`, `--version` and wrong usage.

    If `arguments` is None, the arguments of this process are read.

    Returns:
        The options; their attribute `typed` holds the arguments as typed.
    """
    typed_arguments = sys.argv[1:] if arguments is None else list(arguments)
    options = _parser().parse_args(with_campaign_run(typed_arguments))
    options.typed = typed_arguments
    return options


def _parser() -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = HintingParser(
        prog="companion",
        description=(
            "Fly a PX4 or ArduPilot multirotor by body rates, with a linear acceleration response."
        ),
    )
    add_flag(parser, "--debug", "show where an internal error happened")
    parser.add_argument("--version", action="version", version=f"companion {version(_PACKAGE)}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_flights(commands)
    tool_options.add_serve(commands)
    _add_doctor(commands)
    _add_identify(commands)
    tool_options.add_tune(commands)
    tool_options.add_benches(commands)
    tool_options.add_study(commands)
    add_campaign(commands)
    tool_options.add_recordings(commands)
    tool_options.add_config(commands)
    return parser


def _add_flights(commands: Commands) -> None:
    fly = commands.add_parser(
        "fly",
        help="fly the vehicle that the configuration names",
        description="Check the vehicle, wait until it is armed, take off, fly the maneuvers, and "
        "land. Ctrl-C hands the vehicle back. The flight is recorded in a folder of its own.",
    )
    add_required_config(fly)
    _add_link_options(fly)
    fly.set_defaults(run="cli.flights.fly")
    demo = commands.add_parser(
        "demo",
        help="start the bundled vehicle and fly it",
        description="Start the bundled mock vehicle, arm it, and fly it like `companion fly`.",
    )
    add_path(demo, "--config", "configuration (default: the shipped mock-px4.yaml)")
    add_flag(demo, "--open", "open the report in the browser after the flight")
    demo.set_defaults(run="cli.flights.demo")
    for command in (fly, demo):
        command.add_argument(
            "--maneuvers",
            type=lambda text: tuple(text.split(",")),
            metavar="NAME[,NAME]",
            help="maneuvers that replace flight.maneuvers: hover, steps, circle, corners, or "
            "trajectory if flight.trajectory is set",
        )
        add_path(
            command,
            "--trajectory",
            "fly only this trajectory: a YAML file such as configs/trajectories/figure8.yaml, "
            "or a CSV table",
        )
        add_flag(
            command,
            "--slow-down",
            "slow down a trajectory that exceeds the limits, instead of refusing it",
        )
        add_live(command)
        _add_flight_options(command)


def _add_doctor(commands: Commands) -> None:
    command = commands.add_parser(
        "doctor",
        help="find what would go wrong, before take-off",
        description="Check the vehicle of the configuration without arming it: version, "
        "parameters, message rates, estimator, link, and other nodes. Report what is "
        "unsafe or ineffective, what to set, and the source of each finding. "
        "`companion fly` runs the same checks, and refuses unsafe findings unless "
        "flight.accept names them. Exit code 1: something is unsafe and not in "
        "flight.accept, the vehicle is not ready, or it does not answer.",
    )
    add_required_config(command)
    add_endpoint(command)
    command.add_argument(
        "--wait",
        type=number_parser(0.01, 3600.0),
        default=10.0,
        metavar="SECONDS",
        help="longest wait until the vehicle is ready, s (10)",
    )
    fix_or_undo = command.add_mutually_exclusive_group()
    add_flag(
        fix_or_undo,
        "--fix",
        "write an undo file, then set the proposed parameters, asking before each",
    )
    add_path(fix_or_undo, "--undo", "only restore the parameters in an undo file")
    add_flag(command, "--yes", "with --fix: set all without asking")
    _add_flight_options(command)
    command.set_defaults(run="cli.doctor.doctor")


def _add_identify(commands: Commands) -> None:
    command = commands.add_parser(
        "identify",
        help="measure dead time, lag and slew limit of the body rates, and the thrust map",
        description="Fly short doublets of body rates and climb, at most 15° of tilt in calm "
        "air unless the configuration's `identify` differs. Fit the vehicle's response, and write "
        "it as a YAML file for the configuration to include. An axis with a bad fit keeps the "
        "values of the flight's configuration.",
    )
    flight_source = command.add_mutually_exclusive_group(required=True)
    add_path(flight_source, "--config", "fly the vehicle of this configuration")
    add_path(
        flight_source,
        "--bundled",
        "start and fly the bundled vehicle (default: the shipped mock-px4.yaml)",
        nargs="?",
        const=Path(),  # the configuration that ships
    )
    add_path(
        flight_source,
        "--log",
        "identify from a recorded flight's folder or any .tlog, without flying",
        "PATH",
    )
    add_path(
        command, "--out", "file for the result (default: vehicle.yaml beside the flight's log)"
    )
    add_flag(command, "--force", "replace FILE if it exists")
    _add_link_options(command)
    _add_flight_options(command)
    command.set_defaults(
        run="cli.identify.identify",
        trajectory=None,
        slow_down=False,
        watch=False,
        live=None,
        foxglove=None,
    )


def _add_link_options(command: argparse.ArgumentParser) -> None:
    add_endpoint(command)
    add_flag(command, "--arm", "let the program arm the vehicle, like flight.arm: true")
    add_flag(
        command,
        "--take-over",
        "take over a vehicle that its pilot has taken off and switched to hold, like "
        "flight.take_over: true",
    )


def _add_flight_options(command: argparse.ArgumentParser) -> None:
    add_set(command, "limits.max_tilt_deg=20")
    add_flag(
        command,
        "--lockstep",
        "fly in steps on the mock vehicle's clock, as fast as this computer can",
    )
    add_json(command)
