"""What others do while a flight is on its way: at a certain phase, or from another station."""

import socket

from pymavlink.dialects.v20 import common

from companion.flight.observer import Silent


class When(Silent):
    """Calls `action` once, when `phase` has been waiting for `after` seconds."""

    def __init__(self, phase, action, after=0.0):
        self.wanted, self.action, self.after, self.phases = phase, action, after, []

    def phase(self, name, waits_for):
        self.phases.append(name)
        if self.after == 0.0:
            self._act(name)

    def waiting(self, name, detail, elapsed, timeout):
        if elapsed >= self.after:
            self._act(name)

    def _act(self, name):
        if name == self.wanted and self.action is not None:
            action, self.action = self.action, None
            action()


def station(mock, command, *parameters):
    """Another station commands: a second sender, which the vehicle obeys."""
    sender = common.MAVLink(None, srcSystem=255, srcComponent=190)
    padded = [*parameters, *[0] * (7 - len(parameters))]
    frame = common.MAVLink_command_long_message(1, 1, command, 0, *padded).pack(sender)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.sendto(frame, ("127.0.0.1", mock.port + 40))
