"""The records of the flights under clients' control, each in its own folder."""

import asyncio
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from companion import realtime
from companion.api.flight_loop import call_in_thread
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.flight.environment import Environment
from companion.flight.flight_files import FlightFiles
from companion.mavlink.transport.base import Tap
from companion.recording.folder import flight_folder
from companion.recording.measurements.summary import Summary


class FlightRecords:
    """Makes the record of each flight; between flights nothing is recorded.

    An instance is the `Tap` of the link, which stays open between flights.

    Args:
        directory: folder for the flights' folders; None: nothing is recorded.
        note: called with each event, as a sentence for the user.

    Attributes:
        realtime_results: for each requested real-time setting, whether it was granted.
        on_recorded: called with the folder of each flight when its record is complete; returns a
            sentence for the clients, or None. Called in a thread, except on a virtual clock.
    """

    def __init__(
        self, directory: Path | None, environment: Environment, note: Callable[[str], None]
    ) -> None:
        self.realtime_results: tuple[realtime.SettingResult, ...] = ()
        self.on_recorded: Callable[[Path], str | None] = lambda _: None
        self._directory = directory
        self._environment, self._note = environment, note
        self._tap: Tap | None = None

    def __call__(self, time: float, frame: bytes) -> None:
        """Take a frame of the link at `time`, s of event-loop time."""
        if self._tap is not None:
            self._tap(time, frame)

    def new_record(self, config: Config) -> FlightFiles:
        """Open the record of a new flight, which begins with this configuration.

        If no folder can be created, the flight is not recorded, and the user is told.
        """
        folder = None
        if self._directory is not None:
            try:
                folder = flight_folder(self._directory)
                record = self._record(config, folder)
                record.open()
                return record
            except (ConfigError, OSError) as error:
                self._note(f"this flight is not recorded: {error}")
                _remove(folder)
        return self._record(config, None)

    @contextmanager
    def recording(self, record: FlightFiles) -> Iterator[None]:
        """Write the frames of the link to a record while the block runs; then close it."""
        with record:
            self._tap = record.tap
            try:
                yield
            finally:
                self._tap = None

    async def keep(self, record: FlightFiles, summary: Summary) -> None:
        """Write the summary of a finished flight, whose log is closed; then call `on_recorded`.

        The next flight may already have begun, with its own record.
        """
        await call_in_thread(record.save, summary)
        if record.folder is not None:
            self._note(f"recorded in {record.folder}")
            text = await call_in_thread(self.on_recorded, record.folder)
            if text is not None:
                self._note(text)

    async def discard(self, record: FlightFiles) -> None:
        """Remove the record of a failed takeover, in which nothing was flown."""
        await call_in_thread(_remove, record.folder)

    def _record(self, config: Config, folder: Path | None) -> FlightFiles:
        loop = asyncio.get_running_loop()

        def note(text: str) -> None:  # `FlightFiles.save` calls it in a thread
            loop.call_soon_threadsafe(self._note, text)

        return FlightFiles(config, folder, self._environment, note, flies_maneuvers=False)


def _remove(folder: Path | None) -> None:
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)
