"""What a client that sends too much, or many programs, cost the others."""

import asyncio
import socket
from contextlib import suppress
from types import SimpleNamespace

import pytest

from companion.mavlink.framing import Frame
from companion.mavlink.settings import LinkSettings
from companion.serve.component import Component
from companion.serve.network.addresses import Address
from companion.serve.network.client import FloodDetector
from companion.serve.network.routing import _MAX_ADDRESSES, Routing
from companion.serve.network.setpoint_limit import SetpointLimit
from tests.mavlink.fakes import attitude, until
from tests.serve.clients import heartbeat, network, tcp_client, udp_client
from tests.serve.virtual import (
    ALL,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    place,
    served,
    stream,
)

BOTH_LOOPS = pytest.mark.usefixtures("run")
REJECTED = 1


class Somebody:
    """A client, as far as the limit of setpoints knows one."""


def frame(number, system=255):
    return Frame(84, system, 190, number & 255, b"", number.to_bytes(4, "little"), signed=False)


@BOTH_LOOPS
async def test_noise_of_a_tcp_client_does_not_keep_samples_from_being_answered():
    """asyncio reads 256 KiB at once, and a search for frames in them took a third of a second."""
    async with network("tcpin://127.0.0.1:0") as (net, link, vehicle):
        flood = await tcp_client(net.ports[0].local[1])
        await until(lambda: net.clients)
        (ours,) = net.clients
        reads, scan = [], ours.scan
        ours.scan = lambda data: [reads.append((net.now(), len(data))), scan(data)][1]
        answered = []
        link.on_attitude = lambda sample: answered.append(sample.time_boot_ms)
        noise = b"\xfe" * 65536
        for number in range(10):
            with suppress(BlockingIOError):  # it is not read any faster
                flood.socket.send(noise)
            vehicle.send(attitude(4 * number + 4))
            await until(lambda number=number: len(answered) == number + 1)
        await until(lambda: len(reads) >= 12)
    assert max(size for _, size in reads) == 4096
    full = [
        (first, third)
        for (first, a), (_, b), (third, c) in zip(reads, reads[1:], reads[2:], strict=False)
        if a == b == c == 4096
    ]
    assert full
    # 5 ms less than the pause: uvloop's clock counts whole milliseconds
    assert all(third - first > FloodDetector.WINDOW - 0.005 for first, third in full)


@BOTH_LOOPS
async def test_a_tcp_client_whose_network_is_gone_keeps_its_place_for_a_minute_only():
    async with network("tcpin://127.0.0.1:0") as (net, _, _):
        await tcp_client(net.ports[0].local[1])
        await until(lambda: net.clients)
        connection = net.clients[0]._transport.get_extra_info("socket")
        assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 60_000


@BOTH_LOOPS
async def test_a_udp_client_that_floods_loses_datagrams_and_its_neighbour_at_the_port_does_not():
    async with network() as (net, _, _):
        port = net.ports[0].local[1]
        flood, other = await udp_client(port, (254, 1)), await udp_client(port, (255, 1))
        flood.send(heartbeat())
        other.send(heartbeat())
        await until(lambda: len(net.clients) == 2)
        ours = {client.name: client for client in net.clients}
        flooding, calm = (
            ours[f"udp 127.0.0.1:{each.socket.getsockname()[1]}"] for each in (flood, other)
        )
        many = b"".join(heartbeat().pack(flood.mav) for _ in range(70))
        for _ in range(20):
            flood.socket.send(many)
        other.send(heartbeat(), heartbeat())
        await until(lambda: calm.stats.received == 3)
        assert flooding.stats.received <= 1 + 2 * 70
        assert flooding.stats.flooded >= 18


async def test_of_a_flood_of_setpoints_some_are_handled_and_always_the_newest():
    client, another, taken = Somebody(), Somebody(), []
    limit = SetpointLimit(lambda *each: taken.append(each))
    admitted = [number for number in range(100) if limit.admits(client, frame(number))]
    assert admitted == list(range(10))
    assert limit.admits(another, frame(7)), "each client has its own"
    assert taken == []
    await asyncio.sleep(0.03)
    assert taken == [(client, frame(99))]
    assert limit.admits(client, frame(100))
    for number in range(101, 130):
        limit.admits(client, frame(number))
    limit.forget(client)
    await asyncio.sleep(0.03)
    assert len(taken) == 1, "a client that has gone is not heard any more"


async def test_a_kept_setpoint_never_comes_after_a_newer_one(monkeypatch):
    """The loop may be late: then the kept one is older than what is read first."""
    taken = []
    limit, client = SetpointLimit(lambda *each: taken.append(each)), Somebody()
    loop = asyncio.get_running_loop()
    now = loop.time()
    for number in range(20):
        limit.admits(client, frame(number))
    monkeypatch.setattr(loop, "time", lambda: now + 0.05)
    assert limit.admits(client, frame(20))
    monkeypatch.undo()
    await asyncio.sleep(0.05)
    assert taken == []


async def test_a_client_whose_refusals_all_differ_is_told_ten_times_in_5_s():
    """Their reasons contain its numbers; a list of them all grew, and slowed each next refusal."""
    sent = []
    net = SimpleNamespace(send_to=lambda *each: sent.append(each), send=sent.append)
    component = Component(LinkSettings("udpin://127.0.0.1:0"), net, lambda _: True)
    client, other = object(), object()
    for number in range(5000):
        component.answer(client, f"refused: {number}")
    assert len(sent) == 10
    component.answer(other, "refused")
    component.tell("control has ended")
    assert len(sent) == 12


def test_of_a_client_with_thousands_of_addresses_only_some_are_learned():
    class Channel:
        def put(self, *_):
            pass

    routing = Routing(Channel(), Address(1, 1), Address(1, 191), lambda: 0.0)
    routing.intercept = lambda *_: True
    client = Channel()
    routing.attach(client)
    for number in range(5000):
        sender = Frame(0, 2 + number % 200, number // 200, 0, b"", number.to_bytes(4), signed=False)
        routing.forward_from_client(client, sender)
    assert len(routing._heard_addresses[client]) == _MAX_ADDRESSES


def test_more_programs_than_are_remembered_do_not_end_control_for_ever():
    """The program that asked had been forgotten, and a flight that nobody flew stayed for ever."""
    vehicle = mock("px4")

    notes = []

    async def scene(session):
        await airborne(session, vehicle, "px4")
        script, crowd = (MemoryClient(name).connect(session) for name in ("script", "crowd"))
        home = place(session)
        script.local(ALL, home)
        for number in range(40):
            crowd.packer.srcSystem = 100 + number
            crowd.local(ALL, home)
            await asyncio.sleep(0.003)
        assert await script.offboard() == REJECTED
        assert any("too many programs" in text for text in script.texts())
        assert session.flights.ownership.owner is None
        await begin_control(session, script, "px4", lambda *_: script.local(ALL, home))

    served(vehicle, "px4", scene, notes=notes)
    assert not [text for text in notes if "internal error" in text]


def test_a_client_that_goes_on_for_a_silent_one_is_named():
    """The pilot was told that the first one was in control, to the end."""
    vehicle = mock("px4")

    async def scene(session):
        ground = await airborne(session, vehicle, "px4")
        first, second = (
            MemoryClient(name, ids).connect(session)
            for name, ids in (("first", (245, 190)), ("second", (246, 190)))
        )
        home = place(session)
        await begin_control(session, first, "px4", lambda *_: first.local(ALL, home))
        await asyncio.sleep(0.7)
        await stream(0.3, lambda _: second.local(ALL, home))
        assert ground.texts()[-2:] == [
            "first (245/190): it sends no valid setpoint, and the vehicle is held",
            "second (246/190) is in control",
        ]
        await asyncio.sleep(2.5)
        assert ground.texts()[-1] == "control by second (246/190) has ended: handed back"

    served(vehicle, "px4", scene, hold_s=1.0)
