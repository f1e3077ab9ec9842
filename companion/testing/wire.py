"""Joins a mock vehicle and the program in memory.

The program's end is a transport that behaves like a listening UDP socket: it sends nothing
before it has received a valid frame (`PeerRule`), and it forgets a silent peer.
"""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.base import Receiver
from companion.mavlink.transport.udp import PEER_SILENCE_S
from companion.testing.vehicle import MockVehicle
from companion.testing.virtual_loop import VirtualClock, VirtualEventLoop
from sitl_mock.exchange import burst_time

_SENDER_NAME = "the mock vehicle"


class MemoryTransport:
    """The program's end of a `Wire`.

    Args:
        receiver: takes arriving datagrams.
        on_send: takes sent datagrams.
    """

    reconnects = False

    def __init__(self, receiver: Receiver, on_send: Callable[[bytes], None]) -> None:
        self.is_open = True
        self._receiver, self._on_send = receiver, on_send
        self._loop = asyncio.get_running_loop()
        self._connected = self._received_in_period = False
        self._timer = self._loop.call_later(PEER_SILENCE_S, self._check_peer)

    def deliver(self, datagram: bytes, received_ns: int) -> None:
        """Let a datagram of the vehicle arrive at the event-loop time `received_ns`, ns."""
        receiver = self._receiver
        if self._connected:
            self._received_in_period = (
                receiver.receive(datagram, received_ns) or self._received_in_period
            )
        elif receiver.claim(datagram, received_ns, _SENDER_NAME) or receiver.needs_timesync_with(
            _SENDER_NAME
        ):
            self._connected = self._received_in_period = True

    def send(self, frame: bytes) -> bool:
        """Send one datagram now; return false without a peer."""
        if not self._connected:
            return False
        self._on_send(frame)
        return True

    def close(self) -> None:
        """Close the transport; datagrams on their way to the program are lost."""
        self.is_open = False
        self._timer.cancel()

    def _check_peer(self) -> None:
        self._timer = self._loop.call_later(PEER_SILENCE_S, self._check_peer)
        peer_silent, self._received_in_period = not self._received_in_period, False
        if peer_silent or self._receiver.may_replace_peer():
            self._connected = False


class Wire:
    """Joins a vehicle, the program's transport and their clock, which the vehicle advances."""

    def __init__(self, vehicle: MockVehicle, clock: VirtualClock) -> None:
        self._vehicle, self._clock = vehicle, clock
        self._transport: MemoryTransport | None = None

    def open(self, receiver: Receiver) -> MemoryTransport:
        """Open the program's end.

        Raises:
            EndpointError: the program's end is already open.
        """
        if self._transport is not None and self._transport.is_open:
            raise EndpointError("the mock vehicle has one companion link, which is open already")
        self._transport = MemoryTransport(receiver, self._send_to_vehicle)
        return self._transport

    def _send_to_vehicle(self, frame: bytes) -> None:
        """Pass a frame of the program to the vehicle."""
        self._vehicle.receive(frame)

    def _deliver(self, datagram: bytes, time: float) -> None:
        if self._transport is not None and self._transport.is_open:
            self._transport.deliver(datagram, round(time * 1e9))


class LockstepWire(Wire):
    """A wire in lockstep: the vehicle makes a step when the program has nothing left to do.

    Each beacon of the vehicle sets the clock.
    """

    def deliver_due(self) -> None:
        """Do nothing: no datagram arrives between two steps."""

    def advance(self, until: float) -> None:
        """Let the vehicle make one whole step, ignoring `until`; due timers run after the step."""
        datagrams = self._vehicle.begin() or self._vehicle.step()
        for datagram in datagrams:  # the beacon comes last, and sets the clock to this time
            self._deliver(datagram, self._vehicle.time)
        # Without an open link, or with one that does not accept the beacon, time passes as well.
        self._clock.now = max(self._clock.now, self._vehicle.time)


class FreeRunningWire(Wire):
    """A wire without lockstep: both sides run on the clock; `MockVehicle.delay_s` applies."""

    def __init__(self, vehicle: MockVehicle, clock: VirtualClock) -> None:
        super().__init__(vehicle, clock)
        self._delay = vehicle.delay_s
        self._burst = vehicle.settings.burst_ms * 1e-3
        # (arrival time, s; whether the program receives it; datagram). All have the same delay, so
        # they arrive in the order of sending.
        self._in_transit: deque[tuple[float, bool, bytes]] = deque()
        # Time by which vehicle time is behind the clock, s.
        self._vehicle_clock_lag = clock.now - vehicle.time
        vehicle.set_clock(lambda: round((clock.now - self._vehicle_clock_lag) * 1e9))

    def advance(self, until: float) -> None:
        """Advance until a datagram reaches the program, but at most to the time `until`, s."""
        clock, in_transit = self._clock, self._in_transit
        next_step_time = self._next_step_time()
        while True:
            arrival_time = in_transit[0][0] if in_transit else next_step_time
            clock.now = max(clock.now, min(until, arrival_time, next_step_time))
            program_received = clock.now >= arrival_time and self.deliver_due()
            if clock.now >= next_step_time:
                self._send_to_program(self._vehicle.begin())
                self._send_to_program(self._vehicle.step())
                self._vehicle_clock_lag += self._vehicle.take_clock_slip()
                next_step_time = self._next_step_time()
                program_received = self.deliver_due() or program_received
            if program_received or clock.now >= until:
                return

    def _next_step_time(self) -> float:
        return burst_time(self._vehicle.next_step_at, self._burst) + self._vehicle_clock_lag

    def deliver_due(self) -> bool:
        """Deliver due datagrams, in order; return whether the program received one."""
        in_transit, now, program_received = self._in_transit, self._clock.now, False
        while in_transit and in_transit[0][0] <= now:
            _, to_program, datagram = in_transit.popleft()
            if to_program:
                program_received = True
                self._deliver(datagram, now)
            else:
                self._vehicle.receive(datagram)
                self._send_to_program(self._vehicle.take_sent())
        return program_received

    def _send_to_vehicle(self, frame: bytes) -> None:
        self._in_transit.append((self._clock.now + self._delay, False, frame))

    def _send_to_program(self, datagrams: list[bytes]) -> None:
        arrival_time = self._clock.now + self._delay
        self._in_transit.extend((arrival_time, True, datagram) for datagram in datagrams)


def wire_to(vehicle: MockVehicle, clock: VirtualClock) -> LockstepWire | FreeRunningWire:
    """The wire of a vehicle, with or without lockstep."""
    return (LockstepWire if vehicle.in_lockstep else FreeRunningWire)(vehicle, clock)


async def open_wire(_endpoint: Any, receiver: Receiver, _lost: Any) -> MemoryTransport:
    """Open a transport to the vehicle of the running loop; an `OpenTransport` for `Link`.

    Raises:
        EndpointError: the running loop is not a vehicle's, or the vehicle has an open link.
    """
    loop = asyncio.get_running_loop()
    if not (isinstance(loop, VirtualEventLoop) and isinstance(loop.world, Wire)):
        raise EndpointError("a mock vehicle in memory is reached only inside companion.testing.run")
    return loop.world.open(receiver)
