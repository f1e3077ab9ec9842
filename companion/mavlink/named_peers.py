"""The peers that an endpoint names: only from them anything is taken."""

import asyncio
import ipaddress
import socket
from collections.abc import Sequence
from typing import Any

from companion.mavlink.endpoint import PeerAddress
from companion.mavlink.errors import EndpointError


async def resolve(named: Sequence[PeerAddress], kind: socket.SocketKind) -> "NamedPeers":
    """Look the names up.

    Raises:
        EndpointError: A host is unknown.
    """
    loop = asyncio.get_running_loop()
    admitted: set[tuple[str, int | None]] = set()
    for peer in named:
        try:
            found = await loop.getaddrinfo(peer.host, None, type=kind)
        except OSError as error:
            raise EndpointError(
                f"the peer {peer.host!r} is unknown ({error.strerror}); check the name or use its "
                "IP address"
            ) from error
        admitted |= {(plain_host(str(info[4][0])), peer.port) for info in found}
    return NamedPeers(frozenset(admitted))


class NamedPeers:
    """Whom the endpoint lets in; everybody if it names nobody.

    Args:
        admitted: IP address and port; port `None` is any.
    """

    def __init__(self, admitted: frozenset[tuple[str, int | None]] = frozenset()) -> None:
        self._admitted = admitted

    def admit(self, address: Any) -> bool:
        """Whether bytes from a socket address, (host, port, ...), are taken."""
        if not self._admitted:
            return True
        host, port = plain_host(address[0]), address[1]
        return (host, port) in self._admitted or (host, None) in self._admitted


def plain_host(host: str) -> str:
    """An IP address in one spelling; what IPv6 says of an IPv4 host as IPv4."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)


def spelled(address: Any) -> str:
    """A socket address as HOST:PORT."""
    host = plain_host(str(address[0]))
    return f"[{host}]:{address[1]}" if ":" in host else f"{host}:{address[1]}"
