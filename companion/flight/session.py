"""A session: one flight with its folder, recording, link and summary."""

import asyncio
from pathlib import Path

from companion import realtime
from companion.config import Config
from companion.flight.assembly import AssembledFlight, assemble
from companion.flight.changes import Changes
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.flight.flight import AskLanding, Flight
from companion.flight.flight_files import FlightFiles
from companion.flight.observer import Observer
from companion.flight.opening import make_link, realtime_settings
from companion.flight.plan import ConfiguredPlan, Plan
from companion.flight.wiring import connected
from companion.recording.closing_words import STOPPED_BY_USER
from companion.recording.measurements.summary import Summary


class Session:
    """One flight. Signal handlers of the event loop may call `interrupt`, `leave` and `note`.

    `interrupt` and `leave` end the flight, but not the session, so that the recorded data are
    always written.

    Args:
        folder: an existing folder for this flight's files; None: nothing is recorded.
        ask_landing: asks the user, after an interrupt when the vehicle holds, whether to land.
        plan: plan of the flight; None: the configured plan (`ConfiguredPlan`).
        environment: clocks and transports of this computer, or their replacement in tests.

    Attributes:
        changes: changes of values in flight.
    """

    def __init__(
        self,
        config: Config,
        folder: Path | None,
        observer: Observer,
        ask_landing: AskLanding,
        plan: Plan | None = None,
        environment: Environment = THIS_COMPUTER,
    ) -> None:
        self.changes = Changes(config)
        self._config = config
        self._folder = folder
        self._observer = observer
        self._ask_landing = ask_landing
        self._plan = plan
        self._environment = environment
        self._assembled: AssembledFlight | None = None
        self._flight_task: asyncio.Task[str] | None = None
        self._early_notes: list[str] = []

    def interrupt(self, reason: str) -> bool:
        """End the flight like `Flight.interrupt`; return False if there is no flight yet."""
        if self._assembled is None:
            return False
        self._assembled.flight.interrupt(reason)
        return True

    def leave(self) -> None:
        """Stop sending and end the flight at once; without a flight, do nothing."""
        if self._flight_task is not None and not self._flight_task.cancelling():
            self._flight_task.cancel()

    @property
    def end_reason(self) -> str | None:
        """Why the flight ends or ended early; None: the flight goes on, or was completed."""
        return None if self._assembled is None else self._assembled.flight.end_reason

    def note(self, text: str) -> None:
        """Record an event and show it; before the flight begins, keep it until then."""
        if self._assembled is None:
            self._early_notes.append(text)
        else:
            self._assembled.flight.note(text)

    async def fly(self) -> Summary:
        """Fly, and write `config.yaml`, `flight.tlog`, `flight.mcap`, `summary.json` to the folder.

        `companion fly --config FOLDER/config.yaml` repeats the flight from any working folder.

        Raises:
            ConfigError: a maneuver cannot be flown; nothing was sent.
            LinkError: the link could not be opened; nothing was sent but a heartbeat in lockstep.
            OSError: the folder cannot be written; nothing was sent.
            RealtimeError: the system refused a required `realtime` setting; nothing was sent.
        """
        # This takes up to a second, during which an open link would not be read.
        plan = ConfiguredPlan(self._config) if self._plan is None else self._plan
        environment = self._environment
        config = self.changes.begin_flight()
        files = FlightFiles(
            config, self._folder, environment, self.note, flies_maneuvers=self._plan is None
        )
        settings = realtime_settings(self._config, environment)
        with realtime.request_settings(settings) as realtime_results, files:
            recorder, opener = files.recorder(self._observer), environment.open_transport
            async with make_link(self._config, files.tap, self.note, opener) as link:
                self._assembled = assemble(
                    self._config,
                    link,
                    recorder,
                    self._ask_landing,
                    self._folder,
                    plan,
                    environment,
                    self.changes,
                )
                for text in (*self._early_notes, *map(str, realtime_results)):
                    self._assembled.flight.note(text)
                async with connected(self._assembled):
                    result = await self._run(self._assembled.flight)
            summary = files.summary(self._assembled, result, realtime_results)
        await asyncio.sleep(0)  # lets a failure of the writing thread arrive
        return files.save(summary)

    async def _run(self, flight: Flight) -> str:
        # In a task of its own: `leave` ends the flight but not the writing of the files.
        self._flight_task = asyncio.ensure_future(flight.run())
        try:
            return await self._flight_task
        except asyncio.CancelledError:
            flight.failed_phase = flight.failed_phase or flight.phase
            return STOPPED_BY_USER
