"""`companion serve`."""

import argparse
import asyncio
import json
import signal
import time
from typing import Any

from companion.cli.exit_codes import EXIT_OK
from companion.cli.helper_process import flight_environment, helper_process
from companion.cli.signals import MIN_CTRL_C_INTERVAL, hangup_signals
from companion.cli.terminal import FlightConsole, TerminalObserver
from companion.config import Config
from companion.config.files import changed, load, with_assignments
from companion.extras import require
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SeveralObservers
from companion.flight.start_checks import check_control, check_link, require_extras
from companion.flight.status import FlightStatus
from companion.mavlink import loop as link_loop
from companion.serve.report_pages import ReportPages
from companion.serve.session import ServeSession

_REPORT_TIMEOUT = 40.0
"""Time allowed after a stop for the report of a flight, s."""


def serve(options: argparse.Namespace) -> int:
    """Relay between the vehicle and other programs, and fly the setpoints of those programs."""
    config_as_read = load(options.config)
    config = _with_options(config_as_read, options)
    console = FlightConsole(stderr=options.json, highlight=False)
    observer = _ServeObserver(console)
    start_time = time.monotonic()

    def note(text: str) -> None:
        observers.event(time.monotonic() - start_time, text)

    with helper_process(options, config, options.config, config_as_read, None, console) as helper:
        observers = observer if helper is None else SeveralObservers(observer, helper)
        session = ServeSession(
            config, note, observers, flight_environment(helper), config.recording.directory
        )
        pages = ReportPages()
        if config.recording.report:
            session.records.on_recorded = pages.write
        serving = _until_stopped(session, pages)
        if helper is not None:
            helper.changes, helper.note = session.changes, note
            serving = helper.run_while_serving(serving)
        try:
            counters = link_loop.run(serving)
        finally:
            observer.close()
    if options.json:
        print(json.dumps(counters))
    return EXIT_OK


class _ServeObserver(TerminalObserver):
    """Shows the phases and events of all flights; times count from the start of the command.

    There are no live lines: they would stay visible between flights.
    """

    def __init__(self, console: FlightConsole) -> None:
        super().__init__(console)
        self._start_time = time.monotonic()

    def event(self, _: float, text: str) -> None:
        """Show an event of a flight or of the command."""
        super().event(time.monotonic() - self._start_time, text)

    def status(self, status: FlightStatus) -> None:
        """Do nothing: there are no live lines."""


async def _until_stopped(session: ServeSession, pages: ReportPages) -> dict[str, Any]:
    """Run a session until SIGINT (Ctrl-C), SIGTERM or SIGHUP; a second Ctrl-C leaves at once."""
    loop = asyncio.get_running_loop()
    stopped_at: float | None = None

    def stop() -> None:
        session.stop()
        loop.call_later(_REPORT_TIMEOUT, pages.stop)

    def interrupt() -> None:
        nonlocal stopped_at
        if stopped_at is None:
            stopped_at = loop.time()
            stop()
        elif loop.time() - stopped_at >= MIN_CTRL_C_INTERVAL:
            session.leave()
            pages.stop()

    loop.add_signal_handler(signal.SIGINT, interrupt)
    for number in (signal.SIGTERM, *hangup_signals()):
        loop.add_signal_handler(number, stop)
    return await session.run()


def _with_options(config: Config, options: argparse.Namespace) -> Config:
    """The configuration as changed by the options of the command line."""
    served_config = with_assignments(config, options.set)
    link = {"endpoint": options.endpoint} if options.endpoint else {}
    clients = {"clients": options.client} if options.client else {}
    served_config = changed(served_config, {"link": link, "serve": clients}, "the command line")
    if served_config.link.lockstep:
        raise ConfigError("link.lockstep: serve runs in real time; set link.lockstep: false")
    if served_config.serve.control:
        require("ruckig", "serve", "serve.control: true")
        check_control(served_config)
    check_link(served_config)
    require_extras(served_config)
    return served_config
