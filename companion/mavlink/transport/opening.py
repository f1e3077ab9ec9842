"""From an endpoint's notation to an open transport."""

from collections.abc import Awaitable, Callable

from companion.mavlink.transport.base import Lost, Receiver, Transport
from companion.mavlink.transport.endpoint import (
    Endpoint,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)
from companion.mavlink.transport.serial_port import SerialTransport
from companion.mavlink.transport.tcp import open_tcp_client, open_tcp_server
from companion.mavlink.transport.udp import open_udp

OpenTransport = Callable[[Endpoint, Receiver, Lost], Awaitable[Transport]]
"""As `open_transport`, for a parsed endpoint."""


async def open_transport(endpoint: str | Endpoint, receiver: Receiver, lost: Lost) -> Transport:
    """Open what the endpoint describes.

    Args:
        endpoint: A parsed endpoint or its notation.
        receiver: Takes all bytes that arrive.
        lost: Called once if an open connection drops; never for UDP, nor after `close`.

    Raises:
        EndpointError: With the reason and how to mend it.
    """
    where = parse_endpoint(endpoint) if isinstance(endpoint, str) else endpoint
    match where:
        case UdpIn() | UdpOut():
            return await open_udp(where, receiver)
        case TcpClient():
            return await open_tcp_client(where, receiver, lost)
        case TcpServer():
            return await open_tcp_server(where, receiver, lost)
        case SerialPort():
            return SerialTransport(where, receiver.receive, lost)
