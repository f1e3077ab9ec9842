"""Runs a command, and turns each of its errors into one sentence and an exit code."""

import argparse
import asyncio
import json
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module

from rich.console import Console

from companion.cli.exit_codes import EXIT_FAILURE, EXIT_USAGE
from companion.cli.text_streams import flush_output
from companion.demo import VehicleStoppedError
from companion.extras import MissingExtraError
from companion.files.write_whole import file_and_reason
from companion.files.yaml_file import ConfigError
from companion.mavlink.errors import EndpointError, LinkError, LogError, SigningError
from companion.realtime import RealtimeError
from companion.recording.flight_record import RecordError
from companion.report import PictureError

_USAGE_ERRORS = (
    ConfigError,
    EndpointError,
    LogError,
    MissingExtraError,
    PictureError,
    RealtimeError,
    RecordError,
    SigningError,
)
"""Errors of the command line, the configuration, or what they name: exit code 2."""
_FLIGHT_ERRORS = LinkError, VehicleStoppedError
"""The link, the mock vehicle or a benchmark failed: exit code 1."""

Command = Callable[[argparse.Namespace], int]


def command_of(options: argparse.Namespace) -> Command:
    """Import the function that the command line asks for, such as `cli.flights.fly`."""
    module, _, function = options.run.rpartition(".")
    command: Command = getattr(import_module(f"companion.{module}"), function)
    return command


def run(command: Command, options: argparse.Namespace) -> int:
    """Run a command; return the exit code.

    If an error ends a command with `--json` before the figures are printed, the error's text is
    printed as `result`, so that the output can be parsed.
    """
    exit_code = EXIT_FAILURE
    reason: str | None = None
    os_error: OSError | None = None
    try:
        exit_code = command(options)
    except _USAGE_ERRORS as error:
        reason, exit_code = str(error), EXIT_USAGE
    except _FLIGHT_ERRORS as error:
        reason = str(error)
    except BrokenPipeError:
        pass  # nobody reads our output any more, as after `| head`; a broken link is a LinkError
    except OSError as error:
        os_error = error
    except asyncio.CancelledError:
        reason = "interrupted before anything was sent"
    except KeyboardInterrupt:  # where no flight handles it
        reason = "interrupted"
    except Exception as error:
        if options.debug:
            traceback.print_exc()
        reason = f"internal error: {error!r}; run again with --debug to see where it happened"
    output_fault = flush_output()
    # An error without a file may be that of standard output, which is reported below.
    if os_error is not None and (output_fault is None or os_error.filename is not None):
        reason = file_and_reason(os_error)
    if reason is not None:
        _print_error(reason)
        if getattr(options, "json", False):
            with suppress(OSError):  # reported below
                print(json.dumps({"result": reason}))
            output_fault = output_fault or flush_output()
    if output_fault:
        _print_error(f"standard output cannot be written: {output_fault}")
        return exit_code or EXIT_FAILURE
    return exit_code


def _print_error(text: str) -> None:
    Console(stderr=True).print(f"companion: {text}", markup=False, highlight=False, soft_wrap=True)
