"""The companion endpoint as the configuration writes it: udp, tcpin or serial."""

import re
from dataclasses import dataclass
from pathlib import Path

from sitl_mock.config.section import ConfigError

_TCP_PATTERN = re.compile(r"tcpin://([^:/\s]*):(\d{1,5})/?")
_ENDPOINT_EXAMPLES = "write udp, tcpin://127.0.0.1:5760 or serial:///tmp/vehicle"


@dataclass(frozen=True)
class TcpIn:
    """A TCP port that serves one client."""

    host: str
    port: int


@dataclass(frozen=True)
class SerialLine:
    """A pseudo-terminal, with a symbolic link at ``path``; None = no link."""

    path: Path | None


def parse_endpoint(text: str) -> TcpIn | SerialLine | None:
    """Read ``udp``, ``tcpin://HOST:PORT``, ``serial://`` or ``serial:///PATH``.

    An empty HOST means 127.0.0.1. None: UDP, whose ports ``mock.port`` sets.

    Raises:
        ValueError: the text is none of these.
    """
    if text == "udp":
        return None
    if text.startswith("serial://"):
        path = text.removeprefix("serial://")
        if not path or path.startswith("/"):
            return SerialLine(Path(path) if path else None)
    tcp_match = _TCP_PATTERN.fullmatch(text)
    if tcp_match is not None and _is_host(tcp_match[1]) and 1 <= int(tcp_match[2]) <= 65535:
        return TcpIn(tcp_match[1] or "127.0.0.1", int(tcp_match[2]))
    raise ValueError(f"not an endpoint; {_ENDPOINT_EXAMPLES}")


def _is_host(text: str) -> bool:
    """Whether the resolver accepts a host name: no label is empty or longer than 63 characters."""
    try:
        text.encode("idna")
    except UnicodeError:
        return False
    return text.isprintable() and len(text) <= 253


def endpoint_for_vehicle(text: str, index: int) -> str:
    """Return the endpoint of the vehicle with this index, which counts from 0.

    The index is added to a TCP port. From index 1 on, a serial path gets the suffix ``-2``, ``-3``
    ... Other texts stay as they are; `MockSettings.for_vehicle` sets the UDP ports.

    Raises:
        ConfigError: the TCP port would be above 65535.
    """
    if index == 0:
        return text
    match parse_endpoint(text):
        case TcpIn(_, port) if port + index > 65535:
            raise ConfigError(
                f"there is no TCP port {port + index} for vehicle {index + 1}: choose a smaller"
                " port in --endpoint"
            )
        case TcpIn(host, port):
            return f"tcpin://{host}:{port + index}"
        case SerialLine(Path() as path):
            return f"serial://{path}-{index + 1}"
        case _:
            return text
