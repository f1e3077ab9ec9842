"""The link through MAVSDK (`link.backend: mavsdk`), which holds the connection to the vehicle.

Needs the extra `mavsdk`. MAVSDK forwards frames unchanged between its two connections: one to the
vehicle, and one of its type `raw` to this process. Vehicle and process receive each frame exactly
as it was sent, with its time stamp.

MAVSDK sends from a thread of its own, so a frame reaches the kernel 0.1 ms later than if this
program sends it. MAVSDK does not report whether a frame was sent, and queues frames that a serial
port or TCP connection cannot take.

Setpoints are not sent by MAVSDK's offboard plugin. The plugin repeats the last setpoint 20 times a
second, in its own thread, until it is told to stop, which can be too late. Measured: a process was
stopped in flight and resumed, and the plugin sent old body rates before any other thread ran. PX4
was landing in its failsafe, took these rates as a request for offboard mode, and obeyed them. So
this program sends each setpoint itself: one frame, once, in answer to a fresh sample.
"""

import asyncio
import logging
import os
from collections import deque
from time import perf_counter_ns

from mavsdk.enums import ForwardingOption
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import log_subscribe
from mavsdk.mavsdk import Configuration, Mavsdk

from companion.mavlink.errors import EndpointError, LinkError
from companion.mavlink.frame_filter import Notice
from companion.mavlink.framing import V2_MAGIC
from companion.mavlink.loop import unwatch, watch
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.base import (
    LostCallback,
    ReceiveCallback,
    Receiver,
    Tap,
    Transport,
)
from companion.mavlink.transport.endpoint import (
    Endpoint,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)
from companion.vehicle.link import Link

_LOG = logging.getLogger(__name__)

_SCHEMES: dict[type[Endpoint], str] = {
    UdpIn: "udpin",
    UdpOut: "udpout",
    TcpClient: "tcpout",
    TcpServer: "tcpin",
    SerialPort: "serial",
}


def connection_url(endpoint: str) -> str:
    """Convert an endpoint to the URL that `Mavsdk.add_any_connection` takes.

    Raises:
        EndpointError: the endpoint cannot be parsed, or MAVSDK cannot do what it demands.
    """
    parsed_endpoint = parse_endpoint(endpoint)
    if isinstance(parsed_endpoint, UdpIn | TcpServer) and parsed_endpoint.peers:
        raise EndpointError(
            f"endpoint {endpoint!r}: MAVSDK accepts every sender; remove ?peer=, or use "
            "link.backend: direct"
        )
    scheme = _SCHEMES[type(parsed_endpoint)]
    if isinstance(parsed_endpoint, SerialPort):
        return f"{scheme}://{parsed_endpoint.device}:{parsed_endpoint.baud}"
    return f"{scheme}://{parsed_endpoint.host}:{parsed_endpoint.port}"


_MOST_WAITING_FRAMES = 1000
"""Largest number of frames that wait for the event loop; if more wait, the oldest are dropped."""
_SOURCE_BYTES = slice(5, 7)  # system and component of a MAVLink 2 frame
_OPEN_ERROR_TEXTS = {
    "BIND_ERROR": "the port is in use by another program, or the address is not this computer's",
    "DESTINATION_IP_UNKNOWN": "the host is unknown; use its IP address",
    "CONNECTION_ERROR": "check that the device is there and that you may use it",
}


class MavsdkTransport:
    """A running MAVSDK. It opens a dropped TCP connection or serial port again by itself.

    Args:
        settings: the endpoint and ids. MAVSDK itself uses the component id after
            `source_component`, because it does not forward frames that are addressed to itself.
        receive: called in the event loop for each frame except MAVSDK's own.

    Raises:
        EndpointError: the endpoint cannot be parsed, or MAVSDK cannot open it; the message says
            why.
    """

    reconnects = False

    def __init__(self, settings: LinkSettings, receive: ReceiveCallback) -> None:
        url = connection_url(settings.endpoint)
        log_subscribe(lambda *_: True)  # otherwise MAVSDK logs to standard output
        component = settings.source_component % 255 + 1
        self._mavsdk_source = bytes((settings.source_system, component))
        self._receive = receive
        # A listening UDP port knows no address to send to before it has received a frame.
        self._has_peer = not url.startswith(_SCHEMES[UdpIn])
        self._is_open = True
        self._waiting_frames: deque[tuple[bytes, int]] = deque(maxlen=_MOST_WAITING_FRAMES)
        self._loop = asyncio.get_running_loop()
        self._wakeup = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._mavsdk = Mavsdk(Configuration.create_manual(settings.source_system, component, True))
        try:
            self._connect("raw://")
            self._mavsdk.subscribe_raw_bytes_to_be_sent(self._on_frame)
            self._connect(url)
        except MavsdkError as error:
            self._mavsdk.destroy()
            os.close(self._wakeup)
            raise EndpointError(_open_error(settings.endpoint, str(error))) from error
        watch(self._loop, self._wakeup, self._read)

    def send(self, frame: bytes) -> bool:
        """Have MAVSDK forward one frame, once.

        Returns:
            False if the vehicle was not heard yet, or after `close`. A frame passed to MAVSDK's
            library after `close` would end this process by a segmentation fault.
        """
        if not (self._has_peer and self._is_open):
            return False
        self._mavsdk.pass_received_raw_bytes(frame)
        return True

    def close(self) -> None:
        """Stop MAVSDK with all its threads; a second call does nothing."""
        if not self._is_open:
            return
        self._is_open = False
        unwatch(self._loop, self._wakeup)
        self._mavsdk.destroy()
        os.close(self._wakeup)

    def _connect(self, url: str) -> None:
        self._mavsdk.add_any_connection_with_handle_and_forwarding(url, ForwardingOption.ON)

    def _on_frame(self, frame: bytes) -> None:
        """Pass a frame to the event loop; called in MAVSDK's thread."""
        self._waiting_frames.append((frame, perf_counter_ns()))
        os.eventfd_write(self._wakeup, 1)

    def _read(self) -> None:
        os.eventfd_read(self._wakeup)
        while self._waiting_frames:
            frame, received_ns = self._waiting_frames.popleft()
            if frame[0] != V2_MAGIC or frame[_SOURCE_BYTES] != self._mavsdk_source:
                self._has_peer = True
                self._receive(frame, received_ns)


def _open_error(endpoint: str, message: str) -> str:
    reasons = (reason for name, reason in _OPEN_ERROR_TEXTS.items() if name in message)
    return f"{endpoint} cannot be opened by MAVSDK: {next(reasons, message)}"


class MavsdkLink(Link):
    """A `Link` whose connection MAVSDK holds.

    MAVSDK forwards all frames unchanged, so samples carry the vehicle's time stamps, which MAVSDK's
    own telemetry does not give. The vehicle's answers to MAVSDK's own requests do not arrive here,
    and count as lost in `stats`.

    Args:
        settings: the endpoint, and the ids of the vehicle and of this program.
        tap: called with every frame accepted from and sent to the vehicle.
        notice: called once with each notice about the peer; by default it logs a warning.

    Raises:
        EndpointError: the endpoint cannot be parsed.
        LinkError: the settings demand lockstep or signing, which MAVSDK cannot do.
    """

    def __init__(
        self, settings: LinkSettings, tap: Tap | None = None, notice: Notice = _LOG.warning
    ) -> None:
        if settings.lockstep or settings.signing is not None:
            raise LinkError("MAVSDK can neither fly in lockstep nor sign; use link.backend: direct")

        async def opener(_endpoint: Endpoint, receiver: Receiver, _lost: LostCallback) -> Transport:
            return MavsdkTransport(settings, receiver.receive)

        super().__init__(settings, tap, opener, notice)
