"""Keeps the fence of served flights in place until the vehicle is disarmed."""

from math import dist

from companion.config import Config
from companion.control.estimator_resets import EstimatorResets
from companion.guidance.fence import FenceCentre
from companion.guidance.reference import Vector, minus
from companion.safety.table import fence_of
from companion.vehicle.link import Link


class KeptFence:
    """Keeps the centre of the fence from one flight to the next.

    Otherwise a client could move the fence by releasing control and requesting it again.

    A vehicle does not move when its estimator resets the position, or when somebody sets another
    origin of its local frame. So the centre moves with these jumps, as it does in flight, and the
    fence stays where it is over the ground. After jumps of more than `safety.max_reset_m`, which
    would end a flight, control is refused: the position before them may have been wrong.

    Args:
        config: configuration of the vehicle.
        link: link to the vehicle.
    """

    def __init__(self, config: Config, link: Link) -> None:
        self._kept: FenceCentre | None = None
        self._fence, self._state = fence_of(config), link.state
        self._most_shift = config.safety.max_reset_m
        self._resets = EstimatorResets()
        self._shift_when_kept: Vector = (0.0, 0.0, 0.0)
        link.subscribe("HEARTBEAT", self._forget_if_disarmed)
        link.subscribe("LOCAL_POSITION_NED", self._find_jump)

    @property
    def centre(self) -> FenceCentre | None:
        """Centre of the fence in the first flight since the vehicle was armed; None: none yet.

        It is given in the autopilot's present local frame.
        """
        if self._kept is None:
            return None
        back = minus(self._shift_when_kept, self._resets.shift)
        return self._kept._replace(position_ned=minus(self._kept.position_ned, back))

    def keep(self, centre: FenceCentre | None) -> None:
        """Keep the centre of a flight that has ended; an earlier flight's centre takes precedence.

        Nothing is kept if the vehicle is disarmed.
        """
        if self._kept is None and self._state.armed is not False:
            self._kept, self._shift_when_kept = centre, self._resets.shift

    def refusal(self) -> str | None:
        """Why control must not begin; None if it may.

        It must not if the vehicle is outside the fence, or the place of the fence is not certain.
        """
        position, kept = self._state.position, self.centre
        if kept is None or position is None:
            return None
        shift = dist(self._resets.shift, self._shift_when_kept)
        if shift > self._most_shift:
            return (
                f"the estimator has moved the position by {shift:.1f} m since the first flight, "
                "more than safety.max_reset_m, so it is not certain where the fence lies; land and "
                "disarm"
            )
        offset = minus(position.position_ned, kept.position_ned)
        breach = self._fence.breach(offset, self._state.height, kept.place)
        if breach is None:
            return None
        return f"outside the fence of the first flight: {breach}; fly back, or land and disarm"

    def _forget_if_disarmed(self, _: object) -> None:
        if self._state.armed is False:
            self._kept = None

    def _find_jump(self, _: object) -> None:
        if self._state.position is not None:
            self._resets.without_jumps(self._state.position)
