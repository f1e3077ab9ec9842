"""What one of roll and pitch is sent, so that it turns as planned when it answers."""

from collections.abc import Callable
from math import cos, sin
from typing import NamedTuple

from companion.attitude.history import History, PlannedTilt
from companion.attitude.kinematics import into_body
from companion.attitude.rate_response import AxisResponse

ROLL, PITCH = 0, 1


class Turn(NamedTuple):
    """How the body is expected to have turned when what is planned for a time acts.

    Attributes:
        angle: of its heading, from a base that each sample measures anew, rad.
        rate: rad/s.
    """

    angle: float
    rate: float


TurnWhen = Callable[[float, PlannedTilt], Turn]
"""The turn when that plan, for this time (s), acts."""


class AxisLead:
    """Leads the planned rate of one axis by that axis's own lag: ω + τ·ω̇ + σ·ω̈.

    The axis that answers sooner waits, so that what is planned for one time acts on both at once.

    Args:
        index: `ROLL` or `PITCH`.
        axis: its response.
        wait: by how long it answers sooner than the other one, s.
        past: the plan, up to the newest row.
    """

    __slots__ = ("_index", "_lag", "_past", "_plan", "_square", "_turn", "_wait")

    def __init__(
        self, index: int, axis: AxisResponse, wait: float, past: History[PlannedTilt]
    ) -> None:
        self._index = index
        self._lag, self._square = axis.lag, axis.square
        self._wait = wait
        self._past = past

    def advance(self, time: float, turn_when: TurnWhen) -> None:
        """Go on to what acts when the newest row, of `time` (s), acts on the slower axis."""
        planned_for = time - self._wait
        self._plan = self._past.at(planned_for) if self._wait else self._past.newest
        self._turn = turn_when(planned_for, self._plan)

    def command(self, time: float, dt: float, heading: float, turn_when: TurnWhen) -> float:
        """The rate to send for the sample of `dt` seconds that ends at `time` of the plan, rad/s.

        At each end of the sample it is seen from the heading that the body is expected to have
        there, so that what turns with the body is led with it.

        Args:
            time: of the newest row, s.
            dt: s.
            heading: the base of the turns, rad.
            turn_when: how the body will have turned.
        """
        rate, slope = self._seen(heading)
        self.advance(time, turn_when)
        rate_then, slope_then = self._seen(heading)
        return (
            0.5 * (rate + rate_then)
            + self._lag / dt * (rate_then - rate)
            + self._square / dt * (slope_then - slope)
        )

    def _seen(self, base: float) -> tuple[float, float]:
        """The planned rate about our axis of the body, rad/s, and its slope, rad/s²."""
        plan, heading = self._plan, base + self._turn.angle
        cosine, sine = cos(heading), sin(heading)
        roll, pitch = into_body(cosine, sine, plan.x, plan.y)
        roll_slope, pitch_slope = into_body(cosine, sine, plan.x_slope, plan.y_slope)
        if self._index == ROLL:
            return roll, roll_slope + self._turn.rate * pitch
        return pitch, pitch_slope - self._turn.rate * roll
