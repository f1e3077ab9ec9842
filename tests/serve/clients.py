"""Clients on real sockets, speaking through pymavlink, in the test's own event loop."""

import asyncio
import socket
from contextlib import asynccontextmanager

from pymavlink.dialects.v20 import common as dialect

from companion.serve.network.network import Network
from tests.mavlink.fakes import linked

GROUND = 255, 190
_open_clients = []


class SocketClient:
    """A UDP or TCP client that keeps what it hears; it is closed with its `network`."""

    def __init__(self, opened, ids=GROUND):
        self.socket, self.heard, self.bytes = opened, [], b""
        self.mav = dialect.MAVLink(None, *ids)
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        opened.setblocking(False)
        asyncio.get_running_loop().add_reader(opened, self._read)
        _open_clients.append(self)

    def _read(self):
        try:
            data = self.socket.recv(65536)
        except OSError:
            return
        self.bytes += data
        self.heard += self._parser.parse_buffer(data) or ()

    def send(self, *messages):
        for message in messages:
            self.socket.send(message.pack(self.mav))
            self.mav.seq = (self.mav.seq + 1) & 0xFF

    def of(self, name):
        return [message for message in self.heard if message.get_type() == name]

    def stop_reading(self):
        """As a process that got SIGSTOP: nothing is read any more."""
        asyncio.get_running_loop().remove_reader(self.socket)

    def close(self):
        _open_clients.remove(self)
        asyncio.get_running_loop().remove_reader(self.socket)
        self.socket.close()


async def udp_client(port, ids=GROUND):
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.connect(("127.0.0.1", port))
    return SocketClient(opened, ids)


async def tcp_client(port, ids=GROUND):
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    opened.setblocking(False)
    await asyncio.get_running_loop().sock_connect(opened, ("127.0.0.1", port))
    return SocketClient(opened, ids)


@asynccontextmanager
async def network(*endpoints, **settings):
    """A network between a fake vehicle and these endpoints."""
    endpoints = endpoints or ("udpin://127.0.0.1:0",)
    async with linked(**settings) as (link, vehicle), Network(link, endpoints) as net:
        net.routing.intercept = lambda *_: False
        try:
            yield net, link, vehicle
        finally:
            for client in tuple(_open_clients):
                client.close()


def heartbeat():
    return dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
