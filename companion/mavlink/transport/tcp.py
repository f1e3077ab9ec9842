"""MAVLink over TCP, as client or as a server for one vehicle."""

import asyncio
import errno
import socket
import time

from companion.mavlink.errors import EndpointError
from companion.mavlink.peer import CLAIM_LASTS_S, NamedPeers, resolve, spelled
from companion.mavlink.transport.base import OPEN_TIMEOUT_S, Lost, Receiver
from companion.mavlink.transport.endpoint import TcpClient, TcpServer

_MAX_UNSENT_BYTES = 2048  # some 40 setpoints; a vehicle that far behind must not get older ones


async def open_tcp_client(endpoint: TcpClient, receiver: Receiver, lost: Lost) -> "TcpTransport":
    """Connect to a listening vehicle.

    Raises:
        EndpointError: Nobody listens there, host unknown, no answer within 5 s.
    """
    transport = TcpTransport(receiver, lost)
    where = f"TCP {endpoint.host}:{endpoint.port}"
    try:
        async with asyncio.timeout(OPEN_TIMEOUT_S):
            await asyncio.get_running_loop().create_connection(
                lambda: _Connection(transport), endpoint.host, endpoint.port
            )
    except TimeoutError as error:
        raise EndpointError(
            f"{where}: no answer within {OPEN_TIMEOUT_S:g} s; check address and network"
        ) from error
    except socket.gaierror as error:
        raise EndpointError(
            f"{where}: host unknown ({error.strerror}); check the name or use its IP address"
        ) from error
    except OSError as error:
        raise EndpointError(
            f"{where}: cannot connect ({error.strerror or error}); is the vehicle or router "
            "running and listening there?"
        ) from error
    return transport


async def open_tcp_server(endpoint: TcpServer, receiver: Receiver, lost: Lost) -> "TcpTransport":
    """Listen for one vehicle.

    Raises:
        EndpointError: The port is in use or not permitted.
    """
    named = await resolve(endpoint.peers, socket.SOCK_STREAM)
    transport = TcpTransport(receiver, lost, named)
    where = f"TCP {endpoint.host}:{endpoint.port}"
    try:
        server = await asyncio.get_running_loop().create_server(
            lambda: _Connection(transport), endpoint.host, endpoint.port
        )
    except OSError as error:
        hint = {
            errno.EADDRINUSE: "the port is in use by another program; end it or choose another",
            errno.EACCES: "not permitted; use a port of 1024 or above",
            errno.EADDRNOTAVAIL: "no interface of this computer has that address; use 0.0.0.0",
        }.get(error.errno or 0, error.strerror or str(error))
        raise EndpointError(f"{where}: {hint}") from error
    transport.listen(server)
    return transport


class TcpTransport:
    """At most one TCP connection at a time.

    As a server it goes on listening when the vehicle drops, so it is never opened again from
    outside. A client that connects meanwhile is turned away, unless the one before it made no
    valid claim (`PeerRule`) within 5 s of connecting, or its claim has lapsed.

    Attributes:
        local: (host, port) listened on, or `None` for a client.
    """

    def __init__(self, receiver: Receiver, lost: Lost, named: NamedPeers | None = None) -> None:
        self._receiver, self._lost = receiver, lost
        self._named = named or NamedPeers()
        self._loop = asyncio.get_running_loop()
        self._server: asyncio.Server | None = None
        self._connection: asyncio.Transport | None = None
        self._connected_at = 0.0
        self._claimed = False
        self._closed = False
        self.local: tuple[str, int] | None = None

    @property
    def reconnects(self) -> bool:
        """A server waits by itself, a client must be opened again."""
        return self._server is None

    def listen(self, server: asyncio.Server) -> None:
        """Make this a server."""
        self._server = server
        self.local = server.sockets[0].getsockname()[:2]

    def accept(self, connection: asyncio.Transport) -> bool:
        """Take a new connection; false if it is not to be let in."""
        if self._closed:
            return False
        address = connection.get_extra_info("peername")
        if self._server is not None and not self._named.admit(address):
            self._receiver.stranger(spelled(address))
            return False
        if self._connection is not None:
            if not self._replaceable():
                return False
            before = self._connection
            self.dropped(before, "another client took the place of one without a valid heartbeat")
            before.abort()
        opened = connection.get_extra_info("socket")
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection, self._connected_at = connection, self._loop.time()
        self._claimed = False
        return True

    def _replaceable(self) -> bool:
        if self._claimed:
            return self._receiver.claim_lapsed()
        return self._loop.time() - self._connected_at > CLAIM_LASTS_S

    def data(self, connection: asyncio.Transport, data: bytes) -> None:
        """Pass on what arrived."""
        if connection is not self._connection:
            return  # replaced, and not closed yet
        received = time.perf_counter_ns()
        if self._claimed or self._server is None:
            self._receiver.receive(data, received)
        else:
            who = spelled(connection.get_extra_info("peername"))
            self._claimed = self._receiver.claim(data, received, who)

    def dropped(self, connection: asyncio.Transport | None, reason: str) -> None:
        """The connection is gone."""
        if self._connection is None or connection is not self._connection:
            return
        self._connection = None
        if self._closed:
            return
        if self._server is not None and not self._claimed:
            self._receiver.connect(streaming=True)  # it was no peer, so nothing is lost
            return
        self._lost(reason)

    def send(self, frame: bytes) -> bool:
        """Write one frame; false while nobody is connected or too much is unsent already."""
        connection = self._connection
        if connection is None or connection.is_closing():
            return False
        if connection.get_write_buffer_size() > _MAX_UNSENT_BYTES:
            return False
        connection.write(frame)
        return True

    def close(self) -> None:
        """Abort: what was not written yet never will be."""
        self._closed = True
        if self._server is not None:
            self._server.close()
        if self._connection is not None:
            self._connection.abort()


class _Connection(asyncio.Protocol):
    def __init__(self, owner: TcpTransport) -> None:
        self._owner = owner
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        if self._owner.accept(transport):
            self._transport = transport
        else:
            transport.abort()

    def data_received(self, data: bytes) -> None:
        if self._transport is not None:
            self._owner.data(self._transport, data)

    def connection_lost(self, exc: Exception | None) -> None:
        reason = f"connection broken: {exc}" if exc else "closed by the other side"
        self._owner.dropped(self._transport, reason)
