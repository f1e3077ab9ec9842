"""Clients over UDP: any number that send to our port, or one at a known address."""

import asyncio
import socket
from typing import Any

from companion.mavlink.errors import EndpointError
from companion.mavlink.peer import NamedPeers, host_and_port, plain_host
from companion.mavlink.transport.base import why_not_opened
from companion.mavlink.transport.endpoint import UdpIn, UdpOut
from companion.mavlink.transport.udp import udp_address
from companion.serve.network.client import Client, ClientListener, FloodDetector

_READ_BYTES = 4_096
_MAX_DATAGRAM = 1_400
"""Largest datagram that joins several frames, bytes, so that no network must split it."""
_MAX_READS_AT_ONCE = 8
"""Largest number of datagrams read before the event loop does other work."""
_SILENCE_TIMEOUT = 15.0
"""Time of silence after which a client counts as gone, s; ground stations send once a second."""
_MAX_CLIENTS = 16


async def open_udp(endpoint: UdpIn | UdpOut, clients: ClientListener) -> "UdpPort":
    """Open a UDP endpoint for clients.

    Raises:
        EndpointError: the port is in use, a host is unknown, the address is not that of an
            interface of this computer, or permission is missing.
    """
    family, address, named_peers = await udp_address(endpoint)
    sock = socket.socket(family, socket.SOCK_DGRAM)
    sock.setblocking(False)
    try:
        if isinstance(endpoint, UdpIn):
            sock.bind(address)
        else:
            sock.bind(("", 0) if family == socket.AF_INET else ("::", 0))
    except OSError as error:
        sock.close()
        endpoint_text = f"UDP {endpoint.host}:{endpoint.port}"
        raise EndpointError(f"{endpoint_text}: {why_not_opened(error)}") from error
    port = UdpPort(sock, clients, named_peers)
    if isinstance(endpoint, UdpOut):
        port.send_only_to(address)
    return port


class UdpPort:
    """A UDP socket with its clients, distinguished by their addresses.

    Attributes:
        local: (host, port) to which the socket is bound.
    """

    def __init__(
        self, sock: socket.socket, clients: ClientListener, named_peers: NamedPeers
    ) -> None:
        self._socket, self._clients, self._named_peers = sock, clients, named_peers
        self.local: tuple[str, int] = sock.getsockname()[:2]
        self._loop = asyncio.get_running_loop()
        self._clients_by_address: dict[Any, UdpClient] = {}
        self._only_address: Any = None
        self._flood = FloodDetector()
        self._resume_timer: asyncio.TimerHandle | None = None
        self._expiry_timer = self._loop.call_later(_SILENCE_TIMEOUT, self._expire)
        self._loop.add_reader(sock.fileno(), self._read)

    def send_only_to(self, address: Any) -> None:
        """Send to the client at `address` even before it has sent anything; ignore all others."""
        self._only_address = address
        self._attach(address)

    def close(self) -> None:
        """Close the socket; its clients are gone."""
        self._expiry_timer.cancel()
        if self._resume_timer is not None:
            self._resume_timer.cancel()
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()
        for client in self._clients_by_address.values():
            self._clients.detach(client)
        self._clients_by_address.clear()

    def send(self, data: bytes, address: Any) -> bool:
        """Send a datagram; return False if the kernel's buffer is full.

        After any other error the datagram is lost; return True, because a later one may arrive.
        """
        try:
            self._socket.sendto(data, address)
        except BlockingIOError:
            return False
        except OSError:
            pass  # such as an ICMP refusal: nobody listens there now
        return True

    def _read(self) -> None:
        for _ in range(_MAX_READS_AT_ONCE):
            try:
                data, address = self._socket.recvfrom(_READ_BYTES)
            except OSError:
                return  # nothing left, or an ICMP refusal of something sent before
            self._receive(data, address)
            if self._flood.count(1, 0, self._loop.time()):
                self._loop.remove_reader(self._socket.fileno())
                self._resume_timer = self._loop.call_later(FloodDetector.WINDOW, self._resume)
                return

    def _resume(self) -> None:
        self._resume_timer = None
        self._loop.add_reader(self._socket.fileno(), self._read)

    def _receive(self, data: bytes, address: Any) -> None:
        client = self._clients_by_address.get(address)
        if client is None:
            if self._only_address is not None or not self._named_peers.admits(address):
                return
            client = UdpClient(self, address)
            frames = client.scan(data)
            if not frames or len(self._clients_by_address) >= _MAX_CLIENTS:
                return
            self._attach(address, client)
        elif client.flood.is_flood(self._loop.time()):
            client.stats.flooded += 1
            return
        else:
            frames = client.scan(data)
        client.heard_at = self._loop.time()
        client.flood.count(len(frames), len(data), client.heard_at)
        self._clients.receive_frames(client, frames)

    def _attach(self, address: Any, client: "UdpClient | None" = None) -> None:
        client = self._clients_by_address[address] = client or UdpClient(self, address)
        self._clients.attach(client)

    def _expire(self) -> None:
        self._expiry_timer = self._loop.call_later(1.0, self._expire)
        now = self._loop.time()
        for address, client in tuple(self._clients_by_address.items()):
            if address != self._only_address and now - client.heard_at > _SILENCE_TIMEOUT:
                del self._clients_by_address[address]
                self._clients.detach(client)


class UdpClient(Client):
    """A client with one UDP address.

    Attributes:
        heard_at: event-loop time at which the client's last datagram arrived, s.
        flood: detects a flood from this client. All clients share the socket, so a flood cannot be
            left unread: its datagrams are read and discarded.
    """

    def __init__(self, port: UdpPort, address: Any) -> None:
        host = plain_host(str(address[0]))
        super().__init__(f"udp {host_and_port(address)}", host=host, streaming=False)
        self._port, self._address = port, address
        self.heard_at = asyncio.get_running_loop().time()
        self.flood = FloodDetector()

    def _flush(self) -> None:
        while self._queued_frames:
            datagram, frames = self._dequeue(_MAX_DATAGRAM)
            if self._port.send(datagram, self._address):
                self.stats.sent += frames
            else:
                self.stats.dropped += frames
                self._drop_queued_frames()
