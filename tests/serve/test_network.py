"""The network on real sockets: what goes through, in which order, and who may disturb whom."""

import asyncio
import os
import socket

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.free_port import free_port
from companion.serve.component import Component
from tests.mavlink.fakes import attitude, frames_of, until
from tests.serve.clients import GROUND, SocketClient, heartbeat, network, tcp_client, udp_client

pytestmark = pytest.mark.usefixtures("run")

TEXT = dialect.MAVLink_statustext_message
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)


async def test_a_udp_client_hears_the_vehicle_and_reaches_it():
    async with network() as (net, _, vehicle):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat(), ARM)
        (got,) = await vehicle.hears("COMMAND_LONG")
        assert (got.get_srcSystem(), got.get_srcComponent(), got.param1) == (*GROUND, 1.0)
        vehicle.send(dialect.MAVLink_command_ack_message(400, 0, 0, 0, *GROUND))
        await until(lambda: client.of("COMMAND_ACK"))


async def test_several_clients_share_a_udp_port_and_do_not_hear_each_others_answers():
    async with network() as (net, _, vehicle):
        port = net.ports[0].local[1]
        one, two = await udp_client(port, (255, 1)), await udp_client(port, (255, 2))
        for client in (one, two):
            client.send(heartbeat())
        await vehicle.hears("HEARTBEAT", 2)
        vehicle.send(dialect.MAVLink_command_ack_message(400, 0, 0, 0, 255, 2), TEXT(4, b"all"))
        await until(lambda: one.of("STATUSTEXT") and two.of("STATUSTEXT"))
        assert (len(one.of("COMMAND_ACK")), len(two.of("COMMAND_ACK"))) == (0, 1)
        assert len(one.of("HEARTBEAT")) == 1  # of the other client


async def test_a_program_that_listens_is_called_and_heard():
    port = free_port()
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", port))
    async with network(f"udpout://127.0.0.1:{port}") as (_, _, vehicle):
        vehicle.send(TEXT(4, b"hello"))
        while True:
            try:
                opened.setblocking(False)
                _, us = opened.recvfrom(4096)
                break
            except BlockingIOError:
                await asyncio.sleep(0.001)
        opened.connect(us)
        client = SocketClient(opened)
        client.send(ARM)
        await vehicle.hears("COMMAND_LONG")


async def test_tcp_clients_come_and_go():
    async with network("tcpin://127.0.0.1:0") as (net, _, vehicle):
        port = net.ports[0].local[1]
        for component in (1, 2, 3):
            client = await tcp_client(port, (255, component))
            await until(lambda: len(net.clients) == 1)
            client.send(ARM)
            await vehicle.hears("COMMAND_LONG")
            vehicle.send(TEXT(4, b"hello"))
            await until(lambda client=client: client.of("STATUSTEXT"))
            client.close()
            await until(lambda: not net.clients)
            vehicle.heard.clear()


async def test_a_frame_in_pieces_over_tcp_arrives_whole():
    async with network("tcpin://127.0.0.1:0") as (net, _, vehicle):
        client = await tcp_client(net.ports[0].local[1])
        raw = ARM.pack(client.mav)
        for at in range(0, len(raw), 7):
            client.socket.send(raw[at : at + 7])
            await asyncio.sleep(0.002)
        await vehicle.hears("COMMAND_LONG")


async def test_a_listening_tcp_program_is_called_again_after_it_ended(monkeypatch):
    monkeypatch.setattr("companion.serve.network.tcp._RETRY_PAUSE", 0.01)
    connected = []
    server = await asyncio.start_server(
        lambda reader, writer: connected.append(writer), "127.0.0.1", 0
    )
    port = server.sockets[0].getsockname()[1]
    async with network(f"tcp://127.0.0.1:{port}"):
        await until(lambda: len(connected) == 1)
        connected[0].close()
        await until(lambda: len(connected) == 2)
    server.close()
    connected[1].close()


async def test_a_client_on_a_serial_line():
    ours, theirs = os.openpty()
    async with network(f"serial://{os.ttyname(theirs)}:57600") as (_, _, vehicle):
        os.write(ours, ARM.pack(dialect.MAVLink(None, *GROUND)))
        await vehicle.hears("COMMAND_LONG")
        vehicle.send(TEXT(4, b"over the radio"))
        os.set_blocking(ours, False)
        heard = b""
        async with asyncio.timeout(5.0):
            while b"over the radio" not in heard:
                await asyncio.sleep(0.002)
                try:
                    heard += os.read(ours, 4096)
                except BlockingIOError:
                    continue
    os.close(ours)
    os.close(theirs)


async def test_samples_are_answered_before_anything_is_forwarded():
    async with network() as (net, link, _):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat())
        await until(lambda: net.clients)
        order = []

        def control(sample):
            order.append(sample.time_boot_ms)
            link.send_setpoint(sample.time_boot_ms, BodyRates(0.0, 0.0, 0.0), 0.5)

        net.clients[0].put = lambda _: order.append("forwarded")
        link.on_attitude = control
        link._inbox.receive(
            b"".join(frames_of(TEXT(4, b"x"), attitude(4), TEXT(4, b"y"), attitude(8))), 0
        )
        assert order == [4, 8]
        await until(lambda: order == [4, 8] + 4 * ["forwarded"])


async def test_the_attitude_of_another_vehicle_or_component_is_not_ours():
    """Setpoints in body frames turn by the yaw of the autopilot, whoever else is on its link."""
    async with network() as (net, link, _):
        (ours,) = frames_of(attitude(4))
        link._inbox.receive(ours, 0)
        kept = net.attitude_payload
        assert kept
        for ids in ((1, 154), (2, 1)):
            other = dialect.MAVLink(None, *ids)
            link._inbox.receive(
                dialect.MAVLink_attitude_quaternion_message(
                    8, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
                ).pack(other),
                0,
            )
            assert net.attitude_payload is kept


async def test_telemetry_waits_for_the_next_sample_or_4_ms():
    async with network() as (net, _, vehicle):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat())
        await until(lambda: net.clients)
        vehicle.send(*(TEXT(4, b"%d" % number) for number in range(20)))
        await until(lambda: len(client.of("STATUSTEXT")) == 20)
        assert [each.text for each in client.of("STATUSTEXT")] == [str(n) for n in range(20)]


async def test_a_tcp_client_that_stops_reading_loses_frames_and_costs_nobody_anything():
    async with network("tcpin://127.0.0.1:0", "udpin://127.0.0.1:0") as (net, _, vehicle):
        stopped = await tcp_client(net.ports[0].local[1])
        reading = await udp_client(net.ports[1].local[1])
        reading.send(heartbeat())
        await until(lambda: len(net.clients) == 2)
        stopped.stop_reading()
        slow = next(each for each in net.clients if each.name.startswith("tcp"))
        sent = 0
        while not slow.stats.dropped and sent < 200_000:
            vehicle.send(*(TEXT(4, b"x" * 50) for _ in range(100)))
            sent += 100
            await until(lambda sent=sent: reading.bytes.count(b"x" * 50) == sent)
        assert slow.stats.dropped > 0
        assert len(reading.of("STATUSTEXT")) == sent
        assert slow._transport.get_write_buffer_size() < 200_000


async def test_what_a_stopped_tcp_client_reads_later_are_whole_frames():
    async with network("tcpin://127.0.0.1:0") as (net, _, vehicle):
        client = await tcp_client(net.ports[0].local[1])
        await until(lambda: net.clients)
        client.stop_reading()
        (slow,) = net.clients
        while not slow.stats.dropped:
            vehicle.send(*(TEXT(4, b"x" * 50) for _ in range(100)))
            await asyncio.sleep(0.0005)
        asyncio.get_running_loop().add_reader(client.socket, client._read)
        await until(lambda: len(client.of("STATUSTEXT")) >= slow.stats.sent)
        assert not client.of("BAD_DATA")


async def test_a_flood_of_a_client_does_not_keep_samples_from_being_answered():
    async with network() as (net, link, vehicle):
        flood = await udp_client(net.ports[0].local[1])
        answered = []
        link.on_attitude = lambda sample: answered.append(sample.time_boot_ms)
        raw = heartbeat().pack(flood.mav)
        for number in range(30):
            for _ in range(50):
                flood.socket.send(raw)
            vehicle.send(attitude(4 * number + 4))
            await until(lambda number=number: len(answered) == number + 1)
        assert answered == [4 * number + 4 for number in range(30)]


async def test_a_port_in_use_is_one_clear_error():
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken.bind(("127.0.0.1", 0))
    port = taken.getsockname()[1]
    with pytest.raises(EndpointError, match=rf"serve\.clients: UDP 127\.0\.0\.1:{port}: .*use"):
        async with network("udpin://127.0.0.1:0", f"udpin://127.0.0.1:{port}"):
            pass
    taken.close()


async def test_only_named_peers_are_let_in():
    async with network("udpin://127.0.0.1:0?peer=192.0.2.1") as (net, _, _):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat())
        await asyncio.sleep(0.05)
        assert net.clients == ()


async def test_our_component_speaks_and_refuses_commands_to_itself():
    async with network() as (net, link, vehicle):
        component = Component(link.settings, net, link.send)
        net.routing.on_own_frame = component.on_own_frame
        client = await udp_client(net.ports[0].local[1])
        client.send(dialect.MAVLink_command_long_message(1, 191, 400, 0, 1, 0, 0, 0, 0, 0, 0))
        await until(lambda: client.of("COMMAND_ACK"))
        (ack,) = client.of("COMMAND_ACK")
        assert (ack.command, ack.result, ack.get_srcComponent()) == (400, 3, 191)
        heartbeats = asyncio.create_task(component.run())
        component.tell("The pilot has taken over.")
        component.tell("The pilot has taken over.")
        component.answer(net.clients[0], "w" * 120)
        component.answer(net.clients[0], "a tilt of 35°")
        component.send_value("trk_err", 0.25)
        await until(lambda: client.of("NAMED_VALUE_FLOAT") and client.of("HEARTBEAT"))
        whole, *pieces, tilt = client.of("STATUSTEXT")
        assert tilt.text == "a tilt of 35 deg"
        assert (whole.text, whole.id) == ("The pilot has taken over.", 0)
        assert ([len(each.text) for each in pieces], [each.chunk_seq for each in pieces]) == (
            [50, 50, 20],
            [0, 1, 2],
        )
        assert client.of("NAMED_VALUE_FLOAT")[0].name == "trk_err"
        assert len(await vehicle.hears("STATUSTEXT")) == 1
        assert not vehicle.of("COMMAND_LONG")
        heartbeats.cancel()
