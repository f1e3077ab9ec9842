"""Decides which sender is the peer, the one sender that a transport talks to."""

import asyncio
import ipaddress
import socket
from collections.abc import Callable, Sequence
from typing import Any

from companion.mavlink.errors import EndpointError
from companion.mavlink.framing import Frame
from companion.mavlink.messages import dialect
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.endpoint import PeerAddress


async def resolve_peers(peers: Sequence[PeerAddress], kind: socket.SocketKind) -> "NamedPeers":
    """Look up the addresses of the peers that the endpoint names.

    Raises:
        EndpointError: a host name is unknown.
    """
    loop = asyncio.get_running_loop()
    admitted: set[tuple[str, int | None]] = set()
    for peer in peers:
        try:
            addresses = await loop.getaddrinfo(peer.host, None, type=kind)
        except OSError as error:
            raise EndpointError(
                f"the peer {peer.host!r} is unknown ({error.strerror}); check the name or use its "
                "IP address"
            ) from error
        admitted |= {(plain_host(str(info[4][0])), peer.port) for info in addresses}
    return NamedPeers(frozenset(admitted))


class NamedPeers:
    """The senders that may talk to the endpoint; all senders if the endpoint names none.

    Args:
        admitted: IP address and port of each sender; a port of `None` is any port.
    """

    def __init__(self, admitted: frozenset[tuple[str, int | None]] = frozenset()) -> None:
        self._admitted = admitted

    def admits(self, address: Any) -> bool:
        """Whether a sender at this socket address, (host, port, ...), is admitted."""
        if not self._admitted:
            return True
        host, port = plain_host(address[0]), address[1]
        return (host, port) in self._admitted or (host, None) in self._admitted


def plain_host(host: str) -> str:
    """An IP address in its normal form, without zone; IPv4 mapped into IPv6 becomes IPv4.

    A host name is returned unchanged.
    """
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    mapped_ipv4 = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped_ipv4 or address)


def host_and_port(address: Any) -> str:
    """A socket address as HOST:PORT."""
    host = plain_host(str(address[0]))
    return f"[{host}]:{address[1]}" if ":" in host else f"{host}:{address[1]}"


PEER_NOTICE = "link.endpoint: "
"""Beginning of each notice about the peer."""

CLAIM_DURATION_S = 5.0
"""Time without a heartbeat of the peer after which another sender may become the peer, s."""

_TIME_AFTER_SETPOINT_S = 2.0
"""Time after the last setpoint during which only a silent peer is replaced, s."""

HEARTBEAT = 0
# Offsets in a HEARTBEAT payload, and its length; a received payload may lack trailing zeros.
_TYPE_OFFSET, _AUTOPILOT_OFFSET, _FIELD_BYTES = 4, 5, 6


class PeerRule:
    """Decides which sender is the peer.

    A sender becomes the peer by a claim: a HEARTBEAT of the configured system and component that
    comes from an autopilot (not type GCS, not autopilot INVALID). With signing or in lockstep, each
    accepted frame is a claim, and no claim lapses. Otherwise a claim lapses after
    `CLAIM_DURATION_S`, except while setpoints are sent and for 2 s after the last one.

    Args:
        notice: called with a sentence for the user at each change, and by `report_ignored`.
        clock: returns the event-loop time, s.
        last_setpoint: returns the event-loop time of the last setpoint, s; −inf before the first.
        every_frame_claims: whether each accepted frame is a claim: with signing or in lockstep.
    """

    def __init__(
        self,
        stats: LinkStats,
        notice: Callable[[str], None],
        clock: Callable[[], float],
        last_setpoint: Callable[[], float],
        *,
        every_frame_claims: bool,
    ) -> None:
        self._stats, self._notify, self._clock = stats, notice, clock
        self._last_setpoint = last_setpoint
        self._every_frame_claims = every_frame_claims
        self._claimed_at = clock()
        self._peer: str | None = None

    def makes_sender_peer(self, frame: Frame) -> bool:
        """Whether an accepted frame makes its sender the peer."""
        if self._every_frame_claims:
            return True
        if frame.message_id != HEARTBEAT:
            return False
        fields = frame.payload.ljust(_FIELD_BYTES, b"\0")
        return not (
            fields[_AUTOPILOT_OFFSET] == dialect.MAV_AUTOPILOT_INVALID
            or fields[_TYPE_OFFSET] == dialect.MAV_TYPE_GCS
        )

    def renew_claim(self) -> None:
        """Note that the peer has repeated its claim."""
        self._claimed_at = self._clock()

    def may_replace_peer(self) -> bool:
        """Whether another sender may become the peer although the present one still sends."""
        if self._every_frame_claims:
            return False
        now = self._clock()
        if now - self._last_setpoint() < _TIME_AFTER_SETPOINT_S:
            return False
        return now - self._claimed_at > CLAIM_DURATION_S

    def set_peer(self, sender: str) -> None:
        """Make `sender`, given as HOST:PORT, the peer; count a change and report it to the user."""
        old_peer, self._peer = self._peer, sender
        self.renew_claim()
        if old_peer is not None and old_peer != sender:
            self._stats.peers += 1
            self._notify(
                f"{PEER_NOTICE}the vehicle's frames now come from {sender}, before from "
                f"{old_peer}; to prevent this, name the vehicle's address in the endpoint "
                "(?peer=ADDRESS)"
            )

    def report_ignored(self, sender: str) -> None:
        """Tell the user that frames of `sender`, which the endpoint does not name, are ignored."""
        self._notify(
            f"{PEER_NOTICE}frames from {sender} are ignored, as the endpoint names another peer; "
            f"if {sender} is the vehicle, correct ?peer="
        )
