"""The options of the commands that do not fly."""

import argparse
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import TypeAlias

from companion.cli.shared_options import add_endpoint, add_live, add_required_config, add_set
from companion.study import registry

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
STARTING_FILES = {"px4": "px4", "ardupilot": "ardupilot", "mock": "mock-px4"}
"""Name that the user gives to `init` -> shipped file from which `init` makes a new one."""


def add_serve(commands: Commands) -> None:
    """Add `serve`."""
    serve = commands.add_parser(
        "serve",
        help="let other programs use the link: ground stations, MAVSDK, scripts",
        description="Forward messages between the autopilot and the clients at serve.clients, "
        "until Ctrl-C. Our control law flies the setpoints of one client at a time: "
        "in OFFBOARD, when the client requests it (PX4), or in GUIDED (ArduPilot).",
    )
    add_required_config(serve)
    add_endpoint(serve)
    serve.add_argument(
        "--client",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="replaces serve.clients, such as udpin://127.0.0.1:14551; may be repeated",
    )
    add_set(serve, "link.target_system=2")
    serve.add_argument(
        "--json", action="store_true", help="print the counters at the end as one line of JSON"
    )
    add_live(serve)
    serve.set_defaults(run="serve.serve")


def add_tune(commands: Commands) -> None:
    """Add `tune`."""
    tune = commands.add_parser(
        "tune",
        help="propose gain, weights and bandwidth for an identified vehicle",
        description="Search gain, weights and bandwidth for the smallest expected position error "
        "within stability margins (7 dB, 31°), by linear analysis of the identified vehicle. Fly "
        "the old and the new values on the mock vehicle. Write the new values, with the reasons as "
        "comments, as YAML for the configuration to include. docs/identify.md explains "
        "what it computes. Exit code 1: with the new values a course failed or was flown worse; "
        "the first line says which.",
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
        help="configuration to tune (default: that of the flight, or the defaults)",
    )
    tune.add_argument(
        "--out",
        "--output",  # its name until all commands had --out
        dest="output",
        type=Path,
        metavar="FILE",
        help="result (default: tuned.yaml beside the vehicle file)",
    )
    tune.add_argument("--force", action="store_true", help="replace FILE if it exists")
    tune.add_argument(
        "--no-flights", action="store_true", help="do not fly the values on the mock vehicle"
    )
    tune.add_argument("--json", action="store_true", help="print the result as one line of JSON")
    tune.set_defaults(run="tune.tune")


def add_benches(commands: Commands) -> None:
    """Add `bench link`, `bench serve`, `bench planner` and `bench flight`."""
    bench = commands.add_parser("bench", help="measure this program's speed")
    benches = bench.add_subparsers(required=True, metavar="WHAT")
    link = benches.add_parser(
        "link", help="latency from sample to setpoint: ours, echo, pymavlink, MAVSDK"
    )
    link.set_defaults(run="tools.bench_link")
    serve = benches.add_parser(
        "serve", help="latency from sample to setpoint, with three clients on the link and without"
    )
    serve.set_defaults(run="tools.bench_serve")
    for each in (link, serve):
        each.add_argument(
            "--seconds",
            type=number(0.1, 3600.0),
            default=20.0,
            help="duration for each program (20)",
        )
        each.add_argument(
            "--rate", type=number(1.0, 2000.0), default=250.0, help="samples per second (250)"
        )
    step_bench = benches.add_parser(
        "planner", help="time of one step of each planner, in a flight and in batches"
    )
    step_bench.add_argument(
        "--seconds", type=number(0.001, 3600.0), default=5.0, help="duration of the measurement (5)"
    )
    step_bench.set_defaults(run="tools.bench_planner")
    flight = benches.add_parser(
        "flight", help="speed of whole flights in one process, as a multiple of real time"
    )
    flight.add_argument(
        "--seconds",
        type=number(0.1, 3600.0),
        default=20.0,
        help="duration of the hover in each flight (20)",
    )
    flight.add_argument(
        "--profile", action="store_true", help="also show the processor time of each part"
    )
    flight.set_defaults(run="tools.bench_flight")
    for each in (link, serve, step_bench, flight):
        each.add_argument("--json", action="store_true", help="print the figures as one JSON line")


def add_study(commands: Commands) -> None:
    """Add `study`."""
    study = commands.add_parser(
        "study",
        help="the paper's experiments and further ones: figures, tables, a page (extra `study`)",
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
        help=f"case for {registry.names_with_case()}, such as configs/study-case.yaml",
    )
    study.add_argument(
        "--out",
        type=Path,
        default=Path("study"),
        metavar="DIR",
        help="folder for the results (default: study)",
    )
    study.add_argument(
        "--workers",
        type=whole_number(1, 256),
        metavar="N",
        help="processes for `study all`; default: one for each core",
    )
    study.add_argument(
        "--json",
        action="store_true",
        help=f"for {registry.names_with_json()}: print its rows as one JSON list",
    )
    study.set_defaults(run="tools.study")


def add_config(commands: Commands) -> None:
    """Add `config`, `init` and `check-config`."""
    show = commands.add_parser(
        "config",
        help="print the configuration: every key, its default, unit, range and meaning",
        description="Print every key as commented YAML, with the values of FILE or the defaults.",
    )
    show.add_argument("file", type=Path, nargs="?", metavar="FILE", help="configuration")
    selection = show.add_mutually_exclusive_group()
    selection.add_argument(
        "--diff", type=Path, metavar="FILE", help="print only the keys that FILE changes"
    )
    selection.add_argument(
        "--get", metavar="KEY", help="print only this key, such as limits.max_tilt_deg"
    )
    selection.add_argument(
        "--schema", action="store_true", help="print the JSON Schema, for editors"
    )
    selection.add_argument(
        "--markdown", action="store_true", help="print tables, as in docs/configuration.md"
    )
    show.set_defaults(run="config.show")

    start = commands.add_parser("init", help="write a commented starting configuration")
    start.add_argument("name", choices=list(STARTING_FILES), help="vehicle of the configuration")
    start.add_argument(
        "--out",
        type=Path,
        default=Path("companion.yaml"),
        metavar="FILE",
        help="file to write (default: companion.yaml); an existing file is never replaced",
    )
    start.set_defaults(run="config.init")

    check = commands.add_parser(
        "check-config",
        help="check a configuration file",
        description="Check a configuration file and what it includes. The format is YAML 1.2 "
        "(010 is ten, yes is a text) without aliases and tags, up to 250 kB and 6000 values. "
        "`companion config` shows the range of each key.",
    )
    check.add_argument("file", type=Path, metavar="FILE")
    add_set(check, "planner.gain_per_s=4")
    check.set_defaults(run="config.check")


def number(least: float, most: float) -> Callable[[str], float]:
    """Make a parser for a number within bounds; it refuses NaN."""

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
    """Make a parser for a whole number within bounds."""

    def read(text: str) -> int:
        if not (text.isascii() and text.isdigit()) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"must be a whole number from {least} to {most}")
        return int(text)

    return read
