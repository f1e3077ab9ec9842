"""MAVSDK as a transport: it holds the connection to the vehicle, frames pass through it whole.

MAVSDK forwards between its connections. One is the vehicle's; the other is of its kind `raw`, which
is this process itself. So each side sees each frame as the other sent it, time stamp included.

MAVSDK hands what we send to a thread of its own; it reaches the kernel 0.1 ms later. MAVSDK does
not say whether the frame left, and it queues what a serial line or a TCP connection does not take.
"""

import asyncio
import os
from collections import deque
from time import perf_counter_ns

from mavsdk.enums import ForwardingOption
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import log_subscribe
from mavsdk.mavsdk import Configuration, Mavsdk

from companion.mavlink.errors import EndpointError
from companion.mavlink.framing import V2
from companion.mavlink.loop import unwatch, watch
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.base import Receive
from companion.mavlink.transport.endpoint import (
    Endpoint,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)


def connection_url(endpoint: str) -> str:
    """What `Mavsdk.add_any_connection` takes for one of our endpoints.

    Raises:
        EndpointError: With the reason and how to mend it.
    """
    where = parse_endpoint(endpoint)
    if isinstance(where, UdpIn | TcpServer) and where.peers:
        raise EndpointError(
            f"endpoint {endpoint!r}: MAVSDK hears every sender; leave ?peer= out, or use "
            "link.backend: direct"
        )
    return f"{_scheme(where)}://{_address(where)}"


def _scheme(where: Endpoint) -> str:
    match where:
        case UdpIn():
            return "udpin"
        case UdpOut():
            return "udpout"
        case TcpClient():
            return "tcpout"
        case TcpServer():
            return "tcpin"
        case SerialPort():
            return "serial"


def _address(where: Endpoint) -> str:
    if isinstance(where, SerialPort):
        return f"{where.device}:{where.baud}"
    return f"{where.host}:{where.port}"


_MOST_WAITING = 1000
"""Frames kept for an event loop that does not come to read them; then the oldest are lost."""
_SOURCE = slice(5, 7)  # system and component of a MAVLink 2 frame
_REASONS = {
    "BIND_ERROR": "the port is in use by another program, or the address is not this computer's",
    "DESTINATION_IP_UNKNOWN": "the host is unknown; use its IP address",
    "CONNECTION_ERROR": "check that the device is there and that you may use it",
}


class MavsdkTransport:
    """A running MAVSDK. It opens a dropped TCP connection or serial port again by itself.

    Args:
        settings: Where the vehicle is and who we are. MAVSDK itself is the component above ours:
            what is addressed to it alone, it would not forward.
        receive: Called in the event loop for each frame but those of MAVSDK's own.
        speaks_first: Whether a frame can leave before one was heard; over UDP in, where to is not
            known before.

    Raises:
        EndpointError: With the reason.
    """

    reconnects = False

    def __init__(self, settings: LinkSettings, receive: Receive, *, speaks_first: bool) -> None:
        log_subscribe(lambda *_: True)  # it would print to standard output
        component = settings.source_component % 255 + 1
        self._own = bytes((settings.source_system, component))
        self._receive = receive
        self._has_peer = speaks_first
        self._waiting: deque[tuple[bytes, int]] = deque(maxlen=_MOST_WAITING)
        self._loop = asyncio.get_running_loop()
        self._bell = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._mavsdk = Mavsdk(Configuration.create_manual(settings.source_system, component, True))
        try:
            self._connect("raw://")
            self._mavsdk.subscribe_raw_bytes_to_be_sent(self._on_frame)
            self._connect(connection_url(settings.endpoint))
        except MavsdkError as error:
            self._mavsdk.destroy()
            os.close(self._bell)
            raise EndpointError(_why(settings.endpoint, str(error))) from error
        watch(self._loop, self._bell, self._read)

    def send(self, frame: bytes) -> bool:
        """Have MAVSDK forward one frame to the vehicle, once; false if there is no peer yet."""
        if not self._has_peer:
            return False
        self._mavsdk.pass_received_raw_bytes(frame)
        return True

    def close(self) -> None:
        """End MAVSDK, with all its threads."""
        unwatch(self._loop, self._bell)
        self._mavsdk.destroy()
        os.close(self._bell)

    def _connect(self, url: str) -> None:
        self._mavsdk.add_any_connection_with_handle_and_forwarding(url, ForwardingOption.ON)

    def _on_frame(self, frame: bytes) -> None:
        """In MAVSDK's thread: only hand over."""
        self._waiting.append((frame, perf_counter_ns()))
        os.eventfd_write(self._bell, 1)

    def _read(self) -> None:
        os.eventfd_read(self._bell)
        while self._waiting:
            frame, received_ns = self._waiting.popleft()
            if frame[0] != V2 or frame[_SOURCE] != self._own:
                self._has_peer = True
                self._receive(frame, received_ns)


def _why(endpoint: str, words: str) -> str:
    known = (reason for name, reason in _REASONS.items() if name in words)
    return f"{endpoint} cannot be opened by MAVSDK: {next(known, words)}"
