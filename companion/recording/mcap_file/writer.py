"""Writes `flight.mcap` with the library `mcap`."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from mcap.writer import CompressionType, Writer

from companion.recording.mcap_file.batch import Batch, SendBatch
from companion.recording.mcap_file.channels import ENCODING, SCHEMA_ENCODING, TOPICS
from companion.recording.mcap_file.fields import CDR_HEADER, Channel

_CHUNK_LENGTH = 1 << 20
"""Length at which a chunk is ended, bytes."""


class McapWriter:
    """A `.mcap` file open for writing. Only one thread may use it.

    `flush` writes the messages as a chunk; a chunk is also written whenever it reaches 1 MiB. A
    file that ends after a chunk can be read without the index, which `close` writes at the end.

    Args:
        path: file to create.
        stream: also receives the messages, in batches; None: only the file receives them.

    Raises:
        OSError: the file cannot be created or written.
    """

    def __init__(self, path: Path, send_batch: SendBatch | None = None) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, _CHUNK_LENGTH, CompressionType.LZ4)
        self._writer.start("ros2", "mavlink-companion")
        self._channel_ids: dict[str, int] = {}
        schemas: dict[str, int] = {}
        for topic, (name, schema) in TOPICS.items():
            if name not in schemas:
                schemas[name] = self._writer.register_schema(name, SCHEMA_ENCODING, schema)
            self._channel_ids[topic] = self._writer.register_channel(topic, ENCODING, schemas[name])
        self._batch = None if send_batch is None else Batch(send_batch)

    def message(self, topic: str, time_ns: int, data: bytes) -> None:
        """Add a message.

        `time_ns` counts from 1970. If the flight runs in vehicle time, it counts from the vehicle's
        boot.
        """
        if self._batch is not None:
            self._batch.add(topic, time_ns, data)
        self._writer.add_message(self._channel_ids[topic], time_ns, data, time_ns)

    def row(self, channel: Channel, time_ns: int, numbers: Sequence[float]) -> None:
        """Add a message of a numeric channel: the float64 columns, then the uint8 columns."""
        self.message(channel.topic, time_ns, channel.packing.pack(CDR_HEADER, *numbers))

    def stream(self) -> None:
        """Pass the messages added since the last call on to the live stream, if there is one."""
        if self._batch is not None:
            self._batch.send()

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._writer.add_metadata(name, dict(values))

    def flush(self) -> None:
        """End the chunk, and wait until it is on the disk.

        Raises:
            OSError: the disk is full, or failed.
        """
        self._writer.flush()  # type: ignore[no-untyped-call]
        os.fsync(self._file.fileno())

    def close(self, *, complete: bool = True) -> None:
        """Close the file; if `complete`, write its index first.

        Readers treat a file without an index as cut off.

        Raises:
            OSError: the disk is full, or failed.
        """
        if not complete:
            self._file.close()
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self.flush()
        finally:
            self._file.close()
