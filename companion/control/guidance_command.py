"""The command that guidance gives to the control loop."""

from typing import NamedTuple

from companion.attitude import BodyRates, Target
from companion.attitude.representation import wrap_angle
from companion.control.heading_frame import HeadingFrame


class GuidanceCommand(NamedTuple):
    """One command from guidance, valid until the next command."""

    target: Target
    """Target of the planner: its north and east part is in the estimator's frame, its heading in
    `frame`."""
    acceleration_down: float
    """Wanted vertical acceleration by thrust and gravity together, positive down, m/s²."""
    made_at: float
    """When guidance made the command, s of event-loop time."""
    idle: bool = False
    """Whether zero body rates and zero thrust are sent; only on the ground."""
    is_step: bool = False
    """Whether the command is part of an open-loop step whose response is measured."""
    body_rates: BodyRates | None = None
    """Body rates that replace the planner's, within the limits, rad/s; None: the planner's are
    sent."""
    thrust: float | None = None
    """Thrust that replaces the one computed from `acceleration_down`, within the limits, 0..1;
    None: the computed thrust is sent."""
    frame: HeadingFrame = HeadingFrame()
    """The frame that heading resets do not turn, as it was when the command was made."""
    later_target: Target | None = None
    """Target at the time `made_at` + `period`; in between, the target is interpolated linearly,
    and later it is constant. None: the target is constant from the beginning."""
    period: float = 0.0
    """Period of the guidance loop, s."""

    def without_turning(self) -> "GuidanceCommand":
        """This command with zero body rates in place of the planner's."""
        return self._replace(body_rates=BodyRates(0.0, 0.0, 0.0), is_step=False)

    def target_at(self, time: float) -> Target:
        """The target at `time` (s of event-loop time), between `target` and `later_target`."""
        target, later_target, elapsed = self.target, self.later_target, time - self.made_at
        if later_target is None or not elapsed > 0.0:
            return target
        if elapsed >= self.period:
            return later_target
        fraction = elapsed / self.period
        return Target(
            target.north + fraction * (later_target.north - target.north),
            target.east + fraction * (later_target.east - target.east),
            target.heading + fraction * wrap_angle(later_target.heading - target.heading),
            target.heading_rate + fraction * (later_target.heading_rate - target.heading_rate),
        )
