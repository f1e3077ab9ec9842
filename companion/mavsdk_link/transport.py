"""MAVSDK as a transport: it holds the connection to the vehicle, frames pass through it whole.

MAVSDK forwards between its connections. One is the vehicle's; the other is of its kind `raw`, which
is this process itself. So the rest of the link sees each frame as the vehicle sent it, with the
vehicle's own time stamp, and MAVSDK's own frames, setpoints included, beside them.
"""

import asyncio
import os
from collections import deque
from collections.abc import Callable
from time import perf_counter_ns

from mavsdk.enums import ForwardingOption
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import log_subscribe
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.system import System

from companion.mavlink.errors import EndpointError
from companion.mavlink.framing import V2
from companion.mavlink.loop import unwatch, watch
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport import Receive
from companion.mavsdk_link.connection_url import connection_url

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
        receive: Called for each frame of others, in the event loop.
        sent: Called for each frame that MAVSDK sent on its own account, in the event loop.

    Raises:
        EndpointError: With the reason.
    """

    reconnects = False

    def __init__(
        self, settings: LinkSettings, receive: Receive, sent: Callable[[bytes], None]
    ) -> None:
        log_subscribe(lambda *_: True)  # it would print to standard output
        component = settings.source_component % 255 + 1
        self._own = bytes((settings.source_system, component))
        self._receive, self._sent = receive, sent
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

    def system(self, number: int) -> System | None:
        """The vehicle of that system id, once MAVSDK knows its autopilot."""
        for system in self._mavsdk.get_systems():
            if system.get_system_id() == number and system.has_autopilot():
                return system
        return None

    def send(self, frame: bytes) -> bool:
        """Have MAVSDK forward one frame to the vehicle."""
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
            if frame[0] == V2 and frame[_SOURCE] == self._own:
                self._sent(frame)
            else:
                self._receive(frame, received_ns)


def _why(endpoint: str, words: str) -> str:
    known = (reason for name, reason in _REASONS.items() if name in words)
    return f"{endpoint} cannot be opened by MAVSDK: {next(known, words)}"
