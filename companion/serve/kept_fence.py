"""The fence of served flights stays where it is until the vehicle is disarmed."""

from companion.config import Config
from companion.safety.snapshot_builder import FenceCentre
from companion.safety.table import fence_of
from companion.vehicle.link import Link


class KeptFence:
    """Keeps the centre of the fence from one flight to the next.

    Otherwise a client that lets go and asks for control again would take the fence along.

    Args:
        config: of the vehicle.
        link: to the vehicle.

    Attributes:
        centre: of the first flight since the vehicle was armed; None: there was none.
    """

    def __init__(self, config: Config, link: Link) -> None:
        self.centre: FenceCentre | None = None
        self._fence, self._state = fence_of(config), link.state
        link.subscribe("HEARTBEAT", self._forget_if_disarmed)

    def keep(self, centre: FenceCentre | None) -> None:
        """Note the centre of a flight that has ended; that of an earlier one stays.

        A vehicle that is disarmed by then keeps none.
        """
        if self.centre is None and self._state.armed is not False:
            self.centre = centre

    def refusal(self) -> str | None:
        """Why control must not begin where the vehicle is now: outside the fence; else None."""
        position = self._state.position
        if self.centre is None or position is None:
            return None
        north, east, down = (
            here - centre
            for here, centre in zip(position.position_ned, self.centre.position_ned, strict=True)
        )
        breach = self._fence.breach((north, east, down), self._state.height, self.centre.place)
        if breach is None:
            return None
        return f"outside the fence of the first flight: {breach}; fly it back, or land and disarm"

    def _forget_if_disarmed(self, _: object) -> None:
        if self._state.armed is False:
            self.centre = None
