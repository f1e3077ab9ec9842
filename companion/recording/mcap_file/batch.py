"""Messages of `flight.mcap` for the live stream: several in one datagram.

A datagram is a sequence of messages. Each consists of the index of its channel in `TOPICS` (uint8),
its time in ns since 1970 (uint64; if the flight runs in vehicle time: since the vehicle's boot),
its length (uint32), and its bytes.
"""

import struct
from collections.abc import Callable, Iterator

from companion.recording.mcap_file.channels import TOPICS

_MESSAGE_HEADER = struct.Struct("<BQI")
_TOPIC_NUMBERS = {topic: number for number, topic in enumerate(TOPICS)}
_FULL_BATCH_BYTES = 32_000
"""Length above which a batch is sent, bytes; well below the buffer of a socket."""

SendBatch = Callable[[bytes], None]
"""Sends a datagram; it never blocks, and never raises."""


class Batch:
    """Collects messages and passes them to `send` together. Only one thread may use it."""

    def __init__(self, send: SendBatch) -> None:
        self._send = send
        self._collected_bytes = bytearray()

    def add(self, topic: str, time_ns: int, data: bytes) -> None:
        """Add a message; send the batch if it is full."""
        self._collected_bytes += _MESSAGE_HEADER.pack(_TOPIC_NUMBERS[topic], time_ns, len(data))
        self._collected_bytes += data
        if len(self._collected_bytes) > _FULL_BATCH_BYTES:
            self.send()

    def send(self) -> None:
        """Send the collected messages."""
        if self._collected_bytes:
            self._send(bytes(self._collected_bytes))
            self._collected_bytes.clear()


def messages_of(datagram: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Index of the channel, time and bytes of each message of a datagram, in order."""
    offset = 0
    while offset < len(datagram):
        topic_number, time_ns, length = _MESSAGE_HEADER.unpack_from(datagram, offset)
        offset += _MESSAGE_HEADER.size + length
        yield topic_number, time_ns, datagram[offset - length : offset]
