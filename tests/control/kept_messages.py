"""A recorder that encodes at once, and keeps the messages instead of writing them."""

from collections import defaultdict
from math import nan

from companion.recording.mcap_file.channels import CHANNELS
from companion.recording.mcap_file.writer import McapWriter

_CHANNELS = {channel.topic: channel for channel in CHANNELS}


class KeptMessages:
    """Stands for the recorder of a flight and for its writer.

    Attributes:
        messages: (time in ns, bytes) of each message, by topic.
        actions: (time, name, clock offset) of each action.
    """

    def __init__(self):
        self.messages = defaultdict(list)
        self.actions = []

    def add(self, time, encoder, values):
        encoder(self, round(1e9 * time), values)

    def message(self, topic, time_ns, data):
        self.messages[topic].append((time_ns, data))

    row = McapWriter.row

    def action(self, time, name, clock_offset=None, drag=(nan, nan)):
        self.actions.append((time, name, clock_offset))

    def rows(self, topic):
        """The messages of a channel of numbers: a dict from column to value for each."""
        channel = _CHANNELS[topic]
        rows = channel.rows([data for _, data in self.messages[topic]])
        return [dict(zip(channel.dtype.names, row, strict=True)) for row in rows.tolist()]
