"""A client on a serial line, such as a telemetry radio."""

import asyncio

from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import SerialPort
from companion.mavlink.transport.serial_port import SerialTransport
from companion.serve.network.client import Client, ClientListener

_RETRY_PAUSE = 2.0
"""Pause before opening a lost device again, s."""


class SerialLine:
    """Keeps a serial device open, and attaches its client.

    Raises:
        EndpointError: the device is missing, in use, or not permitted.
    """

    def __init__(self, endpoint: SerialPort, clients: ClientListener) -> None:
        self._endpoint, self._clients = endpoint, clients
        self._reopen_task: asyncio.Task[None] | None = None
        self._client = SerialClient(endpoint.device)
        self._transport = self._open()

    def close(self) -> None:
        """Close the device."""
        if self._reopen_task is not None:
            self._reopen_task.cancel()
        self._transport.close()
        self._clients.detach(self._client)

    def _open(self) -> SerialTransport:
        transport = SerialTransport(self._endpoint, self._receive, self._on_connection_lost)
        self._client.transport = transport
        self._clients.attach(self._client)
        return transport

    def _receive(self, data: bytes, _received_ns: int) -> bool:
        self._clients.receive_frames(self._client, self._client.scan(data))
        return True

    def _on_connection_lost(self, _reason: str) -> None:
        self._clients.detach(self._client)
        self._reopen_task = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        while True:
            await asyncio.sleep(_RETRY_PAUSE)
            self._client = SerialClient(self._endpoint.device)
            try:
                self._transport = self._open()
            except EndpointError:
                continue  # not plugged in again yet
            return


class SerialClient(Client):
    """The client at the other end of a serial line.

    Attributes:
        transport: the open device, or None.
    """

    def __init__(self, device: str) -> None:
        super().__init__(f"serial {device}", device=device, streaming=True)
        self.transport: SerialTransport | None = None

    def _flush(self) -> None:
        while self._queued_frames and self.transport is not None:
            if not self.transport.send(self._queued_frames[0]):
                return  # the line is busy; what does not fit into the queue meanwhile is dropped
            self._dequeue(0)
            self.stats.sent += 1
