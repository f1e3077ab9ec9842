"""The files of one flight: configuration, `.tlog`, `.mcap`, and summary."""

import asyncio
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path

from companion import realtime
from companion.config import Config
from companion.files.write_whole import ReservedSpace, write_with_timeout
from companion.flight import flown_config
from companion.flight.assembly import AssembledFlight
from companion.flight.environment import Environment
from companion.flight.flight_facts import advice, facts_of, loop_counts, predictive_figures
from companion.flight.observer import EventRecorder, Observer
from companion.mavlink.stats import LinkStats
from companion.mavlink.texts import TextFrames
from companion.recording.folder import space_warning
from companion.recording.measurements.summary import Summary
from companion.recording.recorder import FlightRecorder
from companion.recording.tlog import TLOG_FILE, TlogWriter

_SUMMARY_RESERVE = 1 << 18
"""Disk space reserved for `summary.json`, bytes; the file usually needs less than 10 kB."""


class FlightFiles:
    """Records one flight. Use it as a context manager around the flight, inside the event loop.

    `config.yaml` is written at the beginning, `flight.tlog` and `flight.mcap` during the flight,
    and the summary by `save`.

    Args:
        note: called with a failure of the recording.
        flies_maneuvers: whether the maneuvers of the configuration are flown.

    Attributes:
        folder: existing folder for the files; None: nothing is written.
        tap: records frames; None if they are not recorded.
        mcap: records the flight, or None.

    Raises:
        ConfigError: the trajectory's file cannot be read.
        OSError: the folder cannot be written.
    """

    def __init__(
        self,
        config: Config,
        folder: Path | None,
        environment: Environment,
        note: Callable[[str], None],
        *,
        flies_maneuvers: bool,
    ) -> None:
        self._config, self.folder, self._note = config, folder, note
        self._link_counters_at_start: dict[str, int] = {}
        self._ended_at = 0.0
        self._failure_reported = self._is_open = False
        self.tap: TlogWriter | None = None
        self.mcap: FlightRecorder | None = None
        if folder is not None:
            flown_config.record(config, folder, flies_maneuvers=flies_maneuvers)
            if (warning := space_warning(folder)) is not None:
                note(warning)
            self._reserved_space = ReservedSpace(folder, _SUMMARY_RESERVE)
            loop = asyncio.get_running_loop()
            in_vehicle_time = config.link.lockstep or not environment.realtime
            clock_epoch = 0.0 if in_vehicle_time else time.time() - loop.time()

            def on_failure(text: str) -> None:  # called in a writing thread
                loop.call_soon_threadsafe(self._report_failure, text)

            def on_bad_entry(text: str) -> None:  # called in a writing thread too
                loop.call_soon_threadsafe(note, text)

            self.tap = TlogWriter(folder / TLOG_FILE, clock_epoch, on_failure)
            self.mcap = FlightRecorder(
                folder / "flight.mcap",
                clock_epoch,
                loop.time,
                on_failure,
                on_bad_entry,
                environment.send_batch,
            )

    def open(self) -> None:
        """Create `flight.tlog` and `flight.mcap`, both or none.

        Raises:
            OSError: a file cannot be created.
        """
        with ExitStack() as opened:
            for file in (self.tap, self.mcap):
                if file is not None:
                    opened.enter_context(file)
            opened.pop_all()
        self._is_open = True

    def __enter__(self) -> "FlightFiles":
        if not self._is_open:
            self.open()
        return self

    def __exit__(self, *_: object) -> None:
        for file in (self.tap, self.mcap):
            if file is not None:
                file.close()

    def _report_failure(self, text: str) -> None:
        """Report once that the recording has stopped; a full disk stops both files."""
        if not self._failure_reported:
            self._failure_reported = True
            self._note(text)

    def recorder(self, observer: Observer) -> EventRecorder:
        """An observer that records phases and events (as STATUSTEXT, too) and calls `observer`."""
        clock = asyncio.get_running_loop().time
        text_frames = TextFrames(self._config.link.source_system)

        def write(text: str) -> None:
            if self.tap is not None:
                for frame in text_frames.frames(text):
                    self.tap(clock(), frame)
            if self.mcap is not None:
                self.mcap.event(text)

        return EventRecorder(observer, clock, write, self.mcap)

    def begin_counting(self, stats: LinkStats) -> None:
        """Count only frames after this call, because the link may have been open before."""
        self._link_counters_at_start = _counters(stats)

    def summary(
        self,
        assembled: AssembledFlight,
        result: str,
        realtime_results: tuple[realtime.SettingResult, ...],
    ) -> Summary:
        """Make the summary of a finished flight before the log is closed; save the learned drag.

        `result`: "ok", or the reason why the flight ended early. `realtime_results`: which
        real-time settings were granted.
        """
        flight, trace = assembled.flight, assembled.trace
        dead_times = assembled.dead_time_watch.measure_whole_flight()
        is_drag_saved = assembled.drag_memory.save()
        advice_texts = advice(assembled, dead_times, is_drag_saved=is_drag_saved)
        for text in advice_texts:  # shown with the figures, not here
            if text == dead_times.warning():
                continue  # already reported in flight
            flight.events.append((asyncio.get_running_loop().time() - flight.began, text))
            assembled.recorder.write(text)
        self._ended_at = asyncio.get_running_loop().time() - flight.began
        return Summary(
            result=result,
            phase=(flight.failed_phase or flight.phase).name,
            planner=self._config.planner_name,
            gain=self._config.planner.gain_per_s,
            counts=loop_counts(assembled.context),
            link={
                name: value - self._link_counters_at_start.get(name, 0)
                for name, value in _counters(assembled.context.link.stats).items()
            },
            trace=trace,
            events=list(flight.events),
            log=self.folder,
            dead_times=dead_times,
            predictive=predictive_figures(assembled.context),
            realtime={each.name: each.refusal or "granted" for each in realtime_results},
            facts=facts_of(assembled, result, advice_texts, is_drag_saved=is_drag_saved),
        )

    def save(self, summary: Summary) -> Summary:
        """Write `summary.json`, once the log is closed; return the summary.

        A write that fails or takes too long is noted as an event. If the folder is gone, the
        summary names none.
        """
        dropped_count = sum(file.dropped for file in (self.tap, self.mcap) if file is not None)
        events = list(summary.events)
        failures = [file.failure for file in (self.tap, self.mcap) if file and file.failure]
        if failures and not any(text in failures for _, text in events):
            events.append((self._ended_at, failures[0]))  # found when the files were closed
        completed = replace(
            summary, link={**summary.link, "not_recorded": dropped_count}, events=events
        )
        folder = self.folder
        if folder is None:
            return completed
        text = completed.as_json() + "\n"
        self._reserved_space.free()
        failure = write_with_timeout(folder / "summary.json", text)
        if failure is not None:
            self._note(f"{folder}: summary.json was not written: {failure}")
        return completed if folder.is_dir() else replace(completed, log=None)


def _counters(stats: LinkStats) -> dict[str, int]:
    return {name: value for name, value in asdict(stats).items() if isinstance(value, int)}
