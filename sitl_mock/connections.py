"""The connections of one vehicle: companion, ground station, control channel."""

import contextlib
import select
import socket

from sitl_mock.config.endpoint import SerialLine, TcpIn, parse_endpoint
from sitl_mock.config.settings import GCS_PORT_OFFSET, PORT_OFFSET
from sitl_mock.control_channel import reply
from sitl_mock.exchange import Exchange, ReceivedDatagram
from sitl_mock.link.endpoint import Endpoint
from sitl_mock.link.link import Link
from sitl_mock.link.serial_endpoint import SerialEndpoint
from sitl_mock.link.tcp_endpoint import TcpEndpoint
from sitl_mock.link.udp_endpoint import MAX_DATAGRAM, UdpEndpoint, bound_socket
from sitl_mock.settings import MockSettings
from sitl_mock.simulation import Simulation


class Connections:
    """The endpoints, each with its link, and the control channel.

    Attributes:
        companion: the companion's endpoint.

    Raises:
        ConfigError: a port cannot be used, or a pseudo-terminal or its symbolic link cannot be
            made.
    """

    def __init__(self, settings: MockSettings, simulation: Simulation, exchange: Exchange) -> None:
        self.companion = _companion_endpoint(settings)
        self._simulation = simulation
        self._exchange = exchange
        self._links: dict[Endpoint, Link] = {self.companion: simulation.companion}
        if settings.gcs_port:
            gcs = UdpEndpoint(settings.gcs_port + GCS_PORT_OFFSET, settings.gcs_port, "--gcs-port")
            self._links[gcs] = simulation.gcs
        self._control: socket.socket | None = None
        if settings.control_port:
            self._control = bound_socket(settings.control_port, "--control-port")

    def close(self) -> None:
        """Close all endpoints and the control channel."""
        for endpoint in self._links:
            endpoint.close()
        if self._control is not None:
            self._control.close()

    def wait_for_input(self, timeout_s: float) -> list[Endpoint]:
        """Wait at most ``timeout_s`` for input; return the endpoints that have some.

        Requests on the control channel are answered here.
        """
        by_descriptor = {fd: endpoint for endpoint in self._links for fd in endpoint.descriptors}
        control_descriptors = [] if self._control is None else [self._control.fileno()]
        readable, _, _ = select.select([*by_descriptor, *control_descriptors], (), (), timeout_s)
        if self._control is not None and self._control.fileno() in readable:
            self._answer_requests(self._control)
        return [by_descriptor[fd] for fd in readable if fd in by_descriptor]

    def deliver(self, datagrams: list[ReceivedDatagram], endpoint: Endpoint) -> None:
        """Pass the datagrams that arrived on an endpoint to the autopilot."""
        self._exchange.deliver(datagrams, self._links[endpoint])

    def send_beacon(self, beacon: bytes) -> None:
        """Send the companion a lockstep beacon without the queued frames."""
        self.companion.send([self._simulation.companion.sign(beacon)])

    def flush(self, beacon: bytes | None = None) -> None:
        """Send the queued frames of every link; the beacon, if any, only to the companion."""
        for endpoint, link in self._links.items():
            own_beacon = beacon if endpoint is self.companion else None
            endpoint.send(self._exchange.take_outgoing(link, own_beacon))

    def _answer_requests(self, control: socket.socket) -> None:
        with contextlib.suppress(OSError):  # no further request waits, or its sender is gone
            while True:
                request, sender = control.recvfrom(MAX_DATAGRAM)
                control.sendto(reply(self._simulation, request), sender)


def _companion_endpoint(settings: MockSettings) -> Endpoint:
    match parse_endpoint(settings.endpoint):
        case TcpIn(host, port):
            return TcpEndpoint(host, port)
        case SerialLine(path):
            return SerialEndpoint(path)
        case _:
            return UdpEndpoint(settings.port + PORT_OFFSET, settings.port, "--port")
