"""Who the peer is: what strangers send is not taken, and they do not keep the vehicle out."""

import asyncio

import pytest

from companion.attitude import BodyRates
from companion.mavlink import Link, LinkSettings
from companion.mavlink import udp as udp_module
from tests.mavlink.fakes import FakeVehicle, attitude, frames_of, heartbeat, linked, until

LEVEL = BodyRates(0.0, 0.0, 0.0)
UDP = LinkSettings(endpoint="udpin://127.0.0.1:0")


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(udp_module, "_PEER_SILENCE_S", 0.05)


def test_what_a_stranger_queued_before_the_peer_was_fixed_is_not_taken(run):
    """The kernel keeps it in the socket's queue, also after the socket was connected."""

    async def scene():
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

    run(scene())


def test_a_peer_elsewhere_is_counted_and_one_that_comes_back_is_not(run, quick):
    async def scene():
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

    run(scene())


def test_only_a_heartbeat_of_the_autopilot_makes_a_peer(run):
    async def scene():
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

    run(scene())
