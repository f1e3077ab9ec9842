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
