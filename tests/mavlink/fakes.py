"""Tiny vehicles on real sockets, speaking through pymavlink: the judge shares no code with us."""

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from pymavlink.dialects.v20 import common as dialect

from companion.mavlink.settings import LinkSettings
from companion.vehicle.link import Link

PX4 = 12


def frames_of(*messages: Any, system: int = 1, component: int = 1, start: int = 0) -> list[bytes]:
    """Each message as pymavlink packs it, numbered from `start`."""
    mav = dialect.MAVLink(None, system, component)
    mav.seq = start
    packed = []
    for message in messages:
        packed.append(message.pack(mav))
        mav.seq = (mav.seq + 1) & 0xFF
    return packed


def heartbeat(custom_mode: int = 0x03040000, *, armed: bool = False, autopilot: int = PX4) -> Any:
    base_mode = 157 if armed else 29
    return dialect.MAVLink_heartbeat_message(2, autopilot, base_mode, custom_mode, 3, 3)


def attitude(time_boot_ms: int, *values: float) -> Any:
    return dialect.MAVLink_attitude_quaternion_message(
        time_boot_ms, *(values or (1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3))
    )


class FakeVehicle:
    """A vehicle in the test's own event loop: keeps what it hears, answers what it is told to."""

    def __init__(self, peer: tuple[str, int] | None = None) -> None:
        self.peer = peer
        self.heard: list[Any] = []
        self.answers: dict[str, Callable[[Any], list[Any]]] = {}
        self.mav = dialect.MAVLink(None, 1, 1)
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._arrived = asyncio.Event()
        self._write: Callable[[bytes], None] | None = None

    async def open_udp(self, host: str = "127.0.0.1", port: int = 0) -> "FakeVehicle":
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.setblocking(False)
        opened.bind((host, port))
        self.socket = opened
        self.address = opened.getsockname()
        self._write = lambda frame: self.peer and opened.sendto(frame, self.peer)
        asyncio.get_running_loop().add_reader(opened, self._read_udp)
        return self

    def close(self) -> None:
        asyncio.get_running_loop().remove_reader(self.socket)
        self.socket.close()

    def _read_udp(self) -> None:
        try:
            data, sender = self.socket.recvfrom(4096)
        except OSError:
            return
        self.peer = self.peer or sender
        self.take(data)

    def write_with(self, write: Callable[[bytes], None]) -> None:
        self._write = write

    def take(self, data: bytes) -> None:
        for message in self._parser.parse_buffer(data) or ():
            self.heard.append(message)
            for reply in self.answers.get(message.get_type(), lambda _: [])(message):
                self.send(reply)
        self._arrived.set()

    def send(self, *messages: Any) -> None:
        for message in messages:
            self.send_raw(message.pack(self.mav))
            self.mav.seq = (self.mav.seq + 1) & 0xFF

    def send_raw(self, data: bytes) -> None:
        assert self._write is not None
        self._write(data)

    def of(self, name: str) -> list[Any]:
        return [message for message in self.heard if message.get_type() == name]

    async def hears(self, name: str, count: int = 1) -> list[Any]:
        async with asyncio.timeout(5.0):
            while len(self.of(name)) < count:
                self._arrived.clear()
                await self._arrived.wait()
        return self.of(name)


@asynccontextmanager
async def linked(
    tap: Any = None, *, autopilot: int = PX4, **settings: Any
) -> AsyncIterator[tuple[Link, FakeVehicle]]:
    """An open UDP link whose vehicle has been heard."""
    settings.setdefault("endpoint", "udpin://127.0.0.1:0")
    async with Link(LinkSettings(**settings), tap) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        try:
            vehicle.send(heartbeat(autopilot=autopilot))
            await link.wait_connected(5.0)
            yield link, vehicle
        finally:
            vehicle.close()


async def until(condition: Callable[[], Any]) -> None:
    """Wait until the condition holds; fail after 5 s."""
    async with asyncio.timeout(5.0):
        while not condition():  # noqa: ASYNC110  any condition, of either side
            await asyncio.sleep(0.001)


class LockstepVehicle(threading.Thread):
    """The vehicle's half of lockstep, in a thread of its own; logs all it hears, in order.

    `say(time_boot_ms)` gives the messages of a step; `hear(message)` sees what the client says and
    gives what is answered in the next step.
    """

    def __init__(
        self,
        port: int,
        steps: int,
        say: Callable[[int], list[Any]],
        hear: Callable[[Any], list[Any]] = lambda _: [],
        *,
        repeat_beacons: bool = False,
    ) -> None:
        super().__init__(daemon=True)
        self.log: list[tuple[int, str, bytes]] = []
        self._peer = ("127.0.0.1", port)
        self._steps, self._say, self._hear = steps, say, hear
        self._copies = 2 if repeat_beacons else 1

    def run(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
            opened.bind(("127.0.0.1", 0))
            opened.settimeout(0.05)
            self._fly(opened)

    def _fly(self, opened: socket.socket) -> None:
        mav, parser = dialect.MAVLink(None, 1, 1), dialect.MAVLink(None)
        beacons = dialect.MAVLink(None, 1, 1)  # numbered apart, as the mock vehicle does
        replies: list[Any] = []
        for step in range(self._steps):
            now = 4 * step
            # The first beacon is repeated until the client is there; until then nothing is said.
            for message in (*replies, *self._say(now)) if step else ():
                opened.sendto(message.pack(mav), self._peer)
                mav.seq = (mav.seq + 1) & 0xFF
            replies, answered, silence = [], False, 0
            beacon = dialect.MAVLink_system_time_message(0, now).pack(beacons)
            for _ in range(self._copies if step else 1):
                opened.sendto(beacon, self._peer)
            while not answered:
                try:
                    data = opened.recv(4096)
                except TimeoutError:
                    silence += 1
                    if step == 0:
                        opened.sendto(beacon, self._peer)
                    elif silence > 20:
                        return  # the client has gone home
                    continue
                silence = 0
                for message in parser.parse_buffer(data) or ():
                    name = message.get_type()
                    closes = name in ("SYSTEM_TIME", "SET_ATTITUDE_TARGET")
                    if closes and message.time_boot_ms != now:
                        continue  # a second answer to a repeated beacon
                    self.log.append((now, name, bytes(message.get_msgbuf()[10:-2])))
                    replies += self._hear(message)
                    answered = answered or closes
