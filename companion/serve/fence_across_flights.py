"""Keeps the fence in place from one client's flight to the next, until the vehicle is disarmed."""

from math import dist

from companion.config import Config
from companion.control.estimator_resets import EstimatorResets
from companion.guidance.fence import FenceCentre
from companion.guidance.reference import Vector, minus
from companion.safety.table import fence_of
from companion.vehicle.link import Link


class FenceAcrossFlights:
    """Keeps the centre of the fence from one flight to the next.

    If each flight had its own centre, a client could move the fence by requesting control anew.

    The estimated position jumps, without a motion of the vehicle, when the estimator is reset or
    somebody sets another origin of the local frame. The centre moves with these jumps, as it does
    in flight, so the fence stays where it is over the ground. Jumps of more than
    `safety.max_reset_m` would end a flight. After such jumps control is refused, because the
    position before them may have been wrong.
    """

    def __init__(self, config: Config, link: Link) -> None:
        self._first_centre: FenceCentre | None = None
        self._fence, self._state = fence_of(config), link.state
        self._max_shift = config.safety.max_reset_m
        self._resets = EstimatorResets()
        self._shift_at_first_flight: Vector = (0.0, 0.0, 0.0)
        link.subscribe("HEARTBEAT", self._forget_if_disarmed)
        link.subscribe("LOCAL_POSITION_NED", self._note_position)

    @property
    def centre(self) -> FenceCentre | None:
        """Centre of the fence in the first flight since the vehicle was armed; None: no flight yet.

        The centre is in the autopilot's present local frame.
        """
        if self._first_centre is None:
            return None
        negative_shift = minus(self._shift_at_first_flight, self._resets.position_shift)
        position = minus(self._first_centre.position_ned, negative_shift)
        return self._first_centre._replace(position_ned=position)

    def set_first_centre(self, centre: FenceCentre | None) -> None:
        """Keep the centre of a flight that has ended; an earlier flight's centre takes precedence.

        Nothing is kept if the vehicle is disarmed.
        """
        if self._first_centre is None and self._state.armed is not False:
            self._first_centre, self._shift_at_first_flight = centre, self._resets.position_shift

    def refusal(self) -> str | None:
        """Why control must not begin; None if it may.

        Possible reasons: the vehicle is outside the fence, or the fence's position is uncertain.
        """
        position, kept_centre = self._state.position, self.centre
        if kept_centre is None or position is None:
            return None
        shift = dist(self._resets.position_shift, self._shift_at_first_flight)
        if shift > self._max_shift:
            return (
                f"the estimator has moved the position by {shift:.1f} m since the first flight, "
                "more than safety.max_reset_m, so it is not certain where the fence lies; land and "
                "disarm"
            )
        offset = minus(position.position_ned, kept_centre.position_ned)
        breach = self._fence.breach(offset, self._state.height, kept_centre.lat_lon)
        if breach is None:
            return None
        return f"outside the fence of the first flight: {breach}; fly back, or land and disarm"

    def _forget_if_disarmed(self, _: object) -> None:
        if self._state.armed is False:
            self._first_centre = None

    def _note_position(self, _: object) -> None:
        if self._state.position is not None:
            self._resets.position_without_jumps(self._state.position)
