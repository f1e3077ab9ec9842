"""Who the peer is: what strangers send is not taken, and they do not keep the vehicle out."""

import asyncio
from contextlib import asynccontextmanager, suppress
from math import inf
from socket import AF_INET6, SOCK_DGRAM, socket

import pytest

from companion.attitude import BodyRates
from companion.mavlink.errors import EndpointError, LinkTimeout
from companion.mavlink.peer import PeerRule, resolve_peers
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport import tcp as tcp_module
from companion.mavlink.transport import udp as udp_module
from companion.mavlink.transport.endpoint import PeerAddress
from companion.vehicle.link import Link
from tests.mavlink.fakes import FakeVehicle, attitude, frames_of, heartbeat, linked, until

LEVEL = BodyRates(0.0, 0.0, 0.0)
UDP = LinkSettings(endpoint="udpin://127.0.0.1:0")


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(udp_module, "PEER_SILENCE_S", 0.05)


async def test_what_a_stranger_queued_before_the_peer_was_fixed_is_not_taken():
    """The kernel keeps it in the socket's queue, also after the socket was connected."""

    async with Link(UDP) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        stranger = await FakeVehicle(link.local_address).open_udp()
        samples = []
        link.on_attitude = lambda sample: samples.append(sample.time_boot_ms)
        vehicle.send(heartbeat())  # nothing runs in between: all of this waits to be read
        stranger.send(*(attitude(1000 + number) for number in range(20)))
        vehicle.send(attitude(4))
        await until(lambda: samples)
        await asyncio.sleep(0.01)
        assert samples == [4]
        vehicle.close(), stranger.close()


async def test_a_peer_elsewhere_is_counted_and_one_that_comes_back_is_not(quick):
    async with linked() as (link, vehicle):
        assert link.stats.peers == 0
        await asyncio.sleep(0.15)  # silent for longer than the peer is kept
        vehicle.send(heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert link.stats.peers == 0
        other = await FakeVehicle(link.local_address).open_udp()

        def heard():
            other.send(heartbeat(0x03040000))
            return link.state.mode == "AUTO.LOITER"

        await until(heard)
        assert link.stats.peers == 1
        other.close()


async def test_a_peer_that_was_silent_goes_on_without_a_new_claim(quick):
    async with linked() as (link, vehicle):
        samples = []
        link.on_attitude = lambda sample: samples.append(sample.time_boot_ms)
        await until(lambda: not link._outbox.transport._connected)  # silent for too long
        stranger = await FakeVehicle(link.local_address).open_udp()
        stranger.send(attitude(1))
        vehicle.send(attitude(4))
        await until(lambda: samples)
        assert samples == [4]
        assert (link.stats.peers, link.stats.unclaimed) == (0, 1)
        stranger.close()


async def test_only_a_heartbeat_of_the_autopilot_makes_a_peer():
    async with Link(UDP) as link:
        stranger = await FakeVehicle(link.local_address).open_udp()
        vehicle = await FakeVehicle(link.local_address).open_udp()
        samples = []
        link.on_attitude = lambda sample: samples.append(sample.time_boot_ms)
        ground_station, gimbal = heartbeat(), heartbeat(autopilot=8)
        ground_station.type = 6
        stranger.send(attitude(1), ground_station, gimbal, attitude(2))
        stranger.send_raw(frames_of(heartbeat(), system=2)[0])
        vehicle.send(heartbeat())
        await link.wait_connected(5.0)
        stranger.send(attitude(3))
        vehicle.send(attitude(4))
        await until(lambda: samples)
        assert samples == [4]
        assert link.stats.unclaimed == 4
        vehicle.close(), stranger.close()


def test_a_claim_lapses_on_the_ground_and_not_in_control():
    at = {"now": 100.0, "setpoint": -inf}
    rule = PeerRule(
        LinkStats(), list, lambda: at["now"], lambda: at["setpoint"], every_frame_claims=False
    )
    rule.set_peer("vehicle")
    for now, setpoint, lapsed in (
        (104.9, -inf, False),
        (105.1, -inf, True),
        (105.1, 105.0, False),  # setpoints are sent
        (106.9, 105.0, False),
        (107.1, 105.0, True),
    ):
        at.update(now=now, setpoint=setpoint)
        assert rule.may_replace_peer() is lapsed
    rule.renew_claim()
    assert not rule.may_replace_peer()


async def test_a_peer_whose_claim_lapsed_gives_way_although_it_still_sends():
    async with linked() as (link, first):
        second = await FakeVehicle(link.local_address).open_udp()
        transport = link._outbox.transport
        for lapsed in (False, True):
            link._inbox.may_replace_peer = lambda lapsed=lapsed: lapsed
            frames = link.stats.frames
            first.send(attitude(4))
            await until(lambda frames=frames: link.stats.frames > frames)
            transport._check_peer()  # what the timer calls
            assert transport._connected is not lapsed
        first.send(attitude(8))
        second.send(heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert (link.stats.peers, link.stats.unclaimed) == (1, 1)
        second.close()


async def test_damaged_frames_do_not_hold_the_place(quick):
    async with linked() as (link, first):
        second = await FakeVehicle(link.local_address).open_udp()
        damaged = bytearray(frames_of(heartbeat())[0])
        damaged[-1] ^= 1

        def replaced():
            first.send_raw(bytes(damaged))
            second.send(heartbeat(0x00060000))
            return link.state.mode == "OFFBOARD"

        await until(replaced)
        second.close()


async def test_only_the_named_peer_is_heard():
    notices = []
    vehicle = await FakeVehicle().open_udp()
    named = f"udpin://127.0.0.1:0?peer=localhost:{vehicle.address[1]}"
    async with Link(LinkSettings(endpoint=named), notice=notices.append) as link:
        stranger = await FakeVehicle(link.local_address).open_udp()
        stranger.send(heartbeat(0x00060000), heartbeat(0x00060000))
        vehicle.peer = link.local_address
        vehicle.send(heartbeat())
        assert (await link.wait_connected(5.0)).mode == "AUTO.LOITER"
        [notice] = notices
        assert f"frames from 127.0.0.1:{stranger.address[1]} are ignored" in notice
        stranger.close()
    vehicle.close()


async def test_a_named_host_fits_in_every_spelling():
    named = await resolve_peers([PeerAddress("127.0.0.1"), PeerAddress("::1", 5)], SOCK_DGRAM)
    assert named.admits(("::ffff:127.0.0.1", 9, 0, 0))
    assert named.admits(("::1", 5, 0, 0))
    assert not named.admits(("::1", 6, 0, 0))
    assert not named.admits(("127.0.0.2", 9))
    with pytest.raises(EndpointError, match=r"peer 'no-such-host\.invalid' is unknown"):
        await resolve_peers([PeerAddress("no-such-host.invalid")], SOCK_DGRAM)


async def test_the_rule_holds_over_ipv6():
    async with Link(LinkSettings(endpoint="udpin://[::1]:0")) as link:
        samples = []
        link.on_attitude = lambda sample: samples.append(sample.time_boot_ms)
        with socket(AF_INET6, SOCK_DGRAM) as vehicle, socket(AF_INET6, SOCK_DGRAM) as stranger:
            frames = frames_of(heartbeat(), attitude(4))
            vehicle.sendto(frames[0], link.local_address)
            stranger.sendto(frames_of(attitude(3))[0], link.local_address)
            vehicle.sendto(frames[1], link.local_address)
            await until(lambda: samples)
            assert samples == [4]


@asynccontextmanager
async def tcp_server(query=""):
    """A listening link and what it said of itself."""
    notices = []
    settings = LinkSettings(endpoint=f"tcpin://127.0.0.1:0{query}")
    async with Link(settings, notice=notices.append) as link:
        yield link, notices


async def client(link, *messages):
    reader, writer = await asyncio.open_connection(*link.local_address)
    for frame in frames_of(*messages):
        writer.write(frame)
    return reader, writer


async def test_a_silent_tcp_client_does_not_keep_the_vehicle_out(monkeypatch):
    monkeypatch.setattr(tcp_module, "CLAIM_DURATION_S", 0.05)

    async with tcp_server() as (link, _):
        waiting = asyncio.create_task(link.wait_connected(5.0))
        silent, writer = await client(link, attitude(4))
        early, _ = await client(link, heartbeat())
        with suppress(ConnectionResetError):  # turned away: the first has some time
            assert await early.read() == b""
        await asyncio.sleep(0.06)
        _, vehicles = await client(link, heartbeat())
        assert (await waiting).mode == "AUTO.LOITER"
        assert (link.stats.frames, link.stats.unclaimed) == (1, 1)
        assert (link.stats.peers, link.stats.reconnects) == (0, 0)
        with suppress(ConnectionResetError):
            while await silent.read(4096):
                pass
        # One that brought a heartbeat is not replaced.
        late, _ = await client(link, heartbeat(0x00060000))
        await asyncio.sleep(0.06)
        with suppress(ConnectionResetError):
            assert await late.read() == b""
        assert link.state.mode == "AUTO.LOITER"
        vehicles.close()
        await until(lambda: link.stats.reconnects == 1)
        _, again = await client(link, heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert link.stats.peers == 1
        again.close(), writer.close()


async def test_a_port_scan_does_not_end_what_waits_for_the_vehicle():
    async with tcp_server() as (link, _):
        waiting = asyncio.create_task(link.wait_connected(5.0))
        _, scan = await client(link)
        await asyncio.sleep(0.02)
        scan.transport.abort()
        await asyncio.sleep(0.02)
        _, vehicle = await client(link, heartbeat())
        assert (await waiting).mode == "AUTO.LOITER"
        vehicle.close()


async def test_a_tcp_client_that_is_not_named_is_turned_away():
    async with tcp_server("?peer=192.0.2.7") as (link, notices):
        reader, _ = await client(link, heartbeat())
        with suppress(ConnectionResetError):
            assert await reader.read() == b""
        assert link.stats.frames == 0
        assert "are ignored" in notices[0]


async def test_telemetry_without_a_heartbeat_is_told_for_what_it_is():
    async with Link(UDP) as link:
        stranger = await FakeVehicle(link.local_address).open_udp()
        stranger.send(attitude(1), attitude(2))
        with pytest.raises(LinkTimeout, match="2 other frames with the vehicle's ids"):
            await link.wait_connected(0.1)
        stranger.close()
