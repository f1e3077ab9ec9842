"""Samples that do not come regularly, and a plan that is to be followed all the same."""

_SHARE = 0.05
"""Of a sample's period in the one that is expected next."""


class SampleHold:
    """Turns a planned motion into rates that are held until the next sample, whenever that comes.

    The plan reaches ahead of now by the period that is expected. Where a sample comes later or
    earlier (PX4's come after 4 or 8 ms, ArduPilot's some in pairs), the vehicle has turned further
    than planned or less far, roll and pitch by different amounts, and a step would bend. So the
    next answer makes up for it, but after a pause no more than is due for one period.

    Attributes:
        late: how much later than expected the sample came, s.
        step: by how much the plan is to move on, s.
    """

    __slots__ = ("_pitch", "_roll", "_share", "late", "period", "step")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget what was sent."""
        self.period = self.late = self.step = self._roll = self._pitch = self._share = 0.0

    def take(self, dt: float) -> None:
        """Take the time since the last sample, s."""
        before = self.period or dt
        self.late = late = dt - before
        # Never so much shorter that the plan would stand still.
        self.period = period = before + _SHARE * max(min(late, before), -0.5 * dt / _SHARE)
        self.step = period + late
        self._share = min(late / period, 1.0)

    def rates(self, roll: float, pitch: float) -> tuple[float, float]:
        """What to send, given the mean rates of the plan's newest step, all in rad/s."""
        self._roll = roll + self._share * (roll - self._roll)
        self._pitch = pitch + self._share * (pitch - self._pitch)
        return self._roll, self._pitch
