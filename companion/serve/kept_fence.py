"""Keeps the fence of served flights in place until the vehicle is disarmed."""

from companion.config import Config
from companion.safety.snapshot_builder import FenceCentre
from companion.safety.table import fence_of
from companion.vehicle.link import Link


class KeptFence:
    """Keeps the centre of the fence from one flight to the next.

    Otherwise a client could move the fence by releasing control and requesting it again.

    Args:
        config: configuration of the vehicle.
        link: link to the vehicle.

    Attributes:
        centre: centre of the fence in the first flight since the vehicle was armed; None: none yet.
    """

    def __init__(self, config: Config, link: Link) -> None:
        self.centre: FenceCentre | None = None
        self._fence, self._state = fence_of(config), link.state
        link.subscribe("HEARTBEAT", self._forget_if_disarmed)

    def keep(self, centre: FenceCentre | None) -> None:
        """Keep the centre of a flight that has ended; an earlier flight's centre takes precedence.

        Nothing is kept if the vehicle is disarmed.
        """
        if self.centre is None and self._state.armed is not False:
            self.centre = centre

    def refusal(self) -> str | None:
        """Why control must not begin at the present position, outside the fence; else None."""
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
        return f"outside the fence of the first flight: {breach}; fly back, or land and disarm"

    def _forget_if_disarmed(self, _: object) -> None:
        if self._state.armed is False:
            self.centre = None
