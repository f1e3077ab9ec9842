"""The options of the commands that do not fly."""

import argparse
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import TypeAlias

from companion.cli.shared_options import add_endpoint, add_live, add_required_config, add_set
from companion.study import registry

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
STARTS = {"px4": "px4", "ardupilot": "ardupilot", "mock": "mock-px4"}
"""The shipped file that `init` begins with, by the name the user gives."""


def add_serve(commands: Commands) -> None:
    """Add `serve`."""
    serve = commands.add_parser(
        "serve",
        help="let other programs use the link: ground stations, MAVSDK, scripts",
        description="Own the link to the autopilot and pass everything between it and the clients "
        "at serve.clients, until Ctrl-C. The setpoints of one client at a time are flown by our "
        "law: in OFFBOARD, which the client asks for (PX4), or in GUIDED (ArduPilot).",
    )
    add_required_config(serve)
    add_endpoint(serve)
    serve.add_argument(
        "--client",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="instead of serve.clients, such as udpin://127.0.0.1:14551; as often as needed",
    )
    add_set(serve, "link.target_system=2")
    serve.add_argument("--json", action="store_true", help="end with the counters as one JSON line")
    add_live(serve)
    serve.set_defaults(run="serve.serve")


def add_tune(commands: Commands) -> None:
    """Add `tune`."""
    tune = commands.add_parser(
        "tune",
        help="propose gain, weights and bandwidth for an identified vehicle",
        description="Search gain, weights and bandwidth with the smallest expected position error "
        "that keep stability margins (7 dB, 31°), by linear analysis of the identified vehicle. "
        "Fly the values before and after on the mock vehicle, and write the new ones, with the "
        "reasons as comments, as YAML for the configuration to include. docs/identify.md says "
        "what it computes.",
    )
    tune.add_argument(
        "vehicle",
        type=Path,
        metavar="PATH",
        help="vehicle.yaml of `companion identify`, or the folder of its flight",
    )
    tune.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="the configuration to tune; default: that of the flight, or the defaults",
    )
    tune.add_argument(
        "--output", type=Path, metavar="FILE", help="default: tuned.yaml beside the vehicle file"
    )
    tune.add_argument("--force", action="store_true", help="replace FILE if it exists")
    tune.add_argument("--no-flights", action="store_true", help="do not fly it on the mock vehicle")
    tune.add_argument("--json", action="store_true", help="end with one line of JSON")
    tune.set_defaults(run="tune.tune")


def add_benches(commands: Commands) -> None:
    """Add `bench link`, `bench serve`, `bench planner` and `bench flight`."""
    bench = commands.add_parser("bench", help="measure this program's speed")
    benches = bench.add_subparsers(required=True, metavar="WHAT")
    link = benches.add_parser(
        "link", help="sample in → setpoint out: ours, echo, pymavlink, MAVSDK"
    )
    link.set_defaults(run="tools.bench_link")
    serve = benches.add_parser(
        "serve", help="sample in → setpoint out, with three clients on the link and without"
    )
    serve.set_defaults(run="tools.bench_serve")
    for each in (link, serve):
        each.add_argument(
            "--seconds", type=number(0.1, 3600.0), default=20.0, help="for each program (20)"
        )
        each.add_argument(
            "--rate", type=number(1.0, 2000.0), default=250.0, help="samples a second (250)"
        )
    step = benches.add_parser("planner", help="a step of each planner, in a flight and in batches")
    step.add_argument("--seconds", type=number(0.001, 3600.0), default=5.0, help="of measuring (5)")
    step.set_defaults(run="tools.bench_planner")
    flight = benches.add_parser(
        "flight", help="speed of whole flights in one process, as a multiple of real time"
    )
    flight.add_argument(
        "--seconds", type=number(0.1, 3600.0), default=20.0, help="of hover in each flight (20)"
    )
    flight.add_argument(
        "--profile", action="store_true", help="also which part uses how much processor time"
    )
    flight.set_defaults(run="tools.bench_flight")
    for each in (link, serve, step, flight):
        each.add_argument("--json", action="store_true", help="print the figures as one JSON line")


def add_study(commands: Commands) -> None:
    """Add `study`."""
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
        "--workers",
        type=whole_number(1, 256),
        metavar="N",
        help="processes that run studies of `all`; default: one for each core",
    )
    study.add_argument(
        "--json",
        action="store_true",
        help=f"for {registry.names_with_json()}: print its rows as one JSON list",
    )
    study.set_defaults(run="tools.study")


def add_tools(commands: Commands) -> None:
    """Add `plot`."""
    plot = commands.add_parser("plot", help="draw a recorded flight (extra `plot`)")
    plot.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    plot.add_argument("--out", type=Path, metavar="FILE", help="default: FOLDER/flight.png")
    plot.set_defaults(run="recordings.plot")


def add_config(commands: Commands) -> None:
    """Add `config`, `init` and `check-config`."""
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
    start.add_argument("name", choices=list(STARTS), help="for which vehicle")
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


def number(least: float, most: float) -> Callable[[str], float]:
    """A number of the command line within bounds, NaN not among them."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"must be a number from {least:g} to {most:g}")
        return value

    return read


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """A whole number of the command line within bounds."""

    def read(text: str) -> int:
        if not (text.isascii() and text.isdigit()) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"must be a whole number from {least} to {most}")
        return int(text)

    return read
