"""The commands `companion fly`, `companion demo` and `companion campaign rerun`."""

import argparse
import webbrowser

from rich.console import Console

from companion.cli import flying
from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.helper_process import helper_process
from companion.cli.terminal import FlightConsole
from companion.config.files import load
from companion.recording.folder import flight_folder
from companion.recording.measurements.summary import Summary
from companion.report import PAGE


def fly(options: argparse.Namespace) -> int:
    """Fly the vehicle that the configuration names."""
    config_as_read = load(options.config)
    config = flying.with_options(config_as_read, options)
    folder = flight_folder(config.recording.directory)
    invocation = flying.invocation(options)
    console = _console(options)
    with helper_process(options, config, options.config, config_as_read, folder, console) as helper:
        summary = flying.fly(config, folder, console, invocation, helper)
    return _report_result(summary, options)


def demo(options: argparse.Namespace) -> int:
    """Start the mock vehicle and fly it."""
    invocation = flying.invocation(options)._replace(config=None)
    path, console = options.config, _console(options)
    summary = flying.fly_bundled(path, options, console, invocation=invocation)
    if options.open and summary.log is not None and (page := summary.log / PAGE).is_file():
        webbrowser.open(page.resolve().as_uri())
    return _report_result(summary, options)


def rerun(options: argparse.Namespace) -> int:
    """Fly one case of a campaign again, and tell whether the flight is identical."""
    from companion.campaign.rerun import rerun as fly_again  # noqa: PLC0415  no other command

    rerun_result = fly_again(options.folder, options.case)
    page = flying.write_flight_page(rerun_result.folder)
    console = Console(highlight=False, soft_wrap=True, markup=False)
    for text in (*rerun_result.lines, f"Recorded in {rerun_result.folder}", page):
        console.print(text)
    return EXIT_OK if rerun_result.identical else EXIT_FAILURE


def _console(options: argparse.Namespace) -> FlightConsole:
    return FlightConsole(stderr=options.json, highlight=False)


def _report_result(summary: Summary, options: argparse.Namespace) -> int:
    """Print the summary for `--json`; return the exit code."""
    if options.json:
        print(summary.as_json())
    return EXIT_OK if summary.result == "ok" else EXIT_FAILURE
