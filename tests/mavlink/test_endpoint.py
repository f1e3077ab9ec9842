"""Endpoints: five notations, and a way out for every mistake."""

import pytest

from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import (
    PeerAddress,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpIn,
    UdpOut,
    parse_endpoint,
)


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("udpin://0.0.0.0:14540", UdpIn("0.0.0.0", 14540)),
        ("udp://:14540", UdpIn("0.0.0.0", 14540)),
        ("udp://0.0.0.0:14540", UdpIn("0.0.0.0", 14540)),
        ("udp://127.0.0.1:14540", UdpIn("127.0.0.1", 14540)),
        ("udpin://127.0.0.1:0", UdpIn("127.0.0.1", 0)),
        ("udpout://drone.local:14580", UdpOut("drone.local", 14580)),
        ("udpout://[::1]:14580", UdpOut("::1", 14580)),
        ("tcp://192.168.1.4:5760", TcpClient("192.168.1.4", 5760)),
        ("tcpin://0.0.0.0:5760", TcpServer("0.0.0.0", 5760)),
        (
            "udpin://0.0.0.0:14540?peer=192.0.2.7",
            UdpIn("0.0.0.0", 14540, (PeerAddress("192.0.2.7"),)),
        ),
        (
            "tcpin://:5760?peer=[fe80::1]:5,drone.local",
            TcpServer("0.0.0.0", 5760, (PeerAddress("fe80::1", 5), PeerAddress("drone.local"))),
        ),
        ("serial:///dev/ttyAMA0:921600", SerialPort("/dev/ttyAMA0", 921600)),
        (" serial://COM3:57600 ", SerialPort("COM3", 57600)),
    ],
)
def test_notations(text, endpoint):
    assert parse_endpoint(text) == endpoint


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("", "is not understood"),
        ("14540", "is not understood"),
        ("http://host:80", "is not understood"),
        ("udpin://0.0.0.0", "needs HOST:PORT"),
        ("udpin://0.0.0.0:port", "needs HOST:PORT"),
        ("udpout://:14540", "names no host"),
        ("tcp://host:0", "outside 1..65535"),
        ("tcp://host:70000", "outside 1..65535"),
        ("udpin://0.0.0.0:14540?peer=", "write .peer=ADDRESS"),
        ("udpin://0.0.0.0:14540?peer=a:0", "write .peer=ADDRESS"),
        ("udpin://0.0.0.0:14540?from=a", "write .peer=ADDRESS"),
        ("udpout://host:14540?peer=a", "names its peer already"),
        ("serial:///dev/ttyAMA0", "needs DEVICE:BAUD"),
        ("serial://ttyAMA0:fast", "needs DEVICE:BAUD"),
    ],
)
def test_mistakes_are_named(text, hint):
    with pytest.raises(EndpointError, match=hint):
        parse_endpoint(text)


_BAUD = "write serial:///dev/ttyACM0:BAUD with the baud rate of the autopilot's port"


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("/dev/ttyACM0", _BAUD),
        ("/dev/ttyACM0:57600", "write serial:///dev/ttyACM0:57600"),
        ("/dev/ttyACM0,57600", "write serial:///dev/ttyACM0:57600"),
        ("ttyACM0:57600", "write serial:///dev/ttyACM0:57600"),
        ("serial:///dev/ttyACM0", _BAUD),
        ("serial://ttyACM0:57600", "write serial:///dev/ttyACM0:57600"),
        ("serial:///dev/ttyACM0:0", _BAUD),
        ("serial:///dev/ttyACM0:fast", _BAUD),
        ("serial:///dev/ttyACM0:", _BAUD),
        (
            "serial:///tmp/port",
            "write serial:///tmp/port:BAUD with the baud rate of the autopilot's",
        ),
        ("serial:/dev/ttyACM0:57600", "write serial:///dev/ttyACM0:57600"),
        ("COM3", "write serial://COM3:BAUD"),
        ("udp:127.0.0.1:14550", "write udpin://127.0.0.1:14550"),
        ("udpin:0.0.0.0:14550", "write udpin://0.0.0.0:14550"),
        ("tcp:192.0.2.7:5760", "write tcp://192.0.2.7:5760"),
        (":14540", "write udpin://0.0.0.0:14540"),
        ("14540", "write udpin://0.0.0.0:14540"),
        (
            "192.0.2.7:14540",
            "write udpin://0.0.0.0:14540 to wait for the vehicle, or udpout://192.0.2.7:14540 to "
            "send to 192.0.2.7 first",
        ),
        ("udp://192.0.2.7:14540", "udpin://0.0.0.0:14540 to wait for the vehicle"),
        ("usb", "write udpin://0.0.0.0:14540, udpout://HOST:PORT"),
    ],
)
def test_the_notation_of_another_program_is_told_ours(text, remedy):
    with pytest.raises(EndpointError) as caught:
        parse_endpoint(text)
    assert remedy in str(caught.value)


def test_a_remedy_is_understood():
    for text in ("/dev/ttyACM0,57600", "udp:127.0.0.1:14550", "tcp:192.0.2.7:5760", "14540"):
        with pytest.raises(EndpointError) as caught:
            parse_endpoint(text)
        parse_endpoint(str(caught.value).partition("write ")[2])
