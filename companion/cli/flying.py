"""Shared by all commands that fly: the options, the flight, and its report."""

import argparse
import asyncio
import shutil
from contextlib import suppress
from pathlib import Path

from companion import demo
from companion.api.connection import run
from companion.cli import interrupts
from companion.cli.helper_process import flight_environment, helper_process
from companion.cli.signals import fly_interruptibly
from companion.cli.terminal import FlightConsole, TerminalObserver
from companion.config import Config
from companion.config.files import changed, load, shipped, with_assignments
from companion.extras import MissingExtraError
from companion.files.write_whole import reason_of
from companion.files.yaml_file import ConfigError
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.observer import SeveralObservers
from companion.flight.session import Session
from companion.flight.start_checks import check_control, check_link, require_extras
from companion.live.helper import Helper
from companion.mavlink.errors import EndpointError, SigningError
from companion.program_command import no_report_text, program_command
from companion.realtime import RealtimeError
from companion.recording.closing_words import Invocation, closing_words
from companion.recording.folder import flight_folder
from companion.recording.measurements.summary import Summary
from companion.recording.summary_tables import flight_table, styled_text


def with_options(config: Config, options: argparse.Namespace, planner: str | None = None) -> Config:
    """The configuration as changed by the options of the command line.

    `planner`: replaces `planner.name`; None: it stays.

    Raises:
        ConfigError: options and configuration contradict each other; the trajectory cannot be
            flown; or a planner or guidance of another package cannot be used.
        MissingExtraError: an extra that the configuration needs is not installed.
        SigningError: the signing key cannot be used.
    """
    if options.maneuvers and options.trajectory:
        raise ConfigError(
            "--trajectory flies only its file, so --maneuvers has no effect; leave out one of them"
        )
    option_values = {
        "link": {"endpoint": options.endpoint, "lockstep": options.lockstep},
        "flight": {
            "maneuvers": ("trajectory",) if options.trajectory else options.maneuvers,
            "trajectory": options.trajectory,
            "slow_down": options.slow_down,
        },
        "planner": {"name": planner},
    }
    changes = {
        section: {key: value for key, value in values.items() if value}  # only given options
        for section, values in option_values.items()
    }
    if options.arm or options.take_over:  # --arm replaces take_over of the file, and the reverse
        changes["flight"] |= {"arm": options.arm, "take_over": options.take_over}
    flown_config = with_assignments(config, options.set)
    flown_config = changed(flown_config, changes, "the command line")
    if options.slow_down and "trajectory" not in flown_config.flight.maneuvers:
        raise ConfigError("--slow-down needs a trajectory; add --trajectory FILE")
    # Refuse what cannot be flown before anything starts.
    check_link(flown_config)
    configured_maneuvers(flown_config)
    check_control(flown_config)
    require_extras(flown_config)
    return flown_config


def invocation(options: argparse.Namespace) -> Invocation:
    """The command line of this run, for messages."""
    config = None if options.config is None else str(options.config)
    return Invocation(program_command(), options.typed, config)


def fly(
    config: Config,
    folder: Path,
    console: FlightConsole,
    invocation: Invocation | None = None,
    helper: Helper | None = None,
) -> Summary:
    """Fly as configured, record in `folder`, and print phases, tables and summary to `console`.

    `invocation` is the command line of this run, to suggest the next command.

    Raises:
        LinkError: the link could not be opened; nothing was sent.
        OSError: the folder cannot be written; nothing was sent.
        RealtimeError: what `realtime` requires is not granted; nothing was sent.
    """
    observer = TerminalObserver(console)
    observers = observer if helper is None else SeveralObservers(observer, helper)
    session = Session(
        config, folder, observers, observer.ask_landing, environment=flight_environment(helper)
    )
    flight = fly_interruptibly(session)
    if helper is not None:
        helper.changes, helper.note = session.changes, session.note
        flight = helper.run_while_serving(flight)
    try:
        summary = run(flight, in_lockstep=config.link.lockstep)
    except (EndpointError, RealtimeError, SigningError):
        shutil.rmtree(folder)  # nothing was flown, so there is nothing to keep
        raise
    except (asyncio.CancelledError, KeyboardInterrupt):
        with suppress(OSError):
            folder.rmdir()  # if it is empty, nothing was recorded
        raise
    finally:
        observer.close()
    # The vehicle is handed back and the record is complete: signals may interrupt again.
    interrupts.raise_interrupt_on(interrupts.signals_with_default_handler())
    with suppress(OSError):
        console.print(flight_table(summary))
        no_record_text = f"Not recorded: {folder} was removed or renamed in flight"
        record_text = f"Recorded in {folder}" if folder.is_dir() else no_record_text
        console.print(record_text, soft_wrap=True)
        closing_text = closing_words(summary.as_dict(), invocation)
        console.print(styled_text(closing_text), soft_wrap=True)
    if config.recording.report:  # even if nobody reads the console, as after `| head`
        page_text = write_flight_page(folder)
        with suppress(OSError):
            console.print(page_text, soft_wrap=True)
    return summary


def write_flight_page(folder: Path) -> str:
    """Write the page about a flight; return its path, or why there is no page, as a sentence."""
    from companion.report.page import write_report  # noqa: PLC0415  after the flight only

    try:
        return f"Report: {write_report(folder)}"
    except MissingExtraError as error:
        return f"No report: {error}"
    except KeyboardInterrupt:
        reason = "interrupted"
    except OSError as error:
        reason = reason_of(error)
    except Exception as error:  # The flight is over.
        reason = str(error) or type(error).__name__
    return no_report_text(reason, folder)


def fly_bundled(
    path: Path | None,
    options: argparse.Namespace,
    console: FlightConsole,
    planner: str | None = None,
    invocation: Invocation | None = None,
) -> Summary:
    """Start the mock vehicle with the configuration in `path` (None: the shipped one) and fly it.

    `link.endpoint` selects UDP, TCP or a serial line to the vehicle; free ports are used.

    Raises:
        ConfigError: the configuration, or its section `mock`, is wrong.
        VehicleStoppedError: the vehicle ended before the flight did.
    """
    path = path or shipped("mock-px4.yaml")
    config = config_as_read = load(path)
    with demo.local_endpoints(config.link.endpoint) as endpoints:
        options.endpoint, options.arm, options.take_over = endpoints.program, True, False
        config = with_options(config, options, planner)
        demo.check_mock(path)
        folder = flight_folder(config.recording.directory)
        in_lockstep = config.link.lockstep
        with (
            helper_process(options, config, path, config_as_read, folder, console) as helper,
            demo.bundled_vehicle(path, endpoints, folder / "mock.log", lockstep=in_lockstep),
        ):
            return fly(config, folder, console, invocation, helper)
