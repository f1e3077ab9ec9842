"""Serves the live stream: the records of the flight, for Foxglove and Lichtblick.

The library of the protocol (`foxglove-sdk`) serves in its own threads. A client that reads too
slowly loses its oldest messages. Clients can only read: the server offers neither parameters nor
services, and takes no messages.
"""

import asyncio
import os
import socket

import foxglove
from foxglove.websocket import ChannelView, Client, ServerListener, StatusLevel

from companion.live.after_flight import until_unused
from companion.live.channel import Message, datagrams
from companion.live.helper_process import FlightConnection
from companion.recording.mcap_file.batch import messages_of
from companion.recording.mcap_file.channels import ENCODING, SCHEMA_ENCODING, TOPICS

_MOST_DATAGRAMS_PER_TURN = 20
"""Largest number of datagrams handled in one turn of the event loop."""


class _Subscriptions(ServerListener):
    """Tracks whether somebody has the stream open. Foxglove's library calls it in its threads."""

    def __init__(self) -> None:
        self.active: set[tuple[int, int]] = set()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Count a subscription."""
        self.active.add((client.id, channel.id))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """End a subscription; a client that leaves also unsubscribes."""
        self.active.discard((client.id, channel.id))


class LiveStream:
    """A server with the channels of `flight.mcap`.

    Raises:
        RuntimeError: the port cannot be used.
    """

    def __init__(self, host: str, port: int) -> None:
        # Kept, because the library closes the channels of a context without references.
        self._context = foxglove.Context()
        self._subscriptions = _Subscriptions()
        self._channels = [
            foxglove.Channel(
                topic,
                schema=foxglove.Schema(
                    name=message_type.name, encoding=SCHEMA_ENCODING, data=message_type.schema
                ),
                message_encoding=ENCODING,
                context=self._context,
            )
            for topic, message_type in TOPICS.items()
        ]
        self._server = foxglove.start_server(
            name="companion",
            host=host,
            port=port,
            capabilities=[],
            context=self._context,
            server_listener=self._subscriptions,
        )
        self._dropped = 0

    def take(self, datagram: bytes) -> None:
        """Pass the messages in a datagram of `Feed` on to the clients."""
        for number, time_ns, data in messages_of(datagram):
            self._channels[number].log(data, log_time=time_ns)

    def note(self, message: Message) -> None:
        """Tell clients about messages that the flight dropped, and about the flight's end."""
        dropped = message.get("stream_dropped", 0)
        if dropped > self._dropped:
            self._dropped = dropped
            text = "messages are missing: this computer is too busy to stream all of them"
            self._server.publish_status(text, StatusLevel.Warning, "dropped")
        if message["kind"] == "end":
            self._server.publish_status(str(message["text"]), StatusLevel.Info, "end")

    def is_open(self) -> bool:
        """Whether somebody has the stream open."""
        return bool(self._subscriptions.active)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


async def serve_stream(connection: FlightConnection, feed: socket.socket) -> None:
    """Serve the stream of a flight until the flight has ended and nobody needs the stream.

    The records of the flight arrive on the socket `feed`.
    """
    first_message = connection.first_message
    host, port = str(first_message["stream_host"]), int(first_message["stream_port"])
    try:
        stream = LiveStream(host, port)
    except RuntimeError as error:  # another program took the port after the flight's check
        connection.note(f"there is no live stream: {error}; the flight goes on without it")
        feed.close()
        return
    loop = asyncio.get_running_loop()
    os.set_blocking(feed.fileno(), False)

    def on_readable() -> None:
        for datagram in datagrams(feed, _MOST_DATAGRAMS_PER_TURN):
            if datagram:
                stream.take(datagram)
            else:
                loop.remove_reader(feed.fileno())

    loop.add_reader(feed.fileno(), on_readable)
    connection.listen(stream.note)
    await connection.flight_ended.wait()
    await until_unused(port, stream.is_open)
    loop.remove_reader(feed.fileno())
    await asyncio.to_thread(stream.close)
