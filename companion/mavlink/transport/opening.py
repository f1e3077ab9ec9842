"""Opens the transport of an endpoint."""

from collections.abc import Awaitable, Callable

from companion.mavlink.transport.base import LostCallback, Receiver, Transport
from companion.mavlink.transport.endpoint import (
    Endpoint,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
)
from companion.mavlink.transport.serial_port import SerialTransport
from companion.mavlink.transport.tcp import open_tcp_client, open_tcp_server
from companion.mavlink.transport.udp import UdpTransport, udp_address

OpenTransport = Callable[[Endpoint, Receiver, LostCallback], Awaitable[Transport]]
"""A function like `open_transport`."""


async def open_transport(endpoint: Endpoint, receiver: Receiver, lost: LostCallback) -> Transport:
    """Open the transport that the endpoint describes.

    `lost`: called with the reason when an open connection drops; a TCP server calls `lost` each
    time a client disconnects. Never called for UDP, nor after `close`.

    Raises:
        EndpointError: the transport cannot be opened; the message says why and what to do.
    """
    match endpoint:
        case UdpIn() | UdpOut():
            return UdpTransport(endpoint, receiver, *await udp_address(endpoint))
        case TcpClient():
            return await open_tcp_client(endpoint, receiver, lost)
        case TcpServer():
            return await open_tcp_server(endpoint, receiver, lost)
        case SerialPort():
            return SerialTransport(endpoint, receiver.receive, lost)
