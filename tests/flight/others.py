"""What others do while a flight is on its way, at a certain phase."""

from companion.flight.observer import SilentObserver


class When(SilentObserver):
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
