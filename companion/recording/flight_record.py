"""Reads a recorded flight, also an interrupted one: `flight.mcap` in its folder.

    record = read_flight(Path("flights/2026-11-22T15-00-00Z"))
    guidance = record.rows("guidance")       # a structured array, one named field per column
    guidance["estimated_north_m"]            # (N,) float64

The columns of each channel are in `companion.recording.mcap_file` (`loop_channels` and `channels`),
with their units. A channel without messages has 0 rows. NaN: not known, or does not apply.

There are three kinds of time. "Our clock" is event-loop time; the flight began when our clock read
`start_time`. `vehicle_time_s` is the vehicle's clock. Phases, events, alarms and the channel
`motion` have the time since the flight began; `since_start` converts our clock to this time. In
lockstep or on a virtual clock, our clock is the vehicle's, and `clock_epoch` is 0.
"""

import json
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.channels import CHANNELS
from companion.recording.mcap_file.fields import Rows
from companion.recording.mcap_file.flight_events import AlarmChange, Event, Phase, ValuesChange
from companion.recording.mcap_file.reader import McapContent, changed_topic, read_mcap
from companion.recording.trace import ManeuverChange

RECORD_FILE = "flight.mcap"
_CHANNEL_BY_NAME = {channel.name: channel for channel in CHANNELS}


class RecordError(Exception):
    """A folder holds no readable record of a flight; the message says what is wrong and where."""


@contextmanager
def record_errors(folder: Path) -> Iterator[None]:
    """Turn errors of the `with` block into RecordError, whose message names `folder`.

    Raises:
        RecordError: the block read an invalid value from the record.
    """
    try:
        yield
    except (ValueError, IndexError, OverflowError, TypeError) as error:
        raise RecordError(
            f"{folder / RECORD_FILE}: not a valid record of a flight: {error}"
        ) from error


@dataclass(frozen=True)
class FlightRecord:
    """A recorded flight. Its properties raise RecordError if a message is not valid."""

    folder: Path
    content: McapContent
    start_time: float
    """Time when the flight began, s on our clock."""
    clock_epoch: float
    """Unix time at which our clock read 0, s; 0 if our clock is the vehicle's."""
    metadata: Mapping[str, Mapping[str, str]]
    """Metadata records by name, such as "flight" with versions, start and seed."""

    def rows(self, name: str) -> Rows:
        """All rows of a channel of numbers, such as "sample" or "guidance", in the file's order.

        Raises:
            KeyError: there is no such channel; the message names all.
            RecordError: a message is not valid.
        """
        if name not in _CHANNEL_BY_NAME:
            raise KeyError(f"no channel {name!r}; there are {', '.join(_CHANNEL_BY_NAME)}")
        if name not in self._rows:
            channel = _CHANNEL_BY_NAME[name]
            with record_errors(self.folder):
                data = [each for _, each in self.content.messages[channel.topic]]
                self._rows[name] = channel.rows(data)
        return self._rows[name]

    @cached_property
    def _rows(self) -> dict[str, Rows]:
        """The channels read so far, by name: `rows` reads each channel once."""
        return {}

    def since_start(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert times on our clock (s) to s since the flight began."""
        return times - self.start_time

    @property
    def fault(self) -> str | None:
        """Why a part of the flight is missing in the record, as a sentence; None: none is missing.

        A record that ends because its flight was killed (no `summary.json`) has no fault.
        """
        if self.content.damage is not None:
            return (
                f"{self.folder}: the recording is damaged, and only the part before was read: "
                f"{self.content.damage}"
            )
        if not self.content.topic_order:
            path = self.folder / RECORD_FILE
            return f"{path} is missing or empty: no sample and no event was recorded"
        if not self.content.complete and (self.folder / "summary.json").is_file():
            return (
                f"{self.folder / RECORD_FILE} ends at {self.duration:.1f} s, before its flight "
                "did: it was cut off, or the disk was full"
            )
        return None

    @cached_property
    def duration(self) -> float:
        """Time from the beginning of the flight to the last row or event, s."""
        last_times = [messages[-1][0] for messages in self.content.messages.values() if messages]
        return max(last_times) * 1e-9 - self.clock_epoch - self.start_time if last_times else 0.0

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The phases of the flight, in order."""
        messages = self._decoded("/phase", 1, 2)
        return tuple(Phase(time - self.start_time, *words) for (time,), words in messages)

    @cached_property
    def maneuvers(self) -> tuple[ManeuverChange, ...]:
        """Beginning of each maneuver and end of the last one (name None); `time` on our clock."""
        messages = self._decoded("/maneuver", 2, 1)
        return tuple(
            ManeuverChange(time, vehicle_time, name or None)
            for (time, vehicle_time), (name,) in messages
        )

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """All events, in order."""
        events = []
        for time_ns, data in self.content.messages["/log"]:
            with record_errors(self.folder):
                level, text, source = cdr.log_of(data)
            events.append(
                Event(time_ns * 1e-9 - self.clock_epoch - self.start_time, text, level, source)
            )
        return tuple(events)

    @cached_property
    def alarms(self) -> tuple[AlarmChange, ...]:
        """The alarms of the safety monitors, in order."""
        messages = self._decoded("/alarm", 2, 3)
        return tuple(
            AlarmChange(time - self.start_time, raised != 0.0, *words)
            for (time, raised), words in messages
        )

    @cached_property
    def changes(self) -> tuple[ValuesChange, ...]:
        """The changes of configuration values in flight, in order."""
        messages = self._decoded("/change", 2, 1)
        with record_errors(self.folder):
            return tuple(
                ValuesChange(time, at_once != 0.0, json.loads(values))
                for (time, at_once), (values,) in messages
            )

    def _decoded(
        self, topic: str, number_count: int, text_count: int
    ) -> list[tuple[tuple[float, ...], list[str]]]:
        messages = self.content.messages[topic]
        with record_errors(self.folder):
            return [cdr.fields_of(data, number_count, text_count) for _, data in messages]


def read_flight(folder: Path | str) -> FlightRecord:
    """Read the record in the folder of a flight.

    The record is empty if the flight was killed before it recorded anything.

    Raises:
        RecordError: there is no record, it cannot be read, or another version wrote it with other
            columns.
    """
    folder = Path(folder)
    if folder.is_file():
        raise RecordError(f"{folder} is a file; name the folder of the flight: {folder.parent}")
    path = folder / RECORD_FILE
    has_config = (folder / "config.yaml").is_file()
    try:
        content = read_mcap(path)
    except OSError as error:
        if not (has_config and isinstance(error, FileNotFoundError)):
            raise RecordError(_not_a_flight_reason(path, error)) from error
        content = McapContent()
    flight_metadata = content.metadata.setdefault("flight", {})
    if not flight_metadata and has_config and content.damage is None:
        flight_metadata.update(began_s="0.0", epoch_s="0.0")
    try:
        start_time = float(flight_metadata["began_s"])
        clock_epoch = float(flight_metadata["epoch_s"])
    except (KeyError, ValueError) as error:
        reason = content.damage or "it does not say when the flight began"
        raise RecordError(f"{path}: not the record of a flight: {reason}") from error
    topic = changed_topic(content)
    if topic is not None:
        raise RecordError(
            f"{path}: the messages of {topic} have other columns than this version's; read the "
            "record with the version that wrote it: companion "
            f"{flight_metadata.get('companion', 'unknown')}"
        )
    return FlightRecord(folder, content, start_time, clock_epoch, content.metadata)


def _not_a_flight_reason(path: Path, error: OSError) -> str:
    """Why the record at `path` cannot be opened, and which folder was probably meant."""
    flights = sorted(path.parent.glob(f"*/{RECORD_FILE}"))
    if isinstance(error, FileNotFoundError) and flights:
        return (
            f"{path.parent} holds the folders of flights; name one of them, such as "
            f"{flights[-1].parent}"
        )
    logs = sorted(path.parent.glob("*.tlog"))
    if isinstance(error, FileNotFoundError) and logs:
        return (
            f"{path.parent} holds no {RECORD_FILE}, but a MAVLink log; a page about the log alone: "
            f"companion report {shlex.quote(str(logs[-1]))}"
        )
    return f"{path}: {error.strerror}; is this the folder of a flight?"
