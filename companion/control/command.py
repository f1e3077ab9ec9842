"""What guidance leaves behind for the control loop."""

from typing import NamedTuple

from companion.attitude import BodyRates, Target
from companion.attitude.representation import wrap_angle


class Command(NamedTuple):
    """One command of guidance, which holds until the next one.

    Attributes:
        target: for the planner; its heading is the one without jumps (`EstimatorResets`).
        acceleration_down: wanted vertical acceleration, m/s².
        made_at: when, s on our clock.
        idle: on the ground: no rates, no thrust.
        is_step: an open-loop step, whose response is measured.
        body_rates: instead of the planner's, rad/s; sent as far as the limits allow.
        turn: sum of the estimate's jumps in heading when it was made, rad.
        later: the target `period` after `made_at`; until then it moves there on a straight line,
            and then it stays. None: `target` stays.
        period: of guidance, s.
    """

    target: Target
    acceleration_down: float
    made_at: float
    idle: bool = False
    is_step: bool = False
    body_rates: BodyRates | None = None
    turn: float = 0.0
    later: Target | None = None
    period: float = 0.0

    def target_at(self, time: float) -> Target:
        """The target at a time, s on our clock: `target`, `later`, or between the two."""
        before, after, elapsed = self.target, self.later, time - self.made_at
        if after is None or not elapsed > 0.0:
            return before
        if elapsed >= self.period:
            return after
        share = elapsed / self.period
        return Target(
            before.north + share * (after.north - before.north),
            before.east + share * (after.east - before.east),
            before.heading + share * wrap_angle(after.heading - before.heading),
            before.heading_rate + share * (after.heading_rate - before.heading_rate),
        )
