"""Joins a hostile autopilot and the companion: in memory, or by UDP where ports matter."""

import socket
import threading
import time

from companion.testing.virtual_loop import VirtualClock, VirtualEventLoop
from companion.testing.wire import MemoryTransport
from sitl_mock.link.framing import Framer

_AGAIN_S, _GONE_S = 0.05, 6.0


class MemoryWorld:
    """Makes a step whenever the companion has nothing left to do.

    Args:
        autopilot: the hostile one.
        dialect: pymavlink's.
    """

    def __init__(self, autopilot, dialect):
        self._autopilot, self._dialect = autopilot, dialect
        self._framer = Framer(1, 1)
        self._decoder = dialect.MAVLink(None)
        self._clock, self._transport, self._heard = VirtualClock(0.0), None, None

    def make_loop(self):
        """The companion's event loop."""
        return VirtualEventLoop(self._clock, self)

    async def open(self, _endpoint, receiver, _lost):
        """Open the companion's end."""
        self._transport = MemoryTransport(receiver, self._take)
        return self._transport

    def _take(self, frame):
        self._heard += self._decoder.parse_buffer(frame) or []

    def deliver_due(self):
        """Nothing arrives between two steps."""

    def advance(self, until):
        """Make a step; without an open link or a vehicle, only time passes."""
        if self._transport is None or not self._transport.is_open or self._autopilot.over:
            self._clock.now = until
            return
        heard, self._heard = self._heard, []
        if heard is None:
            frames = []
            self._autopilot.begin()
        else:
            frames = self._autopilot.step(heard)
        time_ms = self._autopilot.beacon_ms
        beacon = self._framer.frame(self._dialect.MAVLink_system_time_message(0, time_ms))
        self._transport.deliver(b"".join((*frames, beacon)), time_ms * 1_000_000)


class SocketThread(threading.Thread):
    """Steps a hostile autopilot over UDP, in strict alternation with the companion.

    Attributes:
        error: what broke in here, or None.
        late_by: is called before the first step.

    Args:
        autopilot: the hostile one.
        wire: its end of the link.
    """

    def __init__(self, autopilot, wire):
        super().__init__(daemon=True)
        self.autopilot, self.error = autopilot, None
        self.wire = autopilot.wire = wire
        self.late_by = lambda: None

    def end(self):
        """Stop, and raise what broke in here."""
        self.wire.ending.set()
        self.join(10.0)
        self.wire.close()
        if self.error is not None:
            raise self.error

    def run(self):
        autopilot = self.autopilot
        try:
            self.late_by()
            autopilot.begin()
            frames = []
            while not self.wire.ending.is_set() and not autopilot.over:
                frames = autopilot.step(self.wire.exchange(frames, autopilot.beacon_ms))
        except Exception as error:  # for the test, which waits in another thread
            self.error = error


class Wire:
    """A UDP socket that sends a step and waits for its answer.

    Attributes:
        ending: set: wait for nothing any more.

    Args:
        port: of the companion on this computer.
        dialect: pymavlink's.
    """

    def __init__(self, port, dialect):
        self.ending = threading.Event()
        self._peer, self._dialect = ("127.0.0.1", port), dialect
        self._framer = Framer(1, 1)
        self._decoder = dialect.MAVLink(None)
        self._socket = _bound()

    def exchange(self, frames, beacon_ms):
        """Send a step's frames and its beacon; returns the messages up to the answer."""
        beacon = self._framer.frame(self._dialect.MAVLink_system_time_message(0, beacon_ms))
        data, messages, answered = b"".join((*frames, beacon)), [], False
        deadline = time.monotonic() + _GONE_S
        while not answered and not self.ending.is_set():
            self._socket.sendto(data, self._peer)
            data = beacon
            answered = self._collect(messages, beacon_ms)
            if time.monotonic() > deadline:
                self.ending.set()
        return messages

    def _collect(self, messages, beacon_ms):
        try:
            while True:
                datagram, sender = self._socket.recvfrom(65536)
                if sender != self._peer:
                    continue
                messages += self._decoder.parse_buffer(datagram) or []
                if any(_closes(message, beacon_ms) for message in messages):
                    return True
        except (TimeoutError, ConnectionRefusedError):
            return False

    def move_to_another_port(self):
        """Go on from another socket, as another vehicle or a restarted router would."""
        self._socket.close()
        self._socket = _bound()

    def send_from_stranger(self, data):
        """Send bytes to the companion from yet another port."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(data, self._peer)

    def close(self):
        self._socket.close()


def _closes(message, beacon_ms):
    answers = message.get_type() in ("SET_ATTITUDE_TARGET", "SYSTEM_TIME")
    return answers and message.time_boot_ms == beacon_ms


def _bound():
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", 0))
    opened.settimeout(_AGAIN_S)
    return opened
