"""Clients over TCP: those that connect to our port, or a program to whose port we connect."""

import asyncio
import socket

from companion.mavlink.errors import EndpointError
from companion.mavlink.peer import NamedPeers, host_and_port, plain_host, resolve_peers
from companion.mavlink.transport.base import why_not_opened
from companion.mavlink.transport.endpoint import TcpClient as TcpOut
from companion.mavlink.transport.endpoint import TcpServer
from companion.serve.network.client import Client, ClientListener, FloodDetector

_MAX_CLIENTS = 16
_MAX_UNSENT_BYTES = 65_536
"""Number of unsent bytes to one client above which further frames are dropped."""
_KERNEL_BUFFER = 65_536
"""Size of the kernel's send buffer for a client, bytes; small, because a client that paused
must read all old bytes in the buffer before it reads anything new."""
_READ_BYTES = 4096
"""Largest number of bytes that are read at once; asyncio would read 256 KiB, whose handling would
stop the control loop for too long."""
_DEAD_TIMEOUT = 60.0
"""Time without an acknowledgement or a read after which a client counts as gone, s. Linux would
wait for 15 minutes, in which a client that reconnects often over a bad network would take all
`_MAX_CLIENTS` places.
"""
_RETRY_PAUSE = 2.0
"""Pause before connecting again, s."""
_CONNECT_TIMEOUT = 5.0


async def open_tcp_server(endpoint: TcpServer, clients: ClientListener) -> "TcpPort":
    """Listen for clients.

    Raises:
        EndpointError: the port is in use or not permitted, the address is not that of an interface
            of this computer, or a peer's host name is unknown.
    """
    port = TcpPort(clients, await resolve_peers(endpoint.peers, socket.SOCK_STREAM))
    try:
        await port.listen(endpoint)
    except OSError as error:
        endpoint_text = f"TCP {endpoint.host}:{endpoint.port}"
        raise EndpointError(f"{endpoint_text}: {why_not_opened(error)}") from error
    return port


def open_tcp_client(endpoint: TcpOut, clients: ClientListener) -> "TcpPort":
    """Connect to a program that listens, now or later; reconnect when the connection is lost."""
    port = TcpPort(clients, NamedPeers())
    port.connect(endpoint)
    return port


class TcpPort:
    """The TCP connections of one endpoint.

    Attributes:
        local: (host, port) on which clients are accepted; None: this program connects.
    """

    def __init__(self, clients: ClientListener, named_peers: NamedPeers) -> None:
        self._clients, self._named_peers = clients, named_peers
        self._server: asyncio.Server | None = None
        self._connect_task: asyncio.Task[None] | None = None
        self._connected_clients: set[TcpClient] = set()
        self._closed = False
        self.local: tuple[str, int] | None = None

    async def listen(self, endpoint: TcpServer) -> None:
        """Accept clients at `endpoint`; raises OSError if that is not possible."""
        self._server = await asyncio.get_running_loop().create_server(
            lambda: _Connection(self), endpoint.host, endpoint.port
        )
        self.local = self._server.sockets[0].getsockname()[:2]

    def connect(self, endpoint: TcpOut) -> None:
        """Keep a connection to `endpoint` open."""
        self._connect_task = asyncio.get_running_loop().create_task(self._keep_connected(endpoint))

    async def _keep_connected(self, endpoint: TcpOut) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                async with asyncio.timeout(_CONNECT_TIMEOUT):
                    _, connection = await loop.create_connection(
                        lambda: _Connection(self), endpoint.host, endpoint.port
                    )
                await connection.lost.wait()
            except OSError:
                pass  # not reachable now; TimeoutError is an OSError, too
            await asyncio.sleep(_RETRY_PAUSE)

    def accept(self, transport: asyncio.Transport) -> "TcpClient | None":
        """Make a client for a new connection; None if it is refused."""
        address = transport.get_extra_info("peername")
        is_full = len(self._connected_clients) >= _MAX_CLIENTS
        if self._closed or is_full or address is None or not self._named_peers.admits(address):
            return None
        sock = transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BUFFER)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1e3 * _DEAD_TIMEOUT))
        name, host = f"tcp {host_and_port(address)}", plain_host(str(address[0]))
        client = TcpClient(name, host, transport)
        self._connected_clients.add(client)
        self._clients.attach(client)
        return client

    def receive_frames(self, client: "TcpClient", data: bytes) -> int:
        """Pass on the frames in the bytes that a client sent; return the number of frames."""
        frames = client.scan(data)
        self._clients.receive_frames(client, frames)
        return len(frames)

    def remove(self, client: "TcpClient") -> None:
        """Remove a client whose connection is gone."""
        if client in self._connected_clients:
            self._connected_clients.discard(client)
            self._clients.detach(client)

    def close(self) -> None:
        """Close all connections at once."""
        self._closed = True
        if self._connect_task is not None:
            self._connect_task.cancel()
        if self._server is not None:
            self._server.close()
        for client in tuple(self._connected_clients):
            client.abort()
            self.remove(client)


class TcpClient(Client):
    """A client with one TCP connection."""

    def __init__(self, name: str, host: str, transport: asyncio.Transport) -> None:
        super().__init__(name, host=host, streaming=True)
        self._transport = transport

    def abort(self) -> None:
        """Close the connection; unsent data are lost."""
        self._transport.abort()

    def _flush(self) -> None:
        transport = self._transport
        if transport.is_closing() or transport.get_write_buffer_size() > _MAX_UNSENT_BYTES:
            self._drop_queued_frames()
        else:
            data, frames = self._dequeue(_MAX_UNSENT_BYTES)
            transport.write(data)
            self.stats.sent += frames


class _Connection(asyncio.BufferedProtocol):
    def __init__(self, port: TcpPort) -> None:
        self._port = port
        self._loop = asyncio.get_running_loop()
        self._client: TcpClient | None = None
        self._transport: asyncio.Transport | None = None
        self._flood = FloodDetector()
        self._buffer = bytearray(_READ_BYTES)
        self.lost = asyncio.Event()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._client = self._port.accept(transport)
        if self._client is None:
            transport.abort()

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        if self._client is None or self._transport is None:
            return
        frame_count = self._port.receive_frames(self._client, bytes(self._buffer[:nbytes]))
        is_flood = self._flood.count(frame_count, nbytes, self._loop.time())
        if is_flood and not self._transport.is_closing():
            self._transport.pause_reading()
            self._loop.call_later(FloodDetector.WINDOW, self._resume)

    def _resume(self) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()
        if self._client is not None:
            self._port.remove(self._client)
