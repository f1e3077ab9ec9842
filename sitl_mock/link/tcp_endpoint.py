"""A TCP endpoint for one client; it rejects a second one, as ArduPilot does."""

import socket

from sitl_mock.config.section import ConfigError
from sitl_mock.link.byte_stream import ByteStream


class TcpEndpoint:
    """Serves one client at a time; after it disconnects, another may connect.

    Raises:
        ConfigError: the port cannot be used, or the address is not local.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            self._listener = socket.create_server((host, port))
        except OSError as error:
            raise ConfigError(
                f"TCP port {port} on {host} cannot be used ({error.strerror}): is another"
                " mock running? Choose a different --endpoint"
            ) from error
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._stream: ByteStream | None = None
        self.address = f"TCP {host}:{port}"
        self.has_received = False

    @property
    def connected(self) -> bool:
        """Whether a client is connected."""
        self._accept()
        return self._stream is not None

    @property
    def descriptors(self) -> list[int]:
        """File descriptors of the listening socket and of the client's connection."""
        descriptors = [self._listener.fileno()]
        if self._client is not None:
            descriptors.append(self._client.fileno())
        return descriptors

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the client's next frame, None if there is none."""
        self._accept()
        if self._stream is None:
            return None
        frame = self._stream.receive()
        self._release_client()
        if frame is None:
            return None
        self.has_received = True
        return frame, True

    def send(self, datagrams: list[bytes]) -> None:
        """Send to the client, if one is connected."""
        if self._stream is not None:
            self._stream.send(datagrams)
            self._release_client()

    def close(self) -> None:
        """Close the port and the connection."""
        self._listener.close()
        if self._client is not None:
            self._client.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return
        if self._client is not None:
            connection.close()
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client, self._stream = connection, ByteStream(connection.fileno())

    def _release_client(self) -> None:
        """Close the connection of a client that has disconnected."""
        if self._client is not None and self._stream is not None and not self._stream.open:
            self._client.close()
            self._client = self._stream = None
