"""The mock's byte streams: one client per TCP port, a serial line, frames never truncated."""

import os
import socket
import time
import tty

import pytest
from mock_process import HOST, ask, free_port, is_free, mock_process
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.section import ConfigError
from sitl_mock.link.byte_stream import ByteStream
from sitl_mock.link.framing import Framer, decode, split_frames
from sitl_mock.link.serial_endpoint import SerialEndpoint
from sitl_mock.link.tcp_endpoint import TcpEndpoint
from sitl_mock.link.udp_endpoint import UdpEndpoint
from sitl_mock.settings import MockSettings, load_settings

FRAMER = Framer(255, 190)


def pings(count):
    return [FRAMER.frame(dialect.MAVLink_ping_message(n, n, 0, 0)) for n in range(count)]


def soon(condition):
    deadline = time.monotonic() + 5.0
    while not (found := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.001)
    return found


@pytest.fixture
def tcp():
    endpoint = TcpEndpoint(HOST, free_port())
    endpoint.port = int(endpoint.address.rpartition(":")[2])
    yield endpoint
    endpoint.close()


def test_ports_above_the_largest_are_refused():
    with pytest.raises(ConfigError, match="no UDP port 65536; choose a smaller --port"):
        UdpEndpoint(65536, 14540, "--port")
    with pytest.raises(ConfigError, match="no TCP port 65536 for vehicle 3"):
        MockSettings(endpoint="tcpin://127.0.0.1:65534").for_vehicle(2)


def test_a_tcp_port_takes_one_client_and_sends_the_second_off(tcp):
    assert not tcp.connected
    with socket.create_connection((HOST, tcp.port)) as first:
        soon(lambda: tcp.connected)
        with socket.create_connection((HOST, tcp.port), timeout=5.0) as second:
            soon(lambda: tcp.receive() is None)
            assert second.recv(1) == b""
        frame = pings(1)[0]
        first.sendall(frame)
        assert soon(tcp.receive) == (frame, True)
        tcp.send([frame])
        assert first.recv(4096) == frame
    soon(lambda: tcp.receive() is None and not tcp.connected)
    with socket.create_connection((HOST, tcp.port)):
        soon(lambda: tcp.connected)


def test_a_busy_tcp_port_is_one_clear_error(tcp):
    with pytest.raises(ConfigError, match="--endpoint"):
        TcpEndpoint(HOST, tcp.port)


def test_frames_are_found_in_bytes_however_they_are_cut(tcp):
    frames = pings(20)
    data = b"\x00noise" + b"".join(frames)
    with socket.create_connection((HOST, tcp.port)) as client:
        soon(lambda: tcp.connected)
        found = []
        for start in range(0, len(data), 17):
            client.sendall(data[start : start + 17])
            while (received := tcp.receive()) is not None:
                found.append(received[0])
        while len(found) < len(frames):
            found.append(soon(tcp.receive)[0])
    assert found == frames


def test_a_full_line_drops_whole_frames_and_cuts_none():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.setblocking(False)
        stream = ByteStream(ours.fileno())
        frames = pings(256)
        for _ in range(100):
            stream.send(frames)
        theirs.setblocking(False)
        heard = bytearray()
        for _ in range(100):
            try:
                heard += theirs.recv(1 << 20)
            except BlockingIOError:
                stream.send([])
        whole, rest = split_frames(bytes(heard))
        assert set(whole) <= set(frames)
        assert (b"".join(whole), rest) == (bytes(heard), b"")
        assert len(whole) < 100 * len(frames)


def test_a_serial_line_has_a_name_loses_what_nobody_hears_and_survives_a_hang_up(tmp_path):
    link = tmp_path / "vehicle"
    link.symlink_to("/dev/a-mock-that-was-killed")
    endpoint = SerialEndpoint(link)
    frames = pings(3)
    try:
        assert endpoint.descriptors == []
        endpoint.send([frames[0]])
        for _ in range(2):
            device = os.open(link, os.O_RDWR | os.O_NOCTTY)
            tty.setraw(device)
            endpoint.send([frames[1]])
            assert os.read(device, 4096) == frames[1]
            os.write(device, frames[2])
            assert soon(endpoint.receive) == (frames[2], True)
            os.close(device)
            assert endpoint.receive() is None
    finally:
        endpoint.close()
    assert not link.is_symlink()


def test_a_link_that_cannot_be_made_is_one_clear_error(tmp_path):
    (tmp_path / "taken").write_text("a file of somebody's")
    with pytest.raises(ConfigError, match="choose another path"):
        SerialEndpoint(tmp_path / "taken")
    assert (tmp_path / "taken").read_text() == "a file of somebody's"


@pytest.mark.parametrize("bad", ["tcp://127.0.0.1:1", "tcpin://h", "tcpin://h:70000", "serial://a"])
def test_an_endpoint_that_is_none_is_one_clear_error(bad):
    with pytest.raises(ConfigError, match=r"mock\.endpoint: not an endpoint; write udp"):
        load_settings(None, {"endpoint": bad})


def test_each_vehicle_has_an_endpoint_of_its_own():
    endpoints = [
        MockSettings(endpoint=endpoint).for_vehicle(1).endpoint
        for endpoint in ("udp", "tcpin://127.0.0.1:5760", "serial:///tmp/vehicle", "serial://")
    ]
    assert endpoints == ["udp", "tcpin://127.0.0.1:5761", "serial:///tmp/vehicle-2", "serial://"]


def test_nothing_boots_before_the_client_is_there():
    port, control = free_port(), free_port()
    arguments = ("--endpoint", f"tcpin://{HOST}:{port}", "--gcs-port", 0, "--control-port", control)
    with mock_process(*arguments, "--speed", 20):
        soon(lambda: not is_free(control))
        time.sleep(0.1)  # a vehicle that did not wait would have flown 2 s by then
        assert ask(control, {"state": True})["time"] == 0.0
        with socket.create_connection((HOST, port), timeout=5.0) as client:
            first = decode(client.recv(4096))
            assert "HEARTBEAT" in {message.get_type() for message in first}
            soon(lambda: ask(control, {"state": True})["time"] > 0.0)
