"""Clients whose connection breaks, is refused, or is too slow: nobody else notices."""

import asyncio
import os
import socket
import tty

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.free_port import free_port
from companion.serve.network import network as network_module
from companion.serve.network import serial_line, tcp, udp
from tests.mavlink.fakes import until
from tests.serve.clients import GROUND, heartbeat, network, tcp_client, udp_client

pytestmark = pytest.mark.usefixtures("run")

TEXT = dialect.MAVLink_statustext_message
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)


def terminal():
    ours, theirs = os.openpty()
    tty.setraw(ours)
    os.set_blocking(ours, False)
    return ours, theirs


def read(descriptor):
    try:
        return os.read(descriptor, 65536)
    except BlockingIOError:
        return b""


async def test_an_unplugged_radio_is_opened_again_when_it_is_back(monkeypatch, tmp_path):
    monkeypatch.setattr(serial_line, "_RETRY_PAUSE", 0.01)
    device = tmp_path / "radio"
    first = terminal()
    device.symlink_to(os.ttyname(first[1]))
    async with network(f"serial://{device}:57600") as (net, _, vehicle):
        assert len(net.clients) == 1
        device.unlink()
        for descriptor in first:
            os.close(descriptor)
        await until(lambda: not net.clients)
        await asyncio.sleep(0.05)  # it is tried several times meanwhile
        assert not net.clients
        ours, theirs = terminal()
        device.symlink_to(os.ttyname(theirs))
        await until(lambda: len(net.clients) == 1)
        os.write(ours, ARM.pack(dialect.MAVLink(None, *GROUND)))
        await vehicle.hears("COMMAND_LONG")
        vehicle.send(TEXT(4, b"back again"))
        heard = bytearray()
        await until(lambda: heard.extend(read(ours)) or b"back again" in heard)
    for descriptor in (ours, theirs):
        os.close(descriptor)


async def test_a_radio_that_is_away_when_we_end_is_not_opened_any_more(monkeypatch, tmp_path):
    monkeypatch.setattr(serial_line, "_RETRY_PAUSE", 0.02)
    device = tmp_path / "radio"
    first, second = terminal(), terminal()
    device.symlink_to(os.ttyname(first[1]))
    async with network(f"serial://{device}:57600") as (net, _, _):
        for descriptor in first:
            os.close(descriptor)
        await until(lambda: not net.clients)
    device.unlink()
    device.symlink_to(os.ttyname(second[1]))
    await asyncio.sleep(0.06)
    assert not net.clients
    for descriptor in second:
        os.close(descriptor)


async def test_a_slow_radio_gets_whole_frames_and_what_does_not_fit_is_counted():
    ours, theirs = terminal()
    async with network(f"serial://{os.ttyname(theirs)}:57600") as (net, _, _):
        (client,) = net.clients
        packer = dialect.MAVLink(None, 1, 191)
        for number in range(6000):
            net.send(TEXT(6, b"%d" % number).pack(packer))
            if number % 50 == 0:
                net.flush()
        assert client.stats.dropped > 0
        parser, heard = dialect.MAVLink(None), []
        expected = 6000 - client.stats.dropped

        def listen():
            heard.extend(parser.parse_buffer(read(ours)) or ())  # raises if a frame is cut
            net.flush()
            return len(heard) >= expected

        await until(listen)
        numbers = [int(message.text) for message in heard]
        assert numbers == sorted(set(numbers))
        assert client.stats.sent == len(heard) == expected
    for descriptor in (ours, theirs):
        os.close(descriptor)


async def test_a_tcp_port_in_use_is_one_clear_error():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(EndpointError, match=rf"serve\.clients: TCP .*:{port}: .*use"):
            async with network("udpin://127.0.0.1:0", f"tcpin://127.0.0.1:{port}"):
                pass


async def test_one_tcp_client_too_many_is_refused_and_the_others_stay(monkeypatch):
    monkeypatch.setattr(tcp, "_MAX_CLIENTS", 2)
    async with network("tcpin://127.0.0.1:0") as (net, _, vehicle):
        port = net.ports[0].local[1]
        clients = [await tcp_client(port, (255, 1)), await tcp_client(port, (255, 2))]
        await until(lambda: len(net.clients) == 2)
        refused = socket.create_connection(("127.0.0.1", port))
        refused.setblocking(False)

        def closed():
            try:
                return refused.recv(1) == b""
            except BlockingIOError:
                return False
            except ConnectionResetError:
                return True

        await until(closed)
        refused.close()
        assert len(net.clients) == 2
        for client in clients:
            client.send(ARM)
        await vehicle.hears("COMMAND_LONG", 2)
        clients[0].close()
        await until(lambda: len(net.clients) == 1)
        await tcp_client(port, (255, 3))
        await until(lambda: len(net.clients) == 2)


async def test_a_tcp_program_that_does_not_listen_yet_is_called_when_it_does(monkeypatch):
    monkeypatch.setattr(tcp, "_RETRY_PAUSE", 0.01)
    port = free_port()
    async with network(f"tcp://127.0.0.1:{port}") as (net, _, _):
        await asyncio.sleep(0.05)
        assert not net.clients
        writers = []
        server = await asyncio.start_server(
            lambda _, writer: writers.append(writer), "127.0.0.1", port
        )
        await until(lambda: writers and net.clients)
    server.close()
    writers[0].close()


async def test_reading_from_a_tcp_client_that_floods_pauses_and_goes_on():
    async with network("tcpin://127.0.0.1:0") as (net, _, _):
        client = await tcp_client(net.ports[0].local[1])
        await until(lambda: net.clients)
        (ours,) = net.clients
        raw = heartbeat().pack(client.mav)
        client.socket.send(100 * raw)
        await until(lambda: ours.stats.received == 100)
        client.socket.send(raw)
        for _ in range(3):
            await asyncio.sleep(0)
        assert ours.stats.received == 100
        await until(lambda: ours.stats.received == 101)


async def test_one_udp_client_too_many_is_ignored_until_a_silent_one_is_forgotten(monkeypatch):
    monkeypatch.setattr(udp, "_MAX_CLIENTS", 1)
    monkeypatch.setattr(udp, "_SILENCE_TIMEOUT", 0.5)
    async with network() as (net, _, _):
        port = net.ports[0].local[1]
        first, second = await udp_client(port, (255, 1)), await udp_client(port, (255, 2))
        first.send(heartbeat())
        await until(lambda: net.clients)
        (known,) = net.clients
        second.send(heartbeat())
        await asyncio.sleep(0.02)
        assert net.clients == (known,)
        await until(lambda: not net.clients)
        second.send(heartbeat())
        await until(lambda: net.clients)
        assert net.clients != (known,)


async def test_a_program_named_for_udp_is_not_forgotten_however_silent(monkeypatch):
    monkeypatch.setattr(udp, "_SILENCE_TIMEOUT", 0.0)
    async with network(f"udpout://127.0.0.1:{free_port()}") as (net, _, _):
        port, (client,) = net.ports[0], net.clients
        client.heard_at -= 10.0
        port._expire()
        assert net.clients == (client,)
        for number in range(3):  # nobody listens: the refusals that come back are harmless
            net.send(TEXT(6, b"%d" % number).pack(dialect.MAVLink(None, 1, 191)))
            net.flush()
            await asyncio.sleep(0.01)
        assert net.clients == (client,)


@pytest.mark.parametrize(
    ("error", "sent", "dropped"), [(BlockingIOError(), 0, 40), (ConnectionRefusedError(), 40, 0)]
)
async def test_frames_that_the_kernel_does_not_take_are_counted(error, sent, dropped):
    class Full:
        """A socket that takes nothing."""

        def __init__(self, opened):
            self._opened = opened

        def sendto(self, *_):
            raise error

        def __getattr__(self, name):
            return getattr(self._opened, name)

    async with network() as (net, _, _):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat())
        await until(lambda: net.clients)
        net.flush()
        (ours,) = net.clients
        before = ours.stats.sent
        port = net.ports[0]
        port._socket = Full(port._socket)
        for number in range(40):
            ours.put(TEXT(6, b"%d" % number).pack(dialect.MAVLink(None, 1, 191)))
        ours.flush()
        assert (ours.stats.sent - before, ours.stats.dropped) == (sent, dropped)
        ours.flush()  # nothing of it is left
        assert (ours.stats.sent - before, ours.stats.dropped) == (sent, dropped)


async def test_after_a_stall_only_so_many_frames_of_the_vehicle_wait(monkeypatch):
    monkeypatch.setattr(network_module, "_MAX_VEHICLE_FRAMES", 2)
    async with network() as (net, _, vehicle):
        client = await udp_client(net.ports[0].local[1])
        client.send(heartbeat())
        await until(lambda: net.clients)
        net.flush()
        for number in range(5):
            vehicle.send(TEXT(4, b"%d" % number))
        await until(lambda: net.overflowed == 3)
        await until(lambda: len(client.of("STATUSTEXT")) == 2)
        assert [message.text for message in client.of("STATUSTEXT")] == ["0", "1"]
        vehicle.send(TEXT(4, b"later"))
        await until(lambda: len(client.of("STATUSTEXT")) == 3)
