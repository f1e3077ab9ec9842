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


def connection_url(endpoint: str) -> str:
    """What `Mavsdk.add_any_connection` takes for one of our endpoints.

    Raises:
        EndpointError: With the reason and how to mend it.
    """
    where = parse_endpoint(endpoint)
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
