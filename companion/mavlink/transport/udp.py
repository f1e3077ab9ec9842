"""MAVLink over UDP: one non-blocking socket, read by a hot reader of the event loop."""

import asyncio
import contextlib
import logging
import socket
import struct
import time
from typing import Any

from companion.mavlink.errors import EndpointError
from companion.mavlink.loop import unwatch, watch
from companion.mavlink.peer import NamedPeers, host_and_port, resolve_peers
from companion.mavlink.transport.base import Receiver, why_not_opened
from companion.mavlink.transport.endpoint import UdpIn, UdpOut

_LOG = logging.getLogger(__name__)

_MAX_DATAGRAM = 4096  # far above the largest MAVLink frame (280); routers pack several into one
_SO_TIMESTAMPNS = getattr(socket, "SO_TIMESTAMPNS", 35)  # Linux; the module names it from 3.13 on
_STAMP_LAYOUT = struct.Struct("@qq")  # s and ns since 1970
_STAMP_SPACE = socket.CMSG_SPACE(_STAMP_LAYOUT.size)
_MAX_STAMP_AGE_NS = 1_000_000_000  # an older stamp means that the computer's clock was changed
_MAX_READS_AT_ONCE = 32  # datagrams read before the loop does other work

PEER_SILENCE_S = 2.0
"""Period of the checks whether the peer is silent, s. If nothing was received since the last check,
a sender at another address may become the peer."""


async def udp_address(endpoint: UdpIn | UdpOut) -> tuple[socket.AddressFamily, Any, NamedPeers]:
    """Look up the host of an endpoint, and the peers that it names.

    Returns:
        The address family, the socket address to bind or to send to, and the named peers.

    Raises:
        EndpointError: a host name is unknown.
    """
    loop, kind = asyncio.get_running_loop(), socket.SOCK_DGRAM
    try:
        addresses = await loop.getaddrinfo(endpoint.host, endpoint.port, type=kind)
    except OSError as error:
        raise EndpointError(
            f"host {endpoint.host!r} is unknown ({error.strerror}); check the name or use its "
            "IP address"
        ) from error
    family, _, _, _, address = addresses[0]
    named_peers = await resolve_peers(endpoint.peers if isinstance(endpoint, UdpIn) else (), kind)
    return family, address, named_peers


class UdpTransport:
    """A socket that talks to one peer.

    A listening socket connects to the first sender that makes a valid claim (`PeerRule`). The
    kernel then drops datagrams of other senders, and a round trip is about 8 us shorter than over a
    socket that is not connected. The kernel's queue may still hold earlier datagrams of other
    senders, so the source of each datagram is checked.

    If the peer of a listening socket is silent for 2 to 4 s, or its claim has lapsed, a new socket
    is opened, so that a vehicle that returns at another port is heard. ICMP refusals (the vehicle
    has not started yet) are ignored.

    A datagram counts as received when the kernel received it, not when this process read it. So
    latency includes a late wake-up of this process.

    Attributes:
        local: (host, port) to which the socket is bound.

    Raises:
        EndpointError: the port is in use, the address is not that of an interface of this computer,
            or there is no permission.
    """

    reconnects = False

    def __init__(
        self,
        endpoint: UdpIn | UdpOut,
        receiver: Receiver,
        family: socket.AddressFamily,
        address: Any,
        named_peers: NamedPeers,
    ) -> None:
        self._endpoint, self._receiver = endpoint, receiver
        self._family, self._address, self._named_peers = family, address, named_peers
        self._loop = asyncio.get_running_loop()
        self._heard_in_period = False
        self._connected = False
        self._peer: Any = None
        self._socket = self._open()
        bound_address = self._socket.getsockname()
        self.local: tuple[str, int] = bound_address[:2]
        if isinstance(endpoint, UdpIn):
            self._address = bound_address  # a new socket takes the port that the kernel chose
        self._timer = self._loop.call_later(PEER_SILENCE_S, self._check_peer)

    def _open(self) -> socket.socket:
        sock = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            sock.setblocking(False)
            with contextlib.suppress(OSError):  # without stamps, the time of reading is used
                sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            if isinstance(self._endpoint, UdpIn):
                sock.bind(self._address)
            else:
                sock.connect(self._address)
        except OSError as error:
            sock.close()
            endpoint_text = f"UDP {self._endpoint.host}:{self._endpoint.port}"
            raise EndpointError(f"{endpoint_text}: {why_not_opened(error)}") from error
        self._connected = isinstance(self._endpoint, UdpOut)
        if self._connected:
            self._peer = sock.getpeername()
        watch(self._loop, sock.fileno(), self._read)
        return sock

    def _read(self) -> None:
        if not self._connected:
            self._read_unconnected()
            return
        receive, read, peer = self._receiver.receive, self._socket.recvmsg, self._peer
        try:
            for _ in range(_MAX_READS_AT_ONCE):
                data, stamps, _, address = read(_MAX_DATAGRAM, _STAMP_SPACE)
                if address == peer and receive(data, _arrival_ns(stamps)):
                    self._heard_in_period = True
        except OSError:
            return  # nothing left to read, or an ICMP refusal of something sent before

    def _read_unconnected(self) -> None:
        try:
            data, stamps, _, address = self._socket.recvmsg(_MAX_DATAGRAM, _STAMP_SPACE)
            if self._take_unconnected(data, _arrival_ns(stamps), address):
                self._socket.connect(address)
                self._peer = self._socket.getpeername()
                self._connected = self._heard_in_period = True
        except OSError:
            return

    def _take_unconnected(self, data: bytes, received_ns: int, address: Any) -> bool:
        """Take a datagram of an unconnected socket; return whether its sender becomes the peer.

        The sender becomes the peer if `PeerRule` accepts a frame of the datagram. It also becomes
        the peer if only its answer to a TIMESYNC request can show that its signing time stamps
        are right (`Receiver.needs_timesync_with`).
        """
        sender = host_and_port(address)
        if not self._named_peers.admits(address):
            self._receiver.report_ignored(sender)
            return False
        if address == self._peer and not self._receiver.may_replace_peer():
            accepted = self._receiver.receive(data, received_ns)  # the peer was only silent
        else:
            accepted = self._receiver.claim(data, received_ns, sender)
        return accepted or self._receiver.needs_timesync_with(sender)

    def _check_peer(self) -> None:
        self._timer = self._loop.call_later(PEER_SILENCE_S, self._check_peer)
        is_silent, self._heard_in_period = not self._heard_in_period, False
        if not self._connected or isinstance(self._endpoint, UdpOut):
            return
        if is_silent or self._receiver.may_replace_peer():
            # Python cannot disconnect a UDP socket, so a new one is bound.
            self._release()
            try:
                self._socket = self._open()
            except EndpointError as error:  # another program took the port in between: try again
                _LOG.warning("%s", error)

    def _release(self) -> None:
        if self._socket.fileno() >= 0:
            unwatch(self._loop, self._socket.fileno())
            self._socket.close()

    def send(self, frame: bytes) -> bool:
        """Send one datagram now; return False without a peer, or if the kernel refuses it."""
        if not self._connected:
            return False
        try:
            self._socket.send(frame)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close the socket."""
        self._timer.cancel()
        self._release()


def _arrival_ns(stamps: list[tuple[int, int, bytes]]) -> int:
    """Arrival of a datagram in the kernel, as a `perf_counter_ns`; the present time if unknown."""
    now = time.perf_counter_ns()
    if not stamps:
        return now
    seconds, nanoseconds = _STAMP_LAYOUT.unpack(stamps[0][2])
    age = time.time_ns() - (seconds * 1_000_000_000 + nanoseconds)
    return now - age if 0 <= age < _MAX_STAMP_AGE_NS else now
