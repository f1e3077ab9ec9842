"""Reads a `.mcap` with the library `mcap`, also one that was cut off anywhere."""

import errno
import struct
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from companion.recording.mcap_file.channels import TOPICS

_MAX_BYTES = 1 << 28
"""Largest length of a record that we write, bytes; a longer one is damaged."""
_DAMAGE_ERRORS = (
    McapError,
    ZstdError,
    ValueError,
    RuntimeError,
    EOFError,
    KeyError,
    IndexError,
    MemoryError,
    OverflowError,
    struct.error,
)
"""Exceptions that the library and its decompression raise for damaged bytes."""


@dataclass
class McapContent:
    """The content of a `.mcap`."""

    messages: dict[str, list[tuple[int, bytes]]] = field(default_factory=lambda: defaultdict(list))
    """(time ns, data) of each message, by topic, in the order of the file."""
    topic_order: list[str] = field(default_factory=list)
    """The topic of each message, in the order of the file."""
    schemas: dict[str, bytes] = field(default_factory=dict)
    """The message definition of each topic."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """Metadata records by name; the last one if a name occurs several times."""
    complete: bool = False
    """Whether the file was closed, with its index at the end. False: power failed, the process was
    killed, or the disk was full; up to a second may then be missing at the end."""
    damage: str | None = None
    """Why reading ended before the end of the file, or None."""


def read_mcap(path: Path) -> McapContent:
    """Read all messages up to the end or to the first damage.

    Raises:
        OSError: the file cannot be opened, or is a pipe, from which reading may never end.
    """
    content = McapContent()
    topics: dict[int, str] = {}
    schemas: dict[int, bytes] = {}
    if path.is_fifo():
        raise OSError(errno.EINVAL, "not a regular file")
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, record_size_limit=_MAX_BYTES)
        try:
            for record in reader.records:
                _store(record, topics, schemas, content)
            content.complete = True
        except _DAMAGE_ERRORS as error:
            if file.read(1):  # else it was cut off in the middle of this record
                content.damage = str(error) or type(error).__name__
    return content


def _store(
    record: McapRecord, topics: dict[int, str], schemas: dict[int, bytes], content: McapContent
) -> None:
    if isinstance(record, Chunk):
        if record.uncompressed_size > _MAX_BYTES:
            raise ValueError(f"a chunk of {record.uncompressed_size} bytes")
        for chunk_record in breakup_chunk(record, validate_crc=True):
            _store(chunk_record, topics, schemas, content)
    elif isinstance(record, Message):
        topic = topics[record.channel_id]
        content.messages[topic].append((record.log_time, record.data))
        content.topic_order.append(topic)
    elif isinstance(record, Channel):
        topics[record.id] = record.topic
        content.schemas[record.topic] = schemas[record.schema_id]
    elif isinstance(record, Schema):
        schemas[record.id] = record.data
    elif isinstance(record, Metadata):
        content.metadata[record.name] = record.metadata


def changed_topic(content: McapContent) -> str | None:
    """A topic whose messages have other columns than this version writes, or None.

    Names of codes that this version has added since the recording do not count as a change.
    """
    our_columns = {topic: _columns(message_type.schema) for topic, message_type in TOPICS.items()}
    for topic, schema in content.schemas.items():
        recorded_columns = _columns(schema)
        comparable_columns = (
            line
            for line in our_columns.get(topic, recorded_columns)
            if line in recorded_columns or b"=" not in line
        )
        if list(comparable_columns) != recorded_columns:
            return topic
    return None


def _columns(schema: bytes) -> list[bytes]:
    """The lines of a schema without its comments."""
    return [line for line in schema.splitlines() if not line.startswith(b"#")]
