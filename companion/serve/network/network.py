"""The network: joins the link to the vehicle and the clients' endpoints by the routing rules.

Forwarding must not delay the control loop, so an arriving frame is only queued. The queue is
forwarded right after the next attitude sample has been answered, when the following sample is a
whole period away. If no sample comes within `_MAX_FORWARDING_DELAY`, the queue is forwarded after
this time.
"""

import asyncio
from collections.abc import Callable, Iterable
from math import inf

from companion.mavlink.codec import ATTITUDE_QUATERNION
from companion.mavlink.errors import EndpointError
from companion.mavlink.framing import Frame
from companion.mavlink.transport.endpoint import (
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)
from companion.safety.actions import fault_message
from companion.serve.network.addresses import Address, source_of
from companion.serve.network.client import Client
from companion.serve.network.routing import Routing
from companion.serve.network.serial_line import SerialLine
from companion.serve.network.setpoint_limit import SetpointLimit
from companion.serve.network.tcp import TcpPort, open_tcp_client, open_tcp_server
from companion.serve.network.udp import UdpPort, open_udp
from companion.serve.network.uplink import UplinkQueue, uplink_limits
from companion.vehicle.link import Link

_MAX_FORWARDING_DELAY = 0.004
"""Longest time that a frame waits to be forwarded, s."""
_MAX_VEHICLE_FRAMES = 4096
"""Largest number of the vehicle's frames that wait to be forwarded; only a stall causes more."""
_MAX_FAULTS = 16
"""Largest number of different faults that are reported."""

Port = UdpPort | TcpPort | SerialLine


class Network:
    """Joins an open link and the endpoints of the clients.

    Use it as `async with Network(link, endpoints) as network:`.

    Args:
        link: open link to the vehicle; its `on_frame` is replaced.
        endpoints: endpoints of the clients, in the notation of
            `companion.mavlink.transport.endpoint`.
        note: called with each event, as a sentence for the user.

    Attributes:
        routing: the routing rules and their counters; set its `intercept` and `on_own_frame`.
        uplink: the clients' frames on their way to the vehicle.
        ports: the open endpoints, in the order of `endpoints`.
        attitude_payload: payload of the autopilot's newest ATTITUDE_QUATERNION; empty before the
            first.
        attitude_arrival: event-loop time at which `attitude_payload` arrived, s.
        overflowed: number of the vehicle's frames that were dropped because the queue was full.
        setpoint_ids: ids of the messages whose rate `SetpointLimit` limits, because this program
            flies them.

    Raises:
        EndpointError: an endpoint cannot be parsed, or (entering the block) cannot be opened.
    """

    def __init__(
        self, link: Link, endpoints: Iterable[str], note: Callable[[str], None] = lambda _: None
    ) -> None:
        settings, self._loop = link.settings, asyncio.get_running_loop()
        clock = self._loop.time
        self._autopilot = Address(settings.target_system, settings.target_component)
        rate, burst = uplink_limits(parse_endpoint(settings.endpoint))
        self.uplink = UplinkQueue(link.forward, rate, burst, clock)
        self.routing = Routing(
            self.uplink,
            self._autopilot,
            Address(settings.source_system, settings.source_component),
            clock,
        )
        self.ports: list[Port] = []
        self.attitude_payload = b""
        self.attitude_arrival = -inf
        self.overflowed = 0
        self.setpoint_ids: frozenset[int] = frozenset()
        self._setpoint_limit = SetpointLimit(self._route)
        self.routing.on_our_ids_used = self._note_our_ids_used
        self._link, self._note_event = link, note
        self._noted_faults: set[str] = set()
        self._endpoints = [parse_endpoint(each) for each in endpoints]
        self._vehicle_frames: list[Frame] = []
        self._timer: asyncio.TimerHandle | None = None
        self._flush_handle: asyncio.Handle | None = None

    async def __aenter__(self) -> "Network":
        try:
            for endpoint in self._endpoints:
                self.ports.append(await self._open(endpoint))
        except EndpointError as error:
            await self.__aexit__()
            raise EndpointError(f"serve.clients: {error}") from error
        self._link.on_frame = self._queue_frame
        return self

    async def __aexit__(self, *_: object) -> None:
        self._link.on_frame = None
        self.flush()
        for port in self.ports:
            port.close()
        self.ports.clear()
        for handle in (self._timer, self._flush_handle):
            if handle is not None:
                handle.cancel()
        await asyncio.sleep(0)  # lets closed connections end

    @property
    def clients(self) -> tuple[Client, ...]:
        """The connected clients."""
        return self.routing.clients

    def now(self) -> float:
        """The event-loop time, s."""
        return self._loop.time()

    def send(self, frame: bytes) -> None:
        """Send a frame of our own component to every client."""
        self.routing.send_to_clients(frame)
        self._flush_later()

    def send_to(self, client: Client, frame: bytes) -> None:
        """Send a frame of our own component to one client."""
        self.routing.send_to_client(client, frame)
        self._flush_later()

    def attach(self, client: Client) -> None:
        """Add a client that has connected."""
        self.routing.attach(client)

    def detach(self, client: Client) -> None:
        """Remove a client that has gone."""
        if client in self.clients:
            self.routing.detach(client)
            self.uplink.forget(client)
            self._setpoint_limit.forget(client)

    def receive_frames(self, client: Client, frames: Iterable[Frame]) -> None:
        """Take the frames that a client has sent; a frame that causes a fault is dropped."""
        for frame in frames:
            is_setpoint = frame.message_id in self.setpoint_ids
            if not is_setpoint or self._setpoint_limit.admits(client, frame):
                self._route(client, frame)
        self._flush_later()

    def flush(self) -> None:
        """Forward the queued frames: first those to the vehicle, as far as `uplink` permits."""
        self._flush_handle = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        vehicle_frames, self._vehicle_frames = self._vehicle_frames, []
        frames_remain = self.uplink.drain()
        for frame in vehicle_frames:
            self.routing.forward_from_vehicle(frame)
        for client in self.clients:
            client.flush()
        if frames_remain:
            self._flush_later()

    def _queue_frame(self, frame: Frame) -> None:
        """Queue a frame that came over the link; forwarding it now could delay the next sample."""
        if len(self._vehicle_frames) >= _MAX_VEHICLE_FRAMES:
            self.overflowed += 1
            return
        self._vehicle_frames.append(frame)
        if frame.message_id == ATTITUDE_QUATERNION and source_of(frame) == self._autopilot:
            self.attitude_payload, self.attitude_arrival = frame.payload, self._loop.time()
            if self._flush_handle is None:
                self._flush_handle = self._loop.call_soon(self.flush)
        elif self._timer is None:
            self._timer = self._loop.call_later(_MAX_FORWARDING_DELAY, self.flush)

    def _route(self, client: Client, frame: Frame) -> None:
        try:
            self.routing.forward_from_client(client, frame)
        except Exception as error:
            self._note_fault_once(f"{fault_message(error)}; a frame of {client.name} was dropped")

    def _note_our_ids_used(self, client: Client) -> None:
        ids = f"{self._link.settings.source_system}/{self._link.settings.source_component}"
        self._note_fault_once(
            f"{client.name} sends under our own ids {ids}, so its frames are not forwarded: "
            "give that program another component id, or change link.source_component"
        )

    def _note_fault_once(self, text: str) -> None:
        if text not in self._noted_faults and len(self._noted_faults) < _MAX_FAULTS:
            self._noted_faults.add(text)
            self._note_event(text)

    def _flush_later(self) -> None:
        if self._timer is None and self._flush_handle is None:
            self._timer = self._loop.call_later(_MAX_FORWARDING_DELAY, self.flush)

    async def _open(self, endpoint: UdpIn | UdpOut | TcpClient | TcpServer | SerialPort) -> Port:
        match endpoint:
            case UdpIn() | UdpOut():
                return await open_udp(endpoint, self)
            case TcpServer():
                return await open_tcp_server(endpoint, self)
            case TcpClient():
                return open_tcp_client(endpoint, self)
            case SerialPort():
                return SerialLine(endpoint, self)
