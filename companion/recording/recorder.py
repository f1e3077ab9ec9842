"""Records a flight into `flight.mcap`, in its own thread.

The control loop passes an encoder and plain values. The thread encodes and writes the messages.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any

from companion.recording.background_file import BackgroundFile
from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.batch import SendBatch
from companion.recording.mcap_file.fields import Channel
from companion.recording.mcap_file.loop_channels import ACTION, ACTION_NAMES
from companion.recording.mcap_file.writer import McapWriter

_MAX_WAITING_ENTRIES = 50_000
"""Largest number of entries that wait to be written."""
_INFORMATION, _WARNING = 2, 3

Encoder = Callable[[McapWriter, int, Any], None]
"""Writes the messages of an entry. Arguments: the file; the time in ns since 1970 (if the flight
runs in vehicle time: since the vehicle's boot); the values."""


Entry = tuple[float, Encoder, Any]
"""Time on our clock, s; an encoder; and its values, which must not change any more."""


class FlightRecorder(BackgroundFile[Entry]):
    """Records a flight; it never delays the flight or raises an exception in it.

    Args:
        path: file that `open` creates.
        clock_epoch: unix time at which the flight's clock read 0, s; 0 if that clock is the
            vehicle's.
        clock: clock of the flight, s.
        on_failure: see `BackgroundFile`.
        on_bad_entry: called with a message, from the writing thread, at the first entry that cannot
            be recorded.
        stream: also receives the messages, in batches, in the writing thread; None: no live stream.
    """

    def __init__(
        self,
        path: Path,
        clock_epoch: float,
        clock: Callable[[], float],
        on_failure: Callable[[str], None] | None = None,
        on_bad_entry: Callable[[str], None] | None = None,
        stream: SendBatch | None = None,
    ) -> None:
        self._clock_epoch, self._clock = clock_epoch, clock
        self._on_bad_entry, self._stream = on_bad_entry, stream
        super().__init__(path, _MAX_WAITING_ENTRIES, on_failure)

    def _create(self) -> None:
        self._writer = McapWriter(self.path, self._stream)

    def _write(self, items: Sequence[Entry]) -> None:
        writer, epoch_ns = self._writer, round(self._clock_epoch * 1e9)
        for time, encoder, values in items:
            try:
                encoder(writer, epoch_ns + round(time * 1e9), values)
            except OSError:
                raise
            except Exception as error:  # one bad entry must not end the record of the flight
                self._drop_bad_entry(error)
        writer.stream()

    def _sync(self) -> None:
        self._writer.flush()

    def _finish_file(self, *, complete: bool) -> None:
        self._writer.close(complete=complete)

    def _drop_bad_entry(self, error: Exception) -> None:
        """Count an entry that cannot be recorded; report the first one."""
        self.dropped += 1
        report, self._on_bad_entry = self._on_bad_entry, None
        if report is not None:
            report(f"{self.path}: an entry was not recorded: {error!r}; the recording goes on")

    def add(self, time: float, encoder: Encoder, values: Any) -> None:
        """Record an entry at `time`, s on our clock."""
        self.put((time, encoder, values))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Record `values` as the metadata record `name`."""
        self.add(self._clock(), _metadata, (name, values))

    def begin(self, start_time: float, values: Mapping[str, str]) -> None:
        """Record the beginning of the flight (s on our clock), and further values as metadata."""
        times = {"began_s": repr(start_time), "epoch_s": repr(self._clock_epoch)}
        self.metadata("flight", {**times, **values})

    def phase(self, name: str, waits_for: str) -> None:
        """Record that a phase begins now."""
        now = self._clock()
        self.add(now, _write_fields, ("/phase", (now,), (name, waits_for)))

    def maneuver(self, time: float, vehicle_time: float, name: str | None) -> None:
        """Record the beginning of a maneuver (None: end of the last one); see `ManeuverChange`."""
        self.add(time, _write_fields, ("/maneuver", (time, vehicle_time), (name or "",)))

    def alarm(self, raised: bool, monitor: str, reason: str, action: str) -> None:
        """Record that the alarm of a safety monitor is raised or ended now."""
        now = self._clock()
        self.add(now, _write_fields, ("/alarm", (now, float(raised)), (monitor, reason, action)))

    def action(
        self,
        time: float,
        name: str,
        clock_offset: float | None = None,
        drag: tuple[float, float] = (nan, nan),
    ) -> None:
        """Record a call by which a phase controls guidance or the control loop.

        Args:
            time: when, s on our clock.
            name: one of `ACTION_NAMES`.
            clock_offset: vehicle time minus our time, s; None: not known.
            drag: linear (1/s) and quadratic (1/m) drag of an earlier flight, for `drag_prior`; NaN:
                none.
        """
        offset = nan if clock_offset is None else clock_offset
        self.row(time, ACTION, (time, offset, *drag, ACTION_NAMES.index(name)))

    def change(self, values: Mapping[str, Mapping[str, Any]], *, at_once: bool) -> None:
        """Record that values of the configuration, by section and key, begin to change now.

        `at_once`: they change without slewing.
        """
        now = self._clock()
        self.add(now, _write_fields, ("/change", (now, float(at_once)), (json.dumps(values),)))

    def event(self, text: str) -> None:
        """Record an event now; its text may begin with its source, such as "safety: "."""
        source, colon, _ = text.partition(": ")
        source = source if colon and source in ("safety", "autopilot", "phase") else "flight"
        self.add(self._clock(), _write_log, (text, source))

    def row(self, time: float, channel: Channel, values: Sequence[float]) -> None:
        """Record a message of a numeric channel: the float64 columns, then the uint8 columns."""
        self.add(time, _write_row, (channel, values))


def _metadata(writer: McapWriter, _: int, values: tuple[str, Mapping[str, str]]) -> None:
    writer.metadata(*values)


def _write_fields(
    writer: McapWriter, time_ns: int, values: tuple[str, tuple[float, ...], tuple[str, ...]]
) -> None:
    topic, numbers, texts = values
    writer.message(topic, time_ns, cdr.fields_message(numbers, texts))


def _write_log(writer: McapWriter, time_ns: int, values: tuple[str, str]) -> None:
    text, source = values
    level = _WARNING if source == "safety" else _INFORMATION
    writer.message("/log", time_ns, cdr.log_message(time_ns, level, text, source))


def _write_row(writer: McapWriter, time_ns: int, values: tuple[Channel, Sequence[float]]) -> None:
    channel, numbers = values
    writer.row(channel, time_ns, numbers)
