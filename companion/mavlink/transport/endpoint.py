"""Parses endpoints in the usual notation, such as `udpin://0.0.0.0:14540`."""

import re
from dataclasses import dataclass

from companion.mavlink.errors import EndpointError

_HELP = (
    "write udpin://0.0.0.0:14540, udpout://HOST:PORT, tcp://HOST:PORT, tcpin://0.0.0.0:PORT "
    "or serial:///dev/ttyACM0:921600"
)
_PEER_PATTERN = re.compile(r"(\[[0-9a-fA-F:.]+\]|[^:/\[\]]+)(?::(\d{1,5}))?")
_NETWORK_PATTERN = re.compile(r"(\[[0-9a-fA-F:.]+\]|[^:/\[\]]*):(\d{1,5})")
_SERIAL_PATTERN = re.compile(r"(/[^:]+|COM\d+):(\d{1,8})")
_DEVICE_PATTERN = re.compile(r"(?:serial:/*)?(/?dev/[^:,]+|tty[^:,/]+|COM\d+)(?:[:,](\d{1,8}))?")
"""A serial device and its baud rate, in the notations of other programs."""
_ADDRESS_PATTERN = re.compile(r"(?:(\w+):/*)?([^:/\[\]]*|\[[0-9a-fA-F:.]+\]):(\d{1,5})/?")
"""An address in the notations of other programs: pymavlink's, or without a scheme."""
_LISTENING_HOSTS = ("", "0.0.0.0", "127.0.0.1", "localhost", "::", "::1")
"""Hosts for which `udp://` can only mean listening."""


@dataclass(frozen=True)
class PeerAddress:
    """A host that may talk to a listening endpoint; a port of `None` is any port."""

    host: str
    port: int | None = None


@dataclass(frozen=True)
class UdpIn:
    """Listen on a local address; talk to the first vehicle heard there, among `peers` if given."""

    host: str
    port: int
    peers: tuple[PeerAddress, ...] = ()


@dataclass(frozen=True)
class UdpOut:
    """Send to a known address, and receive only from this address."""

    host: str
    port: int


@dataclass(frozen=True)
class TcpClient:
    """Connect to a vehicle (or router) that listens."""

    host: str
    port: int


@dataclass(frozen=True)
class TcpServer:
    """Listen for one vehicle that connects; if `peers` are given, only a peer may connect."""

    host: str
    port: int
    peers: tuple[PeerAddress, ...] = ()


@dataclass(frozen=True)
class SerialPort:
    """A UART or USB device at a baud rate."""

    device: str
    baud: int


Endpoint = UdpIn | UdpOut | TcpClient | TcpServer | SerialPort

_NETWORK_CLASSES: dict[str, type[UdpIn | UdpOut | TcpClient | TcpServer]] = {
    "udpin": UdpIn,
    "udp": UdpIn,
    "udpout": UdpOut,
    "tcp": TcpClient,
    "tcpout": TcpClient,
    "tcpin": TcpServer,
}


def parse_endpoint(text: str) -> Endpoint:
    """Read an endpoint such as `udpin://0.0.0.0:14540` or `serial:///dev/ttyAMA0:921600`.

    `udp://` with no host, 0.0.0.0 or a loopback address means `udpin://`, as in MAVSDK. An
    empty host of a listening endpoint means every interface. A listening endpoint may name its
    peers: `udpin://0.0.0.0:14540?peer=192.0.2.7`, with a port as in `?peer=192.0.2.7:14580`,
    several separated by commas.

    Raises:
        EndpointError: the text is in none of the notations in `_HELP`, a host name is not valid, or
            a port is not 1..65535 (a listening endpoint also takes 0: any free port). For the
            notation of another program, the message says what to write instead.
    """
    scheme, separator, rest = text.strip().partition("://")
    if separator and scheme == "serial":
        return _serial(text, rest)
    endpoint_class = _NETWORK_CLASSES.get(scheme)
    if not separator or endpoint_class is None:
        raise EndpointError(f"endpoint {text!r} is not understood: {_remedy(text)}")
    rest, question, query = rest.partition("?")
    match = _NETWORK_PATTERN.fullmatch(rest.rstrip("/"))
    if match is None:
        raise EndpointError(f"endpoint {text!r} needs HOST:PORT after {scheme}://: {_HELP}")
    is_listening = endpoint_class in (UdpIn, TcpServer)
    host, port = match[1].strip("[]") or ("0.0.0.0" if is_listening else ""), int(match[2])
    if not host:
        raise EndpointError(f"endpoint {text!r} names no host to connect to: {_HELP}")
    if scheme == "udp" and host not in _LISTENING_HOSTS:
        raise EndpointError(
            f"endpoint {text!r} does not say who listens: write udpin://0.0.0.0:{port} to wait for "
            f"the vehicle, or udpout://{match[1]}:{port} to send to {host} first"
        )
    if not is_host(host):
        raise EndpointError(f"endpoint {text!r}: {host!r} is no host name or address")
    if not (0 if is_listening else 1) <= port <= 65535:
        raise EndpointError(f"endpoint {text!r}: port {port} is outside 1..65535")
    if not question:
        return endpoint_class(host, port)
    if endpoint_class is UdpIn or endpoint_class is TcpServer:
        return endpoint_class(host, port, _peers(text, query))
    raise EndpointError(
        f"endpoint {text!r}: {scheme}:// names its peer already; leave ?{query} out"
    )


def _peers(text: str, query: str) -> tuple[PeerAddress, ...]:
    key, _, names = query.partition("=")
    peers = []
    for name in names.split(","):
        match = _PEER_PATTERN.fullmatch(name.strip())
        port = int(match[2]) if match and match[2] else None
        if (
            key != "peer"
            or match is None
            or not is_host(match[1].strip("[]"))
            or not (port is None or 1 <= port <= 65535)
        ):
            raise EndpointError(
                f"endpoint {text!r}: {query!r} is not understood; write ?peer=ADDRESS or "
                "?peer=ADDRESS:PORT, several with commas between"
            )
        peers.append(PeerAddress(match[1].strip("[]"), port))
    return tuple(peers)


def is_host(text: str) -> bool:
    """Whether `text` is a valid host name: labels of 1 to 63 characters, 253 in all, no blanks."""
    try:
        text.encode("idna")  # the resolver does this too, and would raise UnicodeError
    except UnicodeError:
        return False
    return 1 <= len(text) <= 253 and text.isprintable() and not any(map(str.isspace, text))


def _serial(text: str, rest: str) -> SerialPort:
    match = _SERIAL_PATTERN.fullmatch(rest)
    if match is None or int(match[2]) == 0:
        device, colon, _ = rest.partition(":")
        is_path = device.startswith("/") and (colon or not _DEVICE_PATTERN.fullmatch(text))
        remedy = _baud_remedy(device) if is_path else _remedy(text)
        raise EndpointError(f"endpoint {text!r} needs DEVICE:BAUD: {remedy}")
    return SerialPort(match[1], int(match[2]))


def _baud_remedy(path: str) -> str:
    return (
        f"write serial://{path}:BAUD with the baud rate of the autopilot's port, such as "
        f"serial://{path}:921600"
    )


def _remedy(text: str) -> str:
    """What to write instead of another program's notation; for an unknown text, all notations."""
    text = text.strip()
    if device := _DEVICE_PATTERN.fullmatch(text):
        name, baud = device[1], device[2]
        base_name = name.removeprefix("/").removeprefix("dev/")
        path = name if name.startswith("COM") else f"/dev/{base_name}"
        if baud:
            return f"write serial://{path}:{baud}"
        return _baud_remedy(path)
    if address := _ADDRESS_PATTERN.fullmatch(text):
        scheme, host, port = address[1], address[2], address[3]
        endpoint_class = _NETWORK_CLASSES.get(scheme or "")
        if endpoint_class is not None and (scheme != "udp" or host in _LISTENING_HOSTS):
            equivalent_scheme = "udpin" if scheme == "udp" else scheme
            return f"write {equivalent_scheme}://{host or '0.0.0.0'}:{port}"
        if scheme in (None, "udp"):
            is_host_named = host and host not in _NETWORK_CLASSES
            udpout_hint = (
                f", or udpout://{host}:{port} to send to {host} first" if is_host_named else ""
            )
            return f"write udpin://0.0.0.0:{port} to wait for the vehicle{udpout_hint}"
    if text.isdigit() and 0 < int(text) <= 65535:
        return f"write udpin://0.0.0.0:{text}"
    return _HELP
