"""The hostile autopilot's UDP socket, and its half of the strict alternation of lockstep."""

import socket
import threading
import time

_AGAIN_S, _GONE_S = 0.05, 6.0


class Wire:
    """Sends a step and waits for its answer.

    Attributes:
        ending: set: wait for nothing any more.

    Args:
        port: of the companion on this computer.
        dialect: pymavlink's.
    """

    def __init__(self, port, dialect):
        self.ending = threading.Event()
        self._peer, self._dialect = ("127.0.0.1", port), dialect
        self._encoder = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self._decoder = dialect.MAVLink(None)
        self._socket = _bound()

    def exchange(self, frames, beacon_ms):
        """Send a step's frames and its beacon; returns the messages up to the answer."""
        beacon = self._dialect.MAVLink_system_time_message(0, beacon_ms).pack(self._encoder)
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
