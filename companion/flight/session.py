"""A session: one flight with its folder, recording, link and summary."""

import asyncio
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path

from companion import realtime
from companion.config import Config
from companion.flight import flown_config
from companion.flight.assembly import Assembled, assemble, open_link, realtime_wishes
from companion.flight.context import cancel
from companion.flight.course import advice, course_of
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.flight.flight import AskLanding
from companion.flight.observer import EventRecorder, Observer
from companion.flight.plan import ConfiguredPlan, Plan
from companion.flight.wiring import connected
from companion.mavlink.texts import TextFrames
from companion.realtime import Wishes
from companion.recording.summary import Summary
from companion.recording.tlog import TlogWriter
from companion.safety.actions import internal
from companion.vehicle.link import Link


class Session:
    """Flies once. Signal handlers of the event loop may call `interrupt`, `leave` and `note`.

    They end the flight, but not the session, so that the recorded data are always written.

    Args:
        config: of the flight.
        folder: an existing folder for this flight's files; None: nothing is recorded.
        observer: receives phases and events.
        ask_landing: asks the user, after an interrupt when the vehicle holds, whether to land.
        plan: of the flight; None: as configured.
        environment: what the flight gets from the computer.
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
        self._config = config
        self._folder = folder
        self._observer = observer
        self._ask_landing = ask_landing
        self._plan = plan
        self._environment = environment
        self._assembled: Assembled | None = None
        self._flying: asyncio.Task[str] | None = None
        self._early_notes: list[str] = []

    def interrupt(self, reason: str) -> bool:
        """Hand the vehicle back; False if there is no flight to interrupt yet."""
        if self._assembled is None:
            return False
        self._assembled.flight.interrupt(reason)
        return True

    def leave(self) -> None:
        """Stop sending and end the flight at once; without a flight, do nothing."""
        if self._flying is not None and not self._flying.cancelling():
            self._flying.cancel()

    def note(self, text: str) -> None:
        """Record an event and show it."""
        if self._assembled is None:
            self._early_notes.append(text)
        else:
            self._assembled.flight.note(text)

    async def fly(self) -> Summary:
        """Fly, and write the folder: `flight.tlog`, `config.yaml`, `summary.json`, CSV files.

        `companion fly --config FOLDER/config.yaml` flies the same again, from any working folder.

        Raises:
            ConfigError: a maneuver cannot be flown; nothing was sent.
            LinkError: the link could not be opened; nothing was sent.
            OSError: the folder cannot be written; nothing was sent.
            RealtimeError: the system refused a required `realtime` setting; nothing was sent.
        """
        # This takes up to a second, during which an open link would not be read.
        plan = ConfiguredPlan(self._config) if self._plan is None else self._plan
        if self._folder is not None:
            flown_config.record(self._config, self._folder, follows=self._plan is None)
        environment = self._environment
        wishes = realtime_wishes(self._config) if environment.realtime else Wishes()
        with realtime.asked_for(wishes) as grants, self._tlog() as tlog:
            recorder = EventRecorder(self._observer, *self._writer(tlog))
            async with open_link(self._config, tlog, self.note, environment.open_transport) as link:
                self._assembled = assemble(
                    self._config,
                    link,
                    recorder,
                    self._ask_landing,
                    self._folder,
                    plan,
                    environment,
                )
                for text in (*self._early_notes, *map(str, grants)):
                    self._assembled.flight.note(text)
                try:
                    result = await self._run(link, self._assembled)
                finally:
                    self._assembled.close()
            summary = self._summary(link, self._assembled, recorder, result, grants)
        await asyncio.sleep(0)  # lets a failure of the writing thread arrive
        dropped = 0 if tlog is None else tlog.dropped
        summary = replace(summary, link={**summary.link, "not_recorded": dropped})
        if self._folder is not None:
            self._save(self._folder, summary)
        return summary

    def _tlog(self) -> AbstractContextManager[TlogWriter | None]:
        """What writes the frames of the flight, if they are recorded."""
        if self._folder is None:
            return nullcontext()
        loop = asyncio.get_running_loop()
        in_vehicle_time = self._config.link.lockstep or not self._environment.realtime
        epoch = 0.0 if in_vehicle_time else time.time() - loop.time()

        def on_failure(text: str) -> None:  # called in the writing thread
            loop.call_soon_threadsafe(self.note, text)

        return TlogWriter(self._folder / "flight.tlog", epoch, on_failure)

    def _writer(self, tlog: TlogWriter | None) -> tuple[Callable[[], float], Callable[[str], None]]:
        """Our clock, and what writes words into the `.tlog` as STATUSTEXT of ours."""
        clock, texts = asyncio.get_running_loop().time, TextFrames(self._config.link.source_system)

        def write(words: str) -> None:
            if tlog is not None:
                for frame in texts.frames(words):
                    tlog(clock(), frame)

        return clock, write

    async def _run(self, link: Link, assembled: Assembled) -> str:
        """Fly over the open link."""
        flight = assembled.flight
        with connected(link, assembled):
            # In a task of its own: `leave` ends the flight but not the writing of the files.
            self._flying = asyncio.ensure_future(flight.run())
            reporting = asyncio.create_task(self._report(assembled))
            try:
                return await self._flying
            except asyncio.CancelledError:
                flight.failed_in = flight.failed_in or flight.phase
                return "left at once by the user"
            finally:
                await cancel(reporting)

    @staticmethod
    async def _report(assembled: Assembled) -> None:
        """Record and show the state of the flight; a fault in it does not end the flight."""
        try:
            await assembled.reporter.run()
        except Exception as error:
            assembled.flight.note(internal(error))

    def _summary(
        self,
        link: Link,
        assembled: Assembled,
        recorder: EventRecorder,
        result: str,
        grants: tuple[realtime.Grant, ...],
    ) -> Summary:
        """The summary of a flight that is over, while its log is still open."""
        counts = {
            name: value for name, value in asdict(link.stats).items() if isinstance(value, int)
        }
        flight, trace = assembled.flight, assembled.trace
        dead_times = assembled.dead_time_watch.over_the_flight()
        advised = advice(assembled, dead_times)
        for text in advised:  # shown with the figures, not here
            if text == dead_times.warning():
                continue  # told in flight
            flight.events.append((asyncio.get_running_loop().time() - flight.began, text))
            recorder.write(text)
        assembled.memory.save()
        return Summary(
            result=result,
            phase=(flight.failed_in or flight.phase).name,
            planner=self._config.planner_name,
            gain=self._config.planner.gain_per_s,
            counts=assembled.counts(),
            link=counts,
            trace=trace,
            events=flight.events,
            log=self._folder,
            dead_times=dead_times,
            predictive=assembled.predictive_figures(),
            realtime={grant.name: grant.refusal or "granted" for grant in grants},
            course=course_of(assembled, recorder.phases, result, advised),
        )

    def _save(self, folder: Path, summary: Summary) -> None:
        try:
            (folder / "summary.json").write_text(summary.as_json() + "\n", encoding="utf-8")
            summary.trace.save(folder)
        except OSError as error:
            self.note(f"{folder}: some files were not written: {error.strerror}")
