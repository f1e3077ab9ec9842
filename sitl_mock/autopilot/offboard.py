"""The offboard stream: what was asked last, and whether it is alive."""

from sitl_mock.autopilot.setpoints import Setpoint

DETECTION_US = 60_000
"""How much later than COM_OF_LOSS_T the loss is seen (measured: 1.06 to 1.11 s for 1.0 s)."""


class OffboardStream:
    """The setpoints that count, and when they came (vehicle time in us)."""

    def __init__(self) -> None:
        self.setpoint: Setpoint | None = None
        self.received = 0
        self.last_us: int | None = None
        self.fresh = False

    def accept(self, setpoint: Setpoint, now_us: int) -> None:
        """Take a setpoint as the newest; it stays in force until the next."""
        self.setpoint = setpoint
        self.received += 1
        self.last_us = now_us
        self.fresh = True

    def take_fresh(self) -> bool:
        """Whether a setpoint came since the last call."""
        fresh, self.fresh = self.fresh, False
        return fresh

    def alive(self, now_us: int, loss_s: float) -> bool:
        """Whether the stream counts as alive with COM_OF_LOSS_T = ``loss_s``."""
        if self.last_us is None:
            return False
        return now_us - self.last_us <= round(loss_s * 1e6) + DETECTION_US
