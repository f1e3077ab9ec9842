"""Yaw in `model-following`: the planned heading, and the yaw of the body and ArduPilot's target."""

from math import inf, radians

from companion.attitude.history import PlanHistory, locate_time
from companion.attitude.limits import Constants
from companion.attitude.rate_response import AxisResponse, RateLoopResponse
from companion.attitude.reference import first_order_step
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import clamp
from companion.attitude.types import Target


class HeadingModel:
    """Plans the heading ψ: ψ̈ = (v − ψ̇)/τ, v = k·(ψ_d − ψ) + ψ̇_d; v has a limit and a slew limit.

    Args:
        constants: k is `yaw_gain`; `max_yaw_rate` limits v.
        yaw: the vehicle's response in yaw: its lag is τ, its slew limit is that of v.

    Attributes:
        heading: planned heading ψ, rad, not wrapped.
        turn_rate: ψ̇, rad/s.
    """

    def __init__(self, constants: Constants, yaw: AxisResponse) -> None:
        self._lag = yaw.lag
        self._acceleration = yaw.acceleration
        self.retune(constants)
        self.start_at(0.0, 0.0)

    def retune(self, constants: Constants) -> None:
        """Use other gains and limits; the planned heading continues."""
        self._gain = constants.yaw_gain
        self._max_rate = constants.max_yaw_rate
        # Near the target v falls by k·v per second, which must stay within the slew limit.
        if self._gain > 0.0:
            self._max_rate = min(self._max_rate, self._acceleration / self._gain)

    def start_at(self, heading: float, turn_rate: float) -> None:
        """Start at this heading (rad), turning at this rate (rad/s)."""
        self.heading = heading
        self.turn_rate = self._v = turn_rate

    def advance(self, target: Target, dt: float) -> None:
        """Advance by `dt` seconds towards a target that `limited_target` has limited."""
        wanted_v = self._gain * wrap_angle(target.heading - self.heading) + target.heading_rate
        v_change = clamp(wanted_v, self._max_rate) - self._v
        v = self._v = self._v + clamp(v_change, self._acceleration * dt)
        heading_change, self.turn_rate = first_order_step(self.turn_rate, v, self._lag, dt)
        self.heading += heading_change


class YawModel:
    """Predicts the yaw of the body from the yaw rates sent: slew limit, then lag, no dead time.

    Attributes:
        rate: predicted yaw rate, rad/s.
        yaw_angle: yaw angle since the start, rad: the integral of `rate`.
    """

    def __init__(self, response: AxisResponse) -> None:
        self._lag = response.lag
        self._acceleration = response.acceleration
        self.start(0.0)

    def start(self, rate: float) -> None:
        """Start at a steady `rate`, rad/s, and set `yaw_angle` to 0."""
        self.rate = self._slewed_rate = rate
        self.yaw_angle = 0.0

    def advance(self, command: float, dt: float) -> None:
        """Advance by `dt` seconds in which the yaw rate `command` (rad/s) is sent."""
        previous_rate, max_change = self._slewed_rate, self._acceleration * dt
        slewed_rate = self._slewed_rate = (
            previous_rate + clamp(command - previous_rate, max_change)
            if max_change < inf
            else command
        )
        # Uses the slewed rate at the end of the sample, which is at most half a sample early.
        yaw_change, self.rate = first_order_step(self.rate, slewed_rate, self._lag, dt)
        self.yaw_angle += yaw_change


LARGEST_LEAD = radians(45.0)
"""Largest lead in yaw of ArduPilot's attitude target over the body, rad; ArduPilot clamps it."""

OLDEST_ATTITUDE_TARGET = 0.25
"""Largest age of an attitude target that is used, s."""

_TARGET_TO_BODY_DELAY = 0.008
"""Dead time of roll and pitch from ArduPilot's attitude target to the body, s (measured)."""

_TURNS_PER_DROP = 128
"""Number of the oldest turns of a `TargetFrame` that are dropped together."""


class TargetFrame:
    """Heading of ArduPilot's attitude target, along whose axes ArduPilot applies body rates.

    A yaw rate turns the attitude target at once, within its slew limit; the body follows 0.2 s
    later. ATTITUDE_TARGET reports the target's heading; `advance` adds the turn by the yaw
    rates that act on the target after this report.
    """

    def __init__(self, response: RateLoopResponse) -> None:
        self._acceleration = response.yaw.acceleration
        self._lead_time = response.lead_time
        self._delay = max(0.0, response.tilt.dead_time - _TARGET_TO_BODY_DELAY)
        self._times: list[float] = []
        self._target_turns: list[float] = []
        self.forget()

    def forget(self) -> None:
        """Forget the heading of the attitude target."""
        self._time, self._target_time = 0.0, -inf
        self._heading_offset = self._slewed_rate = 0.0
        self._times[:], self._target_turns[:] = [0.0], [0.0]

    def note_heading(self, heading: float, age: float) -> None:
        """Note the attitude target's heading (rad), `age` seconds older than the newest sample.

        A heading older than `OLDEST_ATTITUDE_TARGET`, or newer than the newest sample, is ignored.
        """
        if not 0.0 <= age <= OLDEST_ATTITUDE_TARGET:
            return
        self._target_time = self._time - age
        self._heading_offset = heading - self._turn_until(self._target_time - self._delay)

    def advance(self, yaw_rate: float, heading_hold_rate: float, dt: float) -> None:
        """Advance by `dt` seconds in which `yaw_rate` (rad/s) is sent.

        `heading_hold_rate` is the part of `yaw_rate` that holds the heading.
        """
        if self._target_time == -inf:
            return  # no attitude target was received, so there is no heading to advance
        self._slewed_rate += clamp(yaw_rate - self._slewed_rate, self._acceleration * dt)
        self._time += dt
        times = self._times
        times.append(self._time)
        self._target_turns.append(
            self._target_turns[-1] + (self._slewed_rate - heading_hold_rate) * dt
        )
        if (
            len(times) > _TURNS_PER_DROP
            and times[_TURNS_PER_DROP] < self._time - OLDEST_ATTITUDE_TARGET - self._delay
        ):
            del times[:_TURNS_PER_DROP], self._target_turns[:_TURNS_PER_DROP]

    def lead(self, start_heading: float, plans: PlanHistory) -> float:
        """Predicted yaw lead of the attitude target over the body when rates sent now act, rad.

        The lead is computed from the newest attitude target, or from `RateLoopResponse.lead_time`
        if this attitude target is missing, older than `OLDEST_ATTITUDE_TARGET`, or more than
        `LARGEST_LEAD` from the body.

        Args:
            start_heading: see `FeedForward.advance`.
            plans: plans of tilt and heading.
        """
        target_heading = self.heading()
        if target_heading is not None:
            heading_change = plans.predicted_heading_change(plans.time, plans.tilt.newest)
            lead = wrap_angle(target_heading - start_heading - heading_change.angle)
            if abs(lead) <= LARGEST_LEAD:
                return lead
        return 0.0 if self._lead_time == 0.0 else plans.predicted_yaw_change(self._lead_time)

    def heading(self) -> float | None:
        """Predicted heading of the attitude target when rates sent now act, rad; None: unknown."""
        if self._time - self._target_time > OLDEST_ATTITUDE_TARGET:
            return None
        return self._heading_offset + self._target_turns[-1]

    def _turn_until(self, time: float) -> float:
        """Angle, rad, by which rates sent before `time` turn the attitude target; interpolated."""
        times, turns = self._times, self._target_turns
        if time < times[0]:
            return turns[0]
        if time >= times[-1]:
            return turns[-1]
        later_index, fraction = locate_time(times, time)
        return turns[later_index - 1] + fraction * (turns[later_index] - turns[later_index - 1])
