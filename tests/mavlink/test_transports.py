"""TCP both ways and serial (a pseudo-terminal): cut frames, drops, and nothing stale after them."""

import asyncio
import errno
import os
import pty
import termios
import time
import tty
from contextlib import asynccontextmanager

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink.errors import EndpointError, LinkLost
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport import udp as udp_module
from companion.mavlink.transport.endpoint import SerialPort
from companion.mavlink.transport.serial_port import SerialTransport
from companion.vehicle import connection as connection_module
from companion.vehicle.connection import no_heartbeat_message
from companion.vehicle.link import Link
from tests.mavlink.fakes import FakeVehicle, attitude, frames_of, heartbeat, linked, until

LEVEL = BodyRates(0.0, 0.0, 0.0)


@pytest.fixture(autouse=True)
def quick_reconnect(monkeypatch):
    monkeypatch.setattr(connection_module, "_BACKOFF_FIRST_S", 0.01)


class TcpVehicle(FakeVehicle):
    """A vehicle that listens, or connects."""

    async def listen(self, port=0):
        self.server = await asyncio.start_server(self._serve, "127.0.0.1", port)
        self.address = self.server.sockets[0].getsockname()
        return self

    async def connect(self, address):
        await self._use(*await asyncio.open_connection(*address))
        return self

    async def _serve(self, reader, writer):
        await self._use(reader, writer)

    async def _use(self, reader, writer):
        self.writer = writer
        self.write_with(writer.write)
        self.reading = asyncio.create_task(self._read(reader))
        self.send(heartbeat())

    async def _read(self, reader):
        while data := await reader.read(4096):
            self.take(data)

    def drop(self):
        self.writer.transport.abort()


def tcp(vehicle):
    return LinkSettings(endpoint=f"tcp://127.0.0.1:{vehicle.address[1]}")


async def test_tcp_client_reads_frames_cut_anywhere():
    vehicle = await TcpVehicle().listen()
    async with Link(tcp(vehicle)) as link:
        await link.wait_connected(5.0)
        stamps = []
        link.on_attitude = lambda sample: stamps.append(sample.time_boot_ms)
        [first, second] = frames_of(attitude(4), attitude(8), start=vehicle.mav.seq)
        stream = b"noise" + first + b"\xfd\x00" + second
        for index in range(0, len(stream), 7):
            vehicle.send_raw(stream[index : index + 7])
            await asyncio.sleep(0)
        await until(lambda: len(stamps) == 2)
        assert stamps == [4, 8]
        link.send_setpoint(8, LEVEL, 0.5)
        assert (await vehicle.hears("SET_ATTITUDE_TARGET"))[0].time_boot_ms == 8
    vehicle.server.close()


async def test_after_a_drop_nothing_old_is_sent_and_commands_are_told():
    vehicle = await TcpVehicle().listen()
    async with Link(tcp(vehicle)) as link:
        await link.wait_connected(5.0)
        waiting = asyncio.create_task(link.command(400, 1.0, timeout_s=30.0))
        await vehicle.hears("COMMAND_LONG")
        port = vehicle.address[1]
        vehicle.server.close()
        vehicle.drop()
        with pytest.raises(LinkLost, match="dropped"):
            await waiting
        for stamp in range(50):  # into the void
            link.send_setpoint(stamp, LEVEL, 0.5)
        assert link.stats.not_sent >= 50
        again = await TcpVehicle().listen(port)
        await until(lambda: link.stats.reconnects == 1)
        link.send_setpoint(1000, LEVEL, 0.5)
        setpoints = await again.hears("SET_ATTITUDE_TARGET")
        assert [setpoint.time_boot_ms for setpoint in setpoints] == [1000]
        assert again.of("COMMAND_LONG") == []
        samples = []
        link.on_attitude = samples.append
        again.send(attitude(4))
        await until(lambda: samples)
        again.server.close()


async def test_a_vehicle_that_does_not_read_gets_no_backlog():
    vehicle = TcpVehicle()
    server = await asyncio.start_server(
        lambda reader, writer: vehicle.write_with(writer.write), "127.0.0.1", 0, limit=1
    )
    vehicle.address = server.sockets[0].getsockname()
    async with Link(tcp(vehicle)) as link:
        await asyncio.sleep(0.01)
        connection = link._outbox.transport._connection
        connection.pause_reading()
        for stamp in range(200_000):
            link.send_setpoint(stamp, LEVEL, 0.5)
            if link.stats.not_sent:
                break
        assert link.stats.not_sent
        assert connection.get_write_buffer_size() < 4096
    server.close()


async def test_tcp_server_takes_one_vehicle_and_the_next_after_it():
    async with Link(LinkSettings(endpoint="tcpin://127.0.0.1:0")) as link:
        vehicle = await TcpVehicle().connect(link.local_address)
        await link.wait_connected(5.0)
        _, turned_away = await asyncio.open_connection(*link.local_address)
        vehicle.send(heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        vehicle.drop()
        await until(lambda: link.stats.reconnects == 1)
        turned_away.close()
        again = await TcpVehicle().connect(link.local_address)
        await until(lambda: link.state.mode == "AUTO.LOITER")
        link.send_setpoint(4, LEVEL, 0.5)
        await again.hears("SET_ATTITUDE_TARGET")
        again.drop()


async def test_tcp_errors_say_how_to_mend_them(monkeypatch):
    vehicle = await TcpVehicle().listen()
    port = vehicle.address[1]
    with pytest.raises(EndpointError, match="port is in use"):
        async with Link(LinkSettings(endpoint=f"tcpin://127.0.0.1:{port}")):
            pass
    vehicle.server.close()
    await vehicle.server.wait_closed()
    with pytest.raises(EndpointError, match="running and listening"):
        async with Link(LinkSettings(endpoint=f"tcp://127.0.0.1:{port}")):
            pass


@pytest.mark.parametrize("scheme", ["tcp", "udpout"])
async def test_an_unknown_host_is_said(scheme):
    with pytest.raises(EndpointError, match=r"host .*unknown"):
        async with Link(LinkSettings(endpoint=f"{scheme}://no-such-host.invalid:5760")):
            pass


@pytest.mark.parametrize(
    ("endpoint", "words"),
    [
        ("udpin://192.0.2.1:0", "no interface"),
        ("serial:///dev/ttyNOSUCH:57600", "no such device"),
    ],
)
async def test_an_address_that_is_not_ours_and_a_missing_device_are_said(endpoint, words):
    with pytest.raises(EndpointError, match=words):
        async with Link(LinkSettings(endpoint=endpoint)):
            pass


async def test_serial_both_ways_and_its_end():
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    loop = asyncio.get_running_loop()
    vehicle = FakeVehicle()
    vehicle.write_with(lambda frame: os.write(ours, frame))
    loop.add_reader(ours, lambda: vehicle.take(os.read(ours, 4096)))
    async with Link(LinkSettings(endpoint=f"serial://{os.ttyname(theirs)}:921600")) as link:
        vehicle.send(heartbeat())
        await link.wait_connected(5.0)
        link.on_attitude = lambda sample: link.send_setpoint(sample.time_boot_ms, LEVEL, 0.5)
        vehicle.send(attitude(4))
        assert (await vehicle.hears("SET_ATTITUDE_TARGET"))[0].time_boot_ms == 4
        waiting = asyncio.create_task(link.command(400, timeout_s=30.0))
        await vehicle.hears("COMMAND_LONG")
        loop.remove_reader(ours)
        os.close(theirs)
        os.close(ours)
        with pytest.raises(LinkLost):
            await waiting
        link.send_setpoint(8, LEVEL, 0.5)  # harmless


async def test_a_full_serial_buffer_never_cuts_a_frame():
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    os.set_blocking(ours, False)
    parser = dialect.MAVLink(None)
    async with Link(LinkSettings(endpoint=f"serial://{os.ttyname(theirs)}:921600")) as link:
        stamps, sent = [], 0

        def drain():
            try:
                for message in parser.parse_buffer(os.read(ours, 65536)) or ():
                    if message.get_type() == "SET_ATTITUDE_TARGET":
                        stamps.append(message.time_boot_ms)
            except BlockingIOError:
                pass

        for round_number in range(20):
            for index in range(500):
                before = link.stats.sent
                link.send_setpoint(1000 * round_number + index, LEVEL, 0.5)
                sent += link.stats.sent - before
            drain()
            await asyncio.sleep(0.002)
        assert link.stats.not_sent > 0
        while len(stamps) < sent:
            drain()
            await asyncio.sleep(0.001)
        assert stamps == sorted(stamps)  # pymavlink would raise on a frame that was cut
        assert len(stamps) == sent
    os.close(theirs)
    os.close(ours)


async def test_a_device_in_use_by_another_program_is_said():
    ours, theirs = pty.openpty()
    endpoint = f"serial://{os.ttyname(theirs)}:57600"
    async with Link(LinkSettings(endpoint=endpoint)):
        with pytest.raises(EndpointError, match="in use by another program"):
            async with Link(LinkSettings(endpoint=endpoint)):
                pass
    async with Link(LinkSettings(endpoint=endpoint)):  # free again
        pass
    os.close(theirs)
    os.close(ours)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (PermissionError(errno.EACCES, "Permission denied"), "add yourself to its group"),
        (PermissionError(errno.EPERM, "Operation not permitted"), "add yourself to its group"),
        (OSError(errno.EBUSY, "Device or resource busy"), "in use by another program"),
        (OSError(errno.EIO, "Input/output error"), "no hardware answers under this name"),
        (termios.error(errno.EIO, "Input/output error"), "no hardware answers under this name"),
        (ValueError("no such rate"), "does not take 57600 baud; .* such as 57600 or 921600$"),
        (OSError(errno.ENOSPC, "x"), "at 57600 baud cannot be opened: No space left on device$"),
        (OSError("nothing known"), "at 57600 baud cannot be opened$"),
    ],
)
async def test_why_a_device_cannot_be_opened_is_said(monkeypatch, fault, words):
    def refuse(*_, **__):
        raise fault

    monkeypatch.setattr("serial.Serial", refuse)

    with pytest.raises(EndpointError, match=f"serial /dev/ttyUSB7.*{words}"):
        async with Link(LinkSettings(endpoint="serial:///dev/ttyUSB7:57600")):
            pass


@pytest.mark.parametrize(
    ("device", "words"),
    [
        ("/tmp", "a folder, not a serial device; `ls /dev/serial/by-id`"),
        ("/dev/null", "not a serial device; `ls /dev/serial/by-id`"),
        ("/dev/nothing", "there is no such device; is it plugged in?"),
    ],
)
async def test_what_is_no_serial_device_is_said_without_the_text_of_a_library(device, words):
    with pytest.raises(EndpointError) as caught:
        async with Link(LinkSettings(endpoint=f"serial://{device}:57600")):
            pass
    assert str(caught.value).startswith(f"serial {device}: {words}")
    assert "Errno" not in str(caught.value)


def test_silence_on_a_serial_port_asks_for_the_baud_rate():
    said = no_heartbeat_message(
        LinkSettings(endpoint="serial:///dev/ttyACM0:57600"), LinkStats(), 5.0
    )
    assert said.endswith(
        "within 5 s on serial:///dev/ttyACM0:57600; is the vehicle running, does its port send "
        "MAVLink at this baud rate, and are TX and RX crossed?"
    )
    said = no_heartbeat_message(LinkSettings(endpoint="udpin://0.0.0.0:14540"), LinkStats(), 5.0)
    assert "baud" not in said


@asynccontextmanager
async def serial_transport():
    """A transport on a pseudo-terminal, the other end, and why it was lost."""
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    os.set_blocking(ours, False)
    lost = []
    transport = SerialTransport(SerialPort(os.ttyname(theirs), 57600), lambda *_: True, lost.append)
    try:
        yield transport, ours, lost
    finally:
        transport.close()
        os.close(theirs)
        os.close(ours)


def failing(name, fault, monkeypatch):
    def fail(*_):
        raise fault

    monkeypatch.setattr(f"companion.mavlink.transport.serial_port.os.{name}", fail)


async def test_a_serial_device_that_fails_while_written_is_lost_once_and_not_at_once(monkeypatch):
    async with serial_transport() as (transport, _, lost):
        with monkeypatch.context() as patched:
            failing("write", OSError(errno.EIO, "Input/output error"), patched)
            assert not transport.send(b"one")
            assert not transport.send(b"two")
        assert not lost  # whoever sends is not called back from within
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert lost == ["serial device failed: Input/output error"]
        assert not transport.send(b"three")


async def test_a_serial_device_that_fails_while_read_is_lost(monkeypatch):
    async with serial_transport() as (transport, ours, lost):
        with monkeypatch.context() as patched:
            failing("read", BlockingIOError(), patched)
            transport._read()  # woken for nothing
            assert not lost
            failing("read", OSError(errno.ENODEV, "No such device"), patched)
            os.write(ours, b"x")
            await until(lambda: lost)
        assert lost == ["serial device failed: No such device"]
        assert not transport.send(b"frame")


async def test_the_rest_of_a_frame_waits_for_room_or_ends_the_device(monkeypatch):
    async with serial_transport() as (transport, _, lost):
        frame = bytes(range(256)) * 1024  # more than the terminal takes at once
        assert transport.send(frame)
        assert not transport.send(b"next")  # the frame before it is not finished
        with monkeypatch.context() as patched:
            failing("write", BlockingIOError(), patched)
            transport._write_rest()
            assert not lost
            assert not transport.send(b"next")
            failing("write", OSError(errno.EIO, "Input/output error"), patched)
            transport._write_rest()
        assert lost == ["serial device failed: Input/output error"]


async def test_udp_vehicle_may_come_back_from_another_port(monkeypatch):
    monkeypatch.setattr(udp_module, "PEER_SILENCE_S", 0.05)

    async with linked() as (link, _):
        other = await FakeVehicle(link.local_address).open_udp()

        def heard():
            other.send(heartbeat(0x00060000))
            return link.state.mode == "OFFBOARD"

        await until(heard)
        link.send_setpoint(4, LEVEL, 0.5)
        await other.hears("SET_ATTITUDE_TARGET")
        other.close()


async def test_a_sample_of_udp_is_as_old_as_its_way_through_this_computer():
    """Whoever wakes up late must not count from there."""

    async with linked() as (link, vehicle):
        ages = []
        link.on_attitude = lambda sample: ages.append(time.perf_counter_ns() - sample.received_ns)
        # Linux begins to stamp datagrams a moment after the first socket has asked for it.
        await asyncio.sleep(0.1)
        vehicle.send(attitude(100, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        time.sleep(0.03)  # noqa: ASYNC251 - this process is held up
        await until(lambda: ages)
        assert 0.03e9 <= ages[0] < 1e9
