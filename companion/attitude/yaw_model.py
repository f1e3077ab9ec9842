"""How the body will turn about its z axis under the yaw rates it was sent."""

from math import inf

from companion.attitude.lag import behind
from companion.attitude.rate_response import AxisResponse
from companion.attitude.rotation import within


class YawModel:
    """The yaw axis's answer but for its dead time: limit of acceleration, then lag.

    Attributes:
        rate: rad/s.
        turned: its integral, rad.

    Args:
        response: of yaw.
    """

    __slots__ = ("_acceleration", "_aimed", "_lag", "rate", "turned")

    def __init__(self, response: AxisResponse) -> None:
        self._lag = response.lag
        self._acceleration = response.acceleration
        self.start(0.0)

    def start(self, rate: float) -> None:
        """Turn steadily at `rate` rad/s, and count from here."""
        self.rate = self._aimed = rate
        self.turned = 0.0

    def advance(self, command: float, dt: float) -> None:
        """Hold the yaw rate `command` (rad/s) for `dt` seconds."""
        before, most = self._aimed, self._acceleration * dt
        aimed = self._aimed = before + within(command - before, most) if most < inf else command
        # The aim as it stands at the end of a short sample: within half a sample of the truth.
        moved, self.rate = behind(self.rate, aimed, self._lag, dt)
        self.turned += moved
