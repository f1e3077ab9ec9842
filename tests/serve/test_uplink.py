"""Clients' frames on their way to the vehicle."""

from companion.mavlink.transport.endpoint import parse_endpoint
from companion.serve.network.uplink import UplinkQueue, uplink_limits


class Line:
    def __init__(self):
        self.now, self.sent, self.open = 0.0, [], True

    def send(self, frame):
        if self.open:
            self.sent.append(frame)
        return self.open

    def uplink(self, rate=1000.0, burst=100.0):
        return UplinkQueue(self.send, rate, burst, lambda: self.now)


def test_a_serial_line_keeps_half_of_its_bytes_for_us():
    rate, burst = uplink_limits(parse_endpoint("serial:///dev/ttyS0:57600"))
    assert rate == 2880.0
    assert burst == 280.0


def test_frames_leave_in_order_at_the_given_rate():
    line = Line()
    uplink = line.uplink()
    frames = [bytes([number]) * 50 for number in range(20)]
    for each in frames:
        uplink.put(each, "a")
    while uplink.drain():
        line.now += 0.01
        assert len(b"".join(line.sent)) <= 100 + 1000 * line.now + 50
    assert line.sent == frames
    assert 0.75 < line.now < 1.0


def test_a_flooding_client_delays_no_other():
    line = Line()
    uplink = line.uplink()
    for _ in range(1000):
        uplink.put(b"f" * 50, "flood")
    uplink.put(b"quiet", "quiet")
    uplink.drain()
    assert b"quiet" in line.sent[:2]
    assert uplink.dropped == 1000 - 64


def test_a_frame_that_cannot_leave_waits_and_is_not_lost():
    line = Line()
    uplink = line.uplink()
    uplink.put(b"x", "a")
    line.open = False
    assert uplink.drain()
    line.open = True
    assert not uplink.drain()
    assert line.sent == [b"x"]


def test_what_waited_through_an_outage_is_not_sent_when_the_link_is_back():
    """An arming command that nobody asks for any more must not arm."""
    line = Line()
    uplink = line.uplink()
    line.open = False
    uplink.put(b"arm", "a")
    assert uplink.drain()
    line.now, line.open = 30.0, True
    uplink.put(b"new", "a")
    while uplink.drain():
        line.now += 0.01
    assert line.sent == [b"new"]
    assert uplink.dropped == 1


def test_a_client_that_left_has_nothing_waiting():
    line = Line()
    uplink = line.uplink()
    uplink.put(b"x", "a")
    uplink.put(b"y", "b")
    uplink.forget("a")
    assert not uplink.drain()
    assert line.sent == [b"y"]
