"""The command line: its options, and what each error of a command means to the shell."""

import argparse
import traceback
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from math import nan
from pathlib import Path
from typing import TypeAlias

from companion.cli.exit_codes import EXIT_FLIGHT, EXIT_USAGE
from companion.study import registry

_PACKAGE = "mavlink-companion"
_STARTS = "px4", "ardupilot", "mock"

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code.

    A command's modules are imported once the command line is read: `--help` waits for none of them.

    Raises:
        KeyboardInterrupt: Ctrl-C where no flight sees to it.
    """
    options = _parser().parse_args(arguments)
    module, _, function = options.run.partition(".")
    errors = import_module("companion.cli.errors")
    try:
        command = getattr(import_module(f"companion.cli.{module}"), function)
        return int(command(options))
    except errors.USAGE as error:
        errors.say(f"{error}")
        return EXIT_USAGE
    except errors.FLIGHT as error:
        errors.say(f"{error}")
        return EXIT_FLIGHT
    except errors.CANCELLED:
        errors.say("interrupted before anything was sent")
        return EXIT_FLIGHT
    except Exception as error:
        if options.debug:
            traceback.print_exc()
        errors.say(f"internal error: {error!r}; run again with --debug for where it happened")
        return EXIT_FLIGHT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="companion",
        description=(
            "Fly a PX4 or ArduPilot multirotor by body rates, with a linear acceleration response."
        ),
    )
    parser.add_argument(
        "--debug", action="store_true", help="show where an internal error happened"
    )
    parser.add_argument("--version", action="version", version=f"companion {version(_PACKAGE)}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_flights(commands)
    _add_doctor(commands)
    _add_identify(commands)
    _add_benches(commands)
    _add_study(commands)
    _add_tools(commands)
    _add_config(commands)
    return parser


def _add_flights(commands: Commands) -> None:
    fly = commands.add_parser("fly", help="fly the vehicle that the configuration names")
    fly.add_argument(
        "--config", type=Path, required=True, metavar="FILE", help="such as configs/px4.yaml"
    )
    _add_link_options(fly)
    fly.set_defaults(run="flights.fly")
    show = commands.add_parser("demo", help="start the bundled vehicle and fly it")
    show.add_argument(
        "--config", type=Path, metavar="FILE", help="default: the mock-px4.yaml that ships"
    )
    show.set_defaults(run="flights.demo")
    for command in (fly, show):
        command.add_argument(
            "--maneuvers",
            type=lambda text: tuple(text.split(",")),
            metavar="NAME[,NAME]",
            help="fly these instead of flight.maneuvers: hover, steps, circle, corners",
        )
        command.add_argument(
            "--trajectory",
            type=Path,
            metavar="FILE",
            help="follow it instead, such as configs/trajectories/figure8.yaml, or a CSV table",
        )
        command.add_argument(
            "--slow-down",
            action="store_true",
            help="slow a trajectory down that the limits do not allow, instead of refusing it",
        )
        _add_flight_options(command)


def _add_doctor(commands: Commands) -> None:
    command = commands.add_parser(
        "doctor",
        help="find what would go wrong, before take-off",
        description="Ask the vehicle that the configuration names, without arming it: version, "
        "parameters, rates, estimator, link, who else is there; and tell what of it is unsafe or "
        "ineffective, what to set, and where that is known from. `companion fly` makes the same "
        "checks and refuses what is unsafe unless flight.accept names it. Exit code 1: something "
        "unsafe was found.",
    )
    command.add_argument(
        "--config", type=Path, required=True, metavar="FILE", help="such as configs/px4.yaml"
    )
    command.add_argument("--endpoint", help="instead of link.endpoint")
    command.add_argument(
        "--wait",
        type=_number(0.01, 3600.0),
        default=10.0,
        metavar="SECONDS",
        help="for the vehicle to be ready, at most (10)",
    )
    what = command.add_mutually_exclusive_group()
    what.add_argument(
        "--fix",
        action="store_true",
        help="set the parameters proposed, each after asking, and write an undo file before",
    )
    what.add_argument(
        "--undo", type=Path, metavar="FILE", help="set back what such a file says, and no more"
    )
    command.add_argument("--yes", action="store_true", help="of --fix: set all without asking")
    _add_flight_options(command)
    command.set_defaults(run="doctor.doctor")


def _add_identify(commands: Commands) -> None:
    command = commands.add_parser(
        "identify",
        help="find dead time, lag and slew of the body rates and the thrust map",
        description="Fly short doublets of body rates and climb, at most 15° of tilt in calm "
        "air unless the configuration's `identify` says otherwise, fit how the vehicle answered "
        "them, and write that as a YAML file for the configuration to include. An axis with a bad "
        "fit keeps what the flight's configuration says of it.",
    )
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--config", type=Path, metavar="FILE", help="fly the vehicle it names")
    which.add_argument(
        "--bundled",
        type=Path,
        metavar="FILE",
        nargs="?",
        const=Path(),  # the configuration that ships
        help="start the bundled vehicle and fly it; default: the mock-px4.yaml that ships",
    )
    which.add_argument(
        "--log", type=Path, metavar="PATH", help="a flight's folder, or anybody's .tlog: no flight"
    )
    command.add_argument(
        "--out", type=Path, metavar="FILE", help="default: vehicle.yaml beside the flight's log"
    )
    command.add_argument("--force", action="store_true", help="replace FILE if it exists")
    _add_link_options(command)
    _add_flight_options(command)
    command.set_defaults(run="identify.identify", trajectory=None, slow_down=False)


def _add_link_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("--endpoint", help="instead of link.endpoint")
    command.add_argument("--arm", action="store_true", help="arm by ourselves, as flight.arm: true")


def _add_flight_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="instead of the configuration's, such as limits.max_tilt_deg=20; as often as needed",
    )
    command.add_argument("--lockstep", action="store_true", help="on the mock vehicle's clock")
    command.add_argument("--json", action="store_true", help="end with one line of JSON")


def _add_benches(commands: Commands) -> None:
    bench = commands.add_parser("bench", help="measure this program's speed")
    benches = bench.add_subparsers(required=True, metavar="WHAT")
    link = benches.add_parser(
        "link", help="sample in → setpoint out: ours, echo, pymavlink, MAVSDK"
    )
    link.add_argument(
        "--seconds", type=_number(0.1, 3600.0), default=20.0, help="for each program (20)"
    )
    link.add_argument(
        "--rate", type=_number(1.0, 2000.0), default=250.0, help="samples a second (250)"
    )
    link.set_defaults(run="tools.bench_link")
    step = benches.add_parser("planner", help="a step of each planner, in a flight and in batches")
    step.add_argument(
        "--seconds", type=_number(0.001, 3600.0), default=5.0, help="of measuring (5)"
    )
    step.set_defaults(run="tools.bench_planner")
    for each in (link, step):
        each.add_argument("--json", action="store_true", help="print the figures as one JSON line")


def _add_study(commands: Commands) -> None:
    study = commands.add_parser(
        "study",
        help="the paper's experiments, as figures, tables and a page (extra `study`)",
        epilog=f"studies:\n{registry.help_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    study.add_argument(
        "name", choices=registry.choices(), metavar="NAME", help="a study, see below"
    )
    study.add_argument(
        "--case",
        type=Path,
        metavar="FILE",
        help=f"for {registry.names_with_case()}: such as configs/study-case.yaml",
    )
    study.add_argument(
        "--out", type=Path, default=Path("study"), metavar="DIR", help="default: study"
    )
    study.add_argument(
        "--json",
        action="store_true",
        help=f"for {registry.names_with_json()}: print its rows as one JSON list",
    )
    study.set_defaults(run="tools.study")


def _add_tools(commands: Commands) -> None:
    plot = commands.add_parser("plot", help="draw a recorded flight (extra `plot`)")
    plot.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    plot.add_argument("--out", type=Path, metavar="FILE", help="default: FOLDER/flight.png")
    plot.set_defaults(run="tools.plot")


def _add_config(commands: Commands) -> None:
    show = commands.add_parser(
        "config",
        help="print the configuration: every key, its default, unit, range and meaning",
        description="Print every key as commented YAML, with the values of FILE or the defaults.",
    )
    which = show.add_mutually_exclusive_group()
    which.add_argument("file", type=Path, nargs="?", metavar="FILE")
    which.add_argument("--diff", type=Path, metavar="FILE", help="only what FILE changes")
    which.add_argument("--get", metavar="KEY", help="only this key, such as limits.max_tilt_deg")
    which.add_argument("--schema", action="store_true", help="the JSON Schema, for editors")
    which.add_argument("--markdown", action="store_true", help="tables: docs/configuration.md")
    show.set_defaults(run="config.show")

    start = commands.add_parser("init", help="write a commented starting configuration")
    start.add_argument("name", choices=_STARTS, help="for which vehicle")
    start.add_argument(
        "--out",
        type=Path,
        default=Path("companion.yaml"),
        metavar="FILE",
        help="default: companion.yaml; an existing file is never replaced",
    )
    start.set_defaults(run="config.init")

    check = commands.add_parser(
        "check-config",
        help="check a configuration file",
        description="Check a configuration file and what it includes. It is read as YAML 1.2 "
        "(010 is ten, yes is a text; no aliases, no tags), up to 250 kB and 6000 values; "
        "`companion config` names the smallest and the largest value of each key.",
    )
    check.add_argument("file", type=Path, metavar="FILE")
    check.set_defaults(run="config.check")


def _number(least: float, most: float) -> Callable[[str], float]:
    """A number of the command line within bounds, NaN not among them."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"must be a number from {least:g} to {most:g}")
        return value

    return number
