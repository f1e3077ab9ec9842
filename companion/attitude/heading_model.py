"""How `model-following` plans the heading: second order, the short way, within the limits."""

from companion.attitude.constants import Constants
from companion.attitude.lag import behind
from companion.attitude.rate_response import AxisResponse
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import within
from companion.attitude.types import Target


class HeadingModel:
    """ψ̈ = (v − ψ̇)/τ with v = k·(ψ_d − ψ) + ψ̇_d, limited in itself and in how fast it changes.

    Args:
        constants: gains and limits.
        yaw: the vehicle's response; τ is its lag.

    Attributes:
        heading: rad, not wrapped.
        turn_rate: its speed, rad/s.
    """

    __slots__ = ("_acceleration", "_fastest", "_gain", "_lag", "_v", "heading", "turn_rate")

    def __init__(self, constants: Constants, yaw: AxisResponse) -> None:
        self._gain = constants.yaw_gain
        self._lag = yaw.lag
        self._acceleration = yaw.acceleration
        # Near the target v falls by k·v a second.
        self._fastest = constants.max_yaw_rate
        if self._gain > 0.0:
            self._fastest = min(self._fastest, yaw.acceleration / self._gain)
        self.place(0.0, 0.0)

    def place(self, heading: float, turn_rate: float) -> None:
        """Start at this heading (rad), turning at this rate (rad/s)."""
        self.heading = heading
        self.turn_rate = self._v = turn_rate

    def advance(self, target: Target, dt: float) -> None:
        """Move on by `dt` seconds towards an admissible target."""
        wanted = self._gain * wrap_angle(target.heading - self.heading) + target.heading_rate
        change = within(wanted, self._fastest) - self._v
        v = self._v = self._v + within(change, self._acceleration * dt)
        moved, self.turn_rate = behind(self.turn_rate, v, self._lag, dt)
        self.heading += moved
