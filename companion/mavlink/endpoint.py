"""Endpoints in the usual notation, and nothing but the notation."""

import re
from dataclasses import dataclass

from companion.mavlink.errors import EndpointError

_HELP = (
    "write udpin://0.0.0.0:14540, udpout://HOST:PORT, tcp://HOST:PORT, tcpin://0.0.0.0:PORT "
    "or serial:///dev/ttyACM0:921600"
)
_NETWORK = re.compile(r"(\[[0-9a-fA-F:.]+\]|[^:/\[\]]*):(\d+)")
_SERIAL = re.compile(r"(/[^:]+|COM\d+):(\d+)")


@dataclass(frozen=True)
class UdpIn:
    """Listen on a local address; talk to the vehicle that is heard there first."""

    host: str
    port: int


@dataclass(frozen=True)
class UdpOut:
    """Send to a known address and hear only it."""

    host: str
    port: int


@dataclass(frozen=True)
class TcpClient:
    """Connect to a vehicle (or router) that listens."""

    host: str
    port: int


@dataclass(frozen=True)
class TcpServer:
    """Listen for one vehicle that connects to us."""

    host: str
    port: int


@dataclass(frozen=True)
class SerialPort:
    """A UART or USB device at a baud rate."""

    device: str
    baud: int


Endpoint = UdpIn | UdpOut | TcpClient | TcpServer | SerialPort

_NETWORK_KINDS: dict[str, type[UdpIn | UdpOut | TcpClient | TcpServer]] = {
    "udpin": UdpIn,
    "udp": UdpIn,
    "udpout": UdpOut,
    "tcp": TcpClient,
    "tcpout": TcpClient,
    "tcpin": TcpServer,
}


def parse_endpoint(text: str) -> Endpoint:
    """Read an endpoint such as `udpin://0.0.0.0:14540` or `serial:///dev/ttyAMA0:921600`.

    `udp://` is taken as `udpin://`. An empty host of a listening endpoint means every interface.

    Raises:
        EndpointError: The text is not one of the five notations, or its port is not 1..65535
            (a listening endpoint also takes 0: any free port).
    """
    scheme, separator, rest = text.strip().partition("://")
    if separator and scheme == "serial":
        return _serial(text, rest)
    kind = _NETWORK_KINDS.get(scheme)
    if not separator or kind is None:
        raise EndpointError(f"endpoint {text!r} is not understood: {_HELP}")
    found = _NETWORK.fullmatch(rest.rstrip("/"))
    if found is None:
        raise EndpointError(f"endpoint {text!r} needs HOST:PORT after {scheme}://: {_HELP}")
    listens = kind in (UdpIn, TcpServer)
    host, port = found[1].strip("[]") or ("0.0.0.0" if listens else ""), int(found[2])
    if not host:
        raise EndpointError(f"endpoint {text!r} names no host to connect to: {_HELP}")
    if not (0 if listens else 1) <= port <= 65535:
        raise EndpointError(f"endpoint {text!r}: port {port} is outside 1..65535")
    return kind(host, port)


def _serial(text: str, rest: str) -> SerialPort:
    found = _SERIAL.fullmatch(rest)
    if found is None:
        raise EndpointError(f"endpoint {text!r} needs DEVICE:BAUD after serial://: {_HELP}")
    return SerialPort(found[1], int(found[2]))
