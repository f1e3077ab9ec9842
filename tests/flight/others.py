"""What others do while a flight is on its way, at a certain phase."""

from pymavlink.dialects.v20 import common as dialect

from companion.flight.observer import SilentObserver


class When(SilentObserver):
    """Calls `action` once, when `phase` has been waiting for `after` seconds."""

    def __init__(self, phase, action, after=0.0):
        self.wanted, self.action, self.after, self.phases = phase, action, after, []

    def phase(self, name, waits_for):
        self.phases.append(name)
        if self.after == 0.0:
            self._act(name)

    def waiting(self, name, waiting_for, elapsed, timeout):
        if elapsed >= self.after:
            self._act(name)

    def _act(self, name):
        if name == self.wanted and self.action is not None:
            action, self.action = self.action, None
            action()


def change_messages(mock, names, change):
    """From here on `change` changes each message of these names that is sent, in place."""
    parser, packer = dialect.MAVLink(None), dialect.MAVLink(None, 1, 1)

    def changed(data):
        sent = b""
        for message in parser.parse_buffer(data) or ():
            if message.get_type() not in names:
                sent += message.get_msgbuf()
                continue
            change(message)
            packer.seq = message.get_seq()
            sent += message.pack(packer)
        return [bytes(sent)] if sent else []

    mock.to_companion = changed
