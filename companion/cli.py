"""The commands. Exit codes: 0 done, 1 the flight failed, 2 usage or configuration."""

import argparse
import asyncio
import json
import shutil
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from datetime import UTC, datetime
from importlib.metadata import version
from math import inf
from pathlib import Path
from typing import Any, get_args

from rich.console import Console

from companion import demo
from companion.config import Config
from companion.config_file import changed, json_schema, load
from companion.config_sections import FlightConfig
from companion.extras import MissingExtraError
from companion.flight.assembly import link_settings
from companion.flight.session import Session
from companion.mavlink import lockstep
from companion.mavlink import loop as link_loop
from companion.mavlink.endpoint import parse_endpoint
from companion.mavlink.errors import EndpointError, LinkError, SigningError
from companion.recording.figure import FigureError, draw_flight
from companion.recording.report import flight_table
from companion.recording.summary import Summary
from companion.study import needs
from companion.study.names import STUDY_NAMES
from companion.terminal import FlightConsole, TerminalObserver
from companion.yaml_file import ConfigError

_PACKAGE = "mavlink-companion"

EXIT_OK, EXIT_FLIGHT, EXIT_USAGE = 0, 1, 2

_USAGE_ERRORS = (ConfigError, EndpointError, FigureError, MissingExtraError, SigningError)
_PROGRAMMES = get_args(get_args(FlightConfig.model_fields["programme"].annotation)[0])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    options = _parser().parse_args(arguments)
    errors = Console(stderr=True)
    try:
        return int(options.run(options))
    except _USAGE_ERRORS as error:
        errors.print(f"companion: {error}", markup=False, highlight=False, soft_wrap=True)
        return EXIT_USAGE
    except (LinkError, OSError, demo.VehicleStoppedError) as error:
        errors.print(f"companion: {error}", markup=False, highlight=False, soft_wrap=True)
        return EXIT_FLIGHT
    except (KeyboardInterrupt, asyncio.CancelledError):
        errors.print("companion: interrupted before anything was sent")
        return EXIT_FLIGHT
    except Exception as error:
        if options.debug:
            traceback.print_exc()
        errors.print(
            f"companion: internal error: {error!r}; run again with --debug for where it happened",
            markup=False,
            soft_wrap=True,
        )
        return EXIT_FLIGHT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="companion",
        description="Fly a PX4 multirotor by body rates, with a linear acceleration response.",
    )
    parser.add_argument(
        "--debug", action="store_true", help="show where an internal error happened"
    )
    parser.add_argument("--version", action="version", version=f"companion {version(_PACKAGE)}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    fly = commands.add_parser("fly", help="fly the vehicle that the configuration names")
    fly.add_argument(
        "--config", type=Path, required=True, metavar="FILE", help="such as configs/px4.yaml"
    )
    fly.set_defaults(run=_fly)
    show = commands.add_parser("demo", help="start the bundled vehicle and fly it")
    show.add_argument(
        "--config", type=Path, metavar="FILE", help="default: the mock-px4.yaml that ships"
    )
    show.set_defaults(run=_demo)
    for command in (fly, show):
        command.add_argument(
            "--programme",
            type=_programmes,
            metavar="NAME[,NAME]",
            help=f"fly these instead of flight.programme: {', '.join(_PROGRAMMES)}",
        )
        command.add_argument("--lockstep", action="store_true", help="on the mock vehicle's clock")
        command.add_argument("--json", action="store_true", help="end with one line of JSON")
    fly.add_argument("--endpoint", help="instead of link.endpoint")
    fly.add_argument("--arm", action="store_true", help="arm by ourselves, as flight.arm: true")

    bench = commands.add_parser("bench", help="measure this program's speed")
    benches = bench.add_subparsers(required=True, metavar="WHAT")
    link = benches.add_parser(
        "link", help="sample in → setpoint out: ours, echo, pymavlink, MAVSDK"
    )
    link.add_argument("--seconds", type=float, default=20.0, help="for each program (20)")
    link.add_argument("--rate", type=float, default=250.0, help="samples a second (250)")
    link.add_argument("--json", action="store_true", help="print the figures as one JSON line")
    link.set_defaults(run=_bench_link)
    step = benches.add_parser("planner", help="a step of each planner, in a flight and in batches")
    step.add_argument("--seconds", type=_seconds, default=5.0, help="of measuring (5)")
    step.add_argument("--json", action="store_true", help="print the figures as one JSON line")
    step.set_defaults(run=_bench_planner)

    study = commands.add_parser(
        "study", help="the paper's experiments, as figures, tables and a page (extra `study`)"
    )
    study.add_argument("name", choices=STUDY_NAMES, metavar="NAME", help=", ".join(STUDY_NAMES))
    study.add_argument(
        "--case", type=Path, metavar="FILE", help="for custom: such as configs/study-case.yaml"
    )
    study.add_argument(
        "--out", type=Path, default=Path("study"), metavar="DIR", help="default: study"
    )
    study.set_defaults(run=_study)

    plot = commands.add_parser("plot", help="draw a recorded flight (extra `plot`)")
    plot.add_argument("folder", type=Path, metavar="FOLDER", help="the flight's folder")
    plot.add_argument("--out", type=Path, metavar="FILE", help="default: FOLDER/flight.png")
    plot.set_defaults(run=_plot)

    check = commands.add_parser("check-config", help="check a configuration file")
    which = check.add_mutually_exclusive_group(required=True)
    which.add_argument("file", type=Path, nargs="?", metavar="FILE")
    which.add_argument("--schema", action="store_true", help="print the JSON Schema instead")
    check.set_defaults(run=_check_config)
    return parser


def _programmes(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in _PROGRAMMES]
    if unknown:
        raise argparse.ArgumentTypeError(
            f"unknown programme {unknown[0]!r}; known: {', '.join(_PROGRAMMES)}"
        )
    return names


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0.0 < seconds < inf:
        raise argparse.ArgumentTypeError("must be above 0 and finite")
    return seconds


def _fly(options: argparse.Namespace) -> int:
    config = _changed(load(options.config), options)
    folder = _flight_folder(config)
    return _fly_in(folder, config, options)


def _demo(options: argparse.Namespace) -> int:
    path = options.config or demo.default_config()
    port = demo.free_port()
    options.endpoint, options.arm = f"udpin://127.0.0.1:{port}", True
    config = _changed(load(path), options)
    demo.check_mock(path)
    folder = _flight_folder(config)
    with demo.bundled_vehicle(path, port, folder / "mock.log", lockstep=config.link.lockstep):
        return _fly_in(folder, config, options)


def _changed(config: Config, options: argparse.Namespace) -> Config:
    """The configuration with what the command line says otherwise."""
    link: dict[str, Any] = {}
    flight: dict[str, Any] = {}
    if options.endpoint:
        link["endpoint"] = options.endpoint
    if options.lockstep:
        link["lockstep"] = True
    if options.programme:
        flight["programme"] = options.programme
    if options.arm:
        flight["arm"] = True
    return changed(config, {"link": link, "flight": flight}, "the command line")


def _flight_folder(config: Config) -> Path:
    """A new folder for one flight, named by its start in UTC.

    Raises:
        ConfigError: it cannot be made.
    """
    base = config.recording.directory / datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    for number in range(1, 100):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise ConfigError(
                f"recording.directory: cannot make {folder}: {error.strerror}"
            ) from error
        return folder
    raise ConfigError(f"recording.directory: {base} and 98 more like it exist already")


def _fly_in(folder: Path, config: Config, options: argparse.Namespace) -> int:
    console = FlightConsole(stderr=options.json, highlight=False)
    observer = TerminalObserver(console)
    session = Session(config, folder, observer, observer.ask_landing)
    run: Callable[..., Summary] = lockstep.run if config.link.lockstep else link_loop.run
    with ExitStack() as stack:
        stack.callback(observer.close)
        try:
            summary = run(_interruptible(session))
        except (EndpointError, SigningError):
            shutil.rmtree(folder)  # nothing was flown, so there is nothing to keep
            raise
    # From here on the vehicle is in other hands, and all is on the disk.
    with suppress(OSError):
        console.print(flight_table(summary))
        console.print(f"Recorded in {folder}", soft_wrap=True)
    if options.json:
        print(summary.as_json())
    return EXIT_OK if summary.result == "ok" else EXIT_FLIGHT


async def _interruptible(session: Session) -> Summary:
    """Fly; the first Ctrl-C, SIGTERM or SIGHUP hands back, the second leaves at once."""
    loop = asyncio.get_running_loop()
    flight = asyncio.ensure_future(session.fly())
    interrupts = 0

    def interrupt(name: str) -> None:
        nonlocal interrupts
        interrupts += 1
        if interrupts > 1 or not session.interrupt(f"interrupted by {name}"):
            flight.cancel()

    loop.add_signal_handler(signal.SIGINT, interrupt, "the user (Ctrl-C)")
    loop.add_signal_handler(signal.SIGTERM, interrupt, "SIGTERM")
    loop.add_signal_handler(signal.SIGHUP, interrupt, "SIGHUP (the terminal went away)")
    return await flight


def _bench_link(options: argparse.Namespace) -> int:
    from companion.bench import link  # noqa: PLC0415  no other command needs it

    figures = link.run(options.seconds, options.rate, options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def _bench_planner(options: argparse.Namespace) -> int:
    from companion.bench import planner  # noqa: PLC0415  no other command needs it

    figures = planner.run(options.seconds, options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def _study(options: argparse.Namespace) -> int:
    needs.check()
    from companion.study import runner  # noqa: PLC0415  needs the extra

    console = Console()
    try:
        page = runner.run(options.name, options.case, options.out, console)
    except KeyboardInterrupt:
        console.print(f"Interrupted; what stands in {options.out} is whole.", highlight=False)
        return EXIT_FLIGHT
    console.print(f"Open {page}", soft_wrap=True, highlight=False)
    return EXIT_OK


def _plot(options: argparse.Namespace) -> int:
    out = options.out or options.folder / "flight.png"
    draw_flight(options.folder, out)
    print(out)
    return EXIT_OK


def _check_config(options: argparse.Namespace) -> int:
    if options.schema:
        sys.stdout.write(json_schema())
        return EXIT_OK
    config = load(options.file)
    parse_endpoint(link_settings(config).endpoint)
    if config.mock is not None:
        demo.check_mock(options.file)
    print(f"{options.file}: ok")
    return EXIT_OK
