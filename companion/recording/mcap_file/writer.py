"""Writes `flight.mcap` by the format's own library."""

import os
from collections.abc import Mapping
from pathlib import Path

from mcap.writer import CompressionType, Writer

from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.channels import CHANNELS

WORDS = {
    "/phase": cdr.PHASE,
    "/maneuver": cdr.MANEUVER,
    "/alarm": cdr.ALARM,
    "/change": cdr.CHANGE,
    "/log": cdr.LOG,
    "/tf": cdr.FRAME_TRANSFORM,
    "/pose": cdr.POSE_IN_FRAME,
    "/reference": cdr.POSE_IN_FRAME,
}
"""The channels that are no numbers alone, and their types."""
_CHUNK = 1 << 20


class McapWriter:
    """One `.mcap`, open for writing. Not for several threads.

    A chunk is written at each `flush`. A file that ends after a chunk can be read, also without the
    index at its end, which `close` writes.

    Args:
        path: file to create.

    Raises:
        OSError: the file cannot be created or written.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, _CHUNK, CompressionType.LZ4)
        self._writer.start("ros2", "mavlink-companion")
        self._ids: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        for channel in CHANNELS:
            self._register(channel.topic, channel.schema_name, channel.schema)
        for topic, kind in WORDS.items():
            self._register(topic, kind.name, kind.schema)

    def _register(self, topic: str, name: str, schema: bytes) -> None:
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, "ros2msg", schema)
        self._ids[topic] = self._writer.register_channel(topic, "cdr", self._schemas[name])

    def message(self, topic: str, time_ns: int, data: bytes) -> None:
        """Add one message at a time in ns since 1970 (in vehicle time: since its boot)."""
        self._writer.add_message(self._ids[topic], time_ns, data, time_ns)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._writer.add_metadata(name, dict(values))

    def flush(self) -> None:
        """End the chunk, and wait until the disk has it.

        Raises:
            OSError: the disk is full, or failed.
        """
        self._writer.flush()  # type: ignore[no-untyped-call]
        os.fsync(self._file.fileno())

    def close(self, *, complete: bool = True) -> None:
        """Close the file; first complete it by its index, unless a write has failed before.

        Raises:
            OSError: as `flush`.
        """
        if not complete:
            self._file.close()
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self.flush()
        finally:
            self._file.close()
