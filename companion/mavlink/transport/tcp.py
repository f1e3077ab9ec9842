"""MAVLink over TCP, as client or as a server for one vehicle."""

import asyncio
import socket
import time

from companion.mavlink.errors import EndpointError
from companion.mavlink.peer import CLAIM_DURATION_S, NamedPeers, host_and_port, resolve_peers
from companion.mavlink.transport.base import OPEN_TIMEOUT_S, LostCallback, Receiver, why_not_opened
from companion.mavlink.transport.endpoint import TcpClient, TcpServer

_MAX_UNSENT_BYTES = 2048
"""Unsent bytes (about 40 setpoints) above which frames are dropped, because they would be late."""


async def open_tcp_client(
    endpoint: TcpClient, receiver: Receiver, lost: LostCallback
) -> "TcpTransport":
    """Connect to a listening vehicle.

    Raises:
        EndpointError: nobody listens there, the host is unknown, or no answer came within 5 s.
    """
    transport = TcpTransport(receiver, lost)
    endpoint_text = f"TCP {endpoint.host}:{endpoint.port}"
    try:
        async with asyncio.timeout(OPEN_TIMEOUT_S):
            await asyncio.get_running_loop().create_connection(
                lambda: _Connection(transport), endpoint.host, endpoint.port
            )
    except TimeoutError as error:
        raise EndpointError(
            f"{endpoint_text}: no answer within {OPEN_TIMEOUT_S:g} s; check address and network"
        ) from error
    except socket.gaierror as error:
        raise EndpointError(
            f"{endpoint_text}: host unknown ({error.strerror}); check the name or use its IP "
            "address"
        ) from error
    except OSError as error:
        raise EndpointError(
            f"{endpoint_text}: cannot connect ({error.strerror or error}); is the vehicle or "
            "router running and listening there?"
        ) from error
    return transport


async def open_tcp_server(
    endpoint: TcpServer, receiver: Receiver, lost: LostCallback
) -> "TcpTransport":
    """Listen for one vehicle.

    Raises:
        EndpointError: the port is in use or not permitted, the address is not that of an interface
            of this computer, or a peer's host name is unknown.
    """
    named_peers = await resolve_peers(endpoint.peers, socket.SOCK_STREAM)
    transport = TcpTransport(receiver, lost, named_peers)
    endpoint_text = f"TCP {endpoint.host}:{endpoint.port}"
    try:
        server = await asyncio.get_running_loop().create_server(
            lambda: _Connection(transport), endpoint.host, endpoint.port
        )
    except OSError as error:
        raise EndpointError(f"{endpoint_text}: {why_not_opened(error)}") from error
    transport.listen(server)
    return transport


class TcpTransport:
    """A TCP client or server with at most one connection at a time.

    A server goes on listening when the vehicle's connection drops, so the link need not open the
    server again. While a client is connected, a second client is refused. The second replaces the
    first only if the first has not proved within 5 s to be the vehicle, or has become silent since
    (`PeerRule`).

    Attributes:
        local: (host, port) of a listening server; `None` for a client.
    """

    def __init__(
        self, receiver: Receiver, lost: LostCallback, named_peers: NamedPeers | None = None
    ) -> None:
        self._receiver, self._lost = receiver, lost
        self._named_peers = named_peers or NamedPeers()
        self._loop = asyncio.get_running_loop()
        self._server: asyncio.Server | None = None
        self._connection: asyncio.Transport | None = None
        self._connected_at = 0.0
        self._has_peer = False
        self._closed = False
        self.local: tuple[str, int] | None = None

    @property
    def reconnects(self) -> bool:
        """Whether the link must open a new connection: True for a client, False for a server."""
        return self._server is None

    def listen(self, server: asyncio.Server) -> None:
        """Use `server`, which listens for the vehicle, with this transport."""
        self._server = server
        self.local = server.sockets[0].getsockname()[:2]

    def accept(self, connection: asyncio.Transport) -> bool:
        """Take a new connection; return False if it must be refused."""
        if self._closed:
            return False
        address = connection.get_extra_info("peername")
        if self._server is not None and not self._named_peers.admits(address):
            self._receiver.report_ignored(host_and_port(address))
            return False
        if self._connection is not None:
            if not self._may_be_replaced():
                return False
            old_connection = self._connection
            self.connection_dropped(
                old_connection,
                "this client sends no valid heartbeat, and another client replaced it",
            )
            old_connection.abort()
        sock = connection.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection, self._connected_at = connection, self._loop.time()
        self._has_peer = False
        return True

    def _may_be_replaced(self) -> bool:
        if self._has_peer:
            return self._receiver.may_replace_peer()
        return self._loop.time() - self._connected_at > CLAIM_DURATION_S

    def take_data(self, connection: asyncio.Transport, data: bytes) -> None:
        """Pass on the bytes that a connection received."""
        if connection is not self._connection:
            return  # from a connection that was replaced and is not closed yet
        received = time.perf_counter_ns()
        if self._has_peer or self._server is None:
            self._receiver.receive(data, received)
        else:
            sender = host_and_port(connection.get_extra_info("peername"))
            self._has_peer = self._receiver.claim(data, received, sender)

    def connection_dropped(self, connection: asyncio.Transport | None, reason: str) -> None:
        """Note that a connection is closed, for `reason`."""
        if self._connection is None or connection is not self._connection:
            return
        self._connection = None
        if self._closed:
            return
        if self._server is not None and not self._has_peer:
            self._receiver.start_connection(streaming=True)  # not the peer, so the link is not lost
            return
        self._lost(reason)

    def send(self, frame: bytes) -> bool:
        """Write one frame; return False if nobody is connected or too many bytes are unsent."""
        connection = self._connection
        if connection is None or connection.is_closing():
            return False
        if connection.get_write_buffer_size() > _MAX_UNSENT_BYTES:
            return False
        connection.write(frame)
        return True

    def close(self) -> None:
        """Close at once; unsent bytes are discarded."""
        self._closed = True
        if self._server is not None:
            self._server.close()
        if self._connection is not None:
            self._connection.abort()


class _Connection(asyncio.Protocol):
    def __init__(self, tcp_transport: TcpTransport) -> None:
        self._tcp_transport = tcp_transport
        self._connection: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        if self._tcp_transport.accept(transport):
            self._connection = transport
        else:
            transport.abort()

    def data_received(self, data: bytes) -> None:
        if self._connection is not None:
            self._tcp_transport.take_data(self._connection, data)

    def connection_lost(self, exc: Exception | None) -> None:
        reason = f"connection broken: {exc}" if exc else "closed by the other side"
        self._tcp_transport.connection_dropped(self._connection, reason)
