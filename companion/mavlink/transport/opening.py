"""Opens the transport of an endpoint."""

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
"""A function like `open_transport`, for a parsed endpoint."""


async def open_transport(endpoint: str | Endpoint, receiver: Receiver, lost: Lost) -> Transport:
    """Open the transport that the endpoint describes.

    Args:
        endpoint: A parsed endpoint or its text.
        receiver: Takes all bytes that arrive.
        lost: Called with the reason when an open connection drops: once; for a TCP server, each
            time that its peer drops. Never called for UDP, nor after `close`.

    Raises:
        EndpointError: The transport cannot be opened; the message says why and what to do.
    """
    parsed = parse_endpoint(endpoint) if isinstance(endpoint, str) else endpoint
    match parsed:
        case UdpIn() | UdpOut():
            return await open_udp(parsed, receiver)
        case TcpClient():
            return await open_tcp_client(parsed, receiver, lost)
        case TcpServer():
            return await open_tcp_server(parsed, receiver, lost)
        case SerialPort():
            return SerialTransport(parsed, receiver.receive, lost)
