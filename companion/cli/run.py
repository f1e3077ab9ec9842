"""Runs a command, and turns each of its errors into one sentence and an exit code."""

import argparse
import asyncio
import traceback
from collections.abc import Callable
from importlib import import_module

from rich.console import Console

from companion.cli.exit_codes import EXIT_FLIGHT, EXIT_USAGE
from companion.cli.text_streams import lost_output
from companion.demo import VehicleStoppedError
from companion.extras import MissingExtraError
from companion.files.os_errors import reason_of
from companion.files.yaml_file import ConfigError
from companion.mavlink.errors import EndpointError, LinkError, LogError, SigningError
from companion.realtime import RealtimeError
from companion.recording.figure import FigureError
from companion.recording.flight_record import RecordError

_USAGE_ERRORS = (
    ConfigError,
    EndpointError,
    FigureError,
    LogError,
    MissingExtraError,
    RealtimeError,
    RecordError,
    SigningError,
)
"""The command line or the configuration is wrong, or something that it names cannot be used."""
_FLIGHT_ERRORS = LinkError, VehicleStoppedError
"""The flight failed, or something that it needs failed."""

Command = Callable[[argparse.Namespace], int]


def command_of(options: argparse.Namespace) -> Command:
    """Import the function that the command line asks for, such as `flights.fly`."""
    module, _, function = options.run.partition(".")
    command: Command = getattr(import_module(f"companion.cli.{module}"), function)
    return command


def run(command: Command, options: argparse.Namespace) -> int:
    """Run a command; return the exit code.

    Raises:
        KeyboardInterrupt: Ctrl-C where no flight handles it.
    """
    code = EXIT_FLIGHT
    fault: OSError | None = None
    try:
        code = command(options)
    except _USAGE_ERRORS as error:
        _say(str(error))
        code = EXIT_USAGE
    except _FLIGHT_ERRORS as error:
        _say(str(error))
    except BrokenPipeError:
        pass  # nobody reads our output any more, as after `| head`; a broken link is a LinkError
    except OSError as error:
        fault = error
    except asyncio.CancelledError:
        _say("interrupted before anything was sent")
    except Exception as error:
        if options.debug:
            traceback.print_exc()
        _say(f"internal error: {error!r}; run again with --debug for where it happened")
    lost = lost_output()
    if fault is not None and (lost is None or fault.filename is not None):
        _say(_in_words(fault))
    if lost:
        _say(f"standard output cannot be written: {lost}")
        return code or EXIT_FLIGHT
    return code


def _in_words(error: OSError) -> str:
    """What the operating system refused, with the file if it names one."""
    reason = reason_of(error)
    return reason if error.filename is None else f"{error.filename}: {reason}"


def _say(text: str) -> None:
    Console(stderr=True).print(f"companion: {text}", markup=False, highlight=False, soft_wrap=True)
