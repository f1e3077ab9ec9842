"""Our endpoints in MAVSDK's notation."""

from companion.mavlink.endpoint import (
    Endpoint,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)
from companion.mavlink.errors import EndpointError


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
