"""Offboard loss: whether the vehicle stays inside the fence if our setpoints stop in flight.

A fence in latitude and longitude (`safety.fence_polygon_deg`) is not checked here.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import exp, hypot
from typing import NamedTuple

from companion.config import Config
from companion.drag import Drag
from companion.guidance import ManeuverSequence, Pose, Reference
from companion.guidance.fence import Fence
from companion.guidance.offboard_loss import (
    LossFailsafe,
    MotionAtLoss,
    Reach,
    path_thrust,
    reach,
    tilted_thrust,
)
from companion.guidance.reference import Vector
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding, Key
from companion.vehicle.parameter_checks import MAX_RATE_HOLD_TIME, min_rate_hold_time
from companion.vehicle.parameter_rules import CheckResult

_POINT_PERIOD = 0.05
"""Shortest time between the points of the maneuvers that are checked, s."""
_MAX_POINTS = 1500
"""Largest number of checked points; long maneuvers are checked at longer intervals."""
_DERIVATIVE_STEP = 0.02
"""Time step of the finite difference for the rate of change of the thrust, s."""
_START_POSE = Pose((0.0, 0.0, 0.0), 0.0)


class WorstReach(NamedTuple):
    """How far the vehicle can be carried if our setpoints stop at any moment of the maneuvers.

    Attributes:
        largest_distance, climb, fall: largest horizontal distance, climb and fall after the
            setpoints stop, m.
        breach: the first breach of the fence, as the end of a sentence; `None`: no breach.
        breach_time: when setpoints must stop to cause `breach`, s after control begins.
    """

    largest_distance: float = 0.0
    climb: float = 0.0
    fall: float = 0.0
    breach: str | None = None
    breach_time: float = 0.0


def offboard_loss(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """How far the vehicle is carried if our setpoints stop at the worst moment of the flight."""
    failsafe, maneuvers = evidence.autopilot.offboard_loss_failsafe, evidence.maneuvers
    hold_time = evidence.survey.values.get(failsafe.parameter)
    if maneuvers is None or hold_time is None or not 0.0 <= hold_time <= MAX_RATE_HOLD_TIME:
        return  # an unknown or longer time is unsafe, whatever is flown
    drag = evidence.known_drag.lower_bound
    worst = worst_reach(config, maneuvers, hold_time, drag, brakes=failsafe.brakes)
    reach_text = (
        f"if our setpoints stop, the autopilot holds the last rates for {hold_time:g} s "
        f"({failsafe.parameter}); these rates can carry the vehicle "
        f"{worst.largest_distance:.0f} m away, {worst.climb:.0f} m up and {worst.fall:.0f} m down"
    )
    source = "worst case of docs/exits.md"
    if worst.breach is None:
        yield Finding(Key.OFFBOARD_LOSS, CheckResult.SAFE, reach_text, source=source)
        return
    shortest_hold = min_rate_hold_time(config.deadman.silence_limit)
    shorter_hold = (
        f"set {failsafe.parameter} to {shortest_hold:g}, " if hold_time > shortest_hold else ""
    )
    yield Finding(
        Key.OFFBOARD_LOSS,
        CheckResult.INEFFECTIVE,
        reach_text,
        f"if the setpoints stop {worst.breach_time:.1f} s after control begins, the vehicle can "
        f"end {worst.breach}",
        f"{shorter_hold}fly more slowly or with a lower limits.max_tilt_rate_deg_s, or farther "
        "from the fence and the ground",
        source,
    )


def worst_reach(
    config: Config, maneuvers: ManeuverSequence, hold_time: float, drag: Drag, *, brakes: bool
) -> WorstReach:
    """The `WorstReach` over all checked moments of the maneuvers.

    `hold_time`: time for which the autopilot holds the last rates, s. `brakes`: whether the
    failsafe brakes the vehicle; False: the vehicle drifts until its `drag` stops it.
    """
    fence = replace(config.fence, polygon_deg=())
    max_tilt_rate = config.limits.max_tilt_rate
    loss_failsafe, worst = LossFailsafe(hold_time, brakes, drag, max_tilt_rate, fence), WorstReach()
    motion_before: MotionAtLoss | None = None
    for time, motion in _motions_in_maneuvers(config, maneuvers, drag):
        if motion != motion_before:  # in a hover the motion stays the same
            motion_before, reached = motion, reach(motion, loss_failsafe)
        breach, breach_time = worst.breach, worst.breach_time
        if breach is None:
            breach, breach_time = _breach(config, motion.offset, reached, loss_failsafe.fence), time
        worst = WorstReach(
            max(worst.largest_distance, reached.largest_distance),
            max(worst.climb, reached.max_climb),
            max(worst.fall, reached.max_fall),
            breach,
            breach_time,
        )
    return worst


def _breach(config: Config, offset: Vector, reached: Reach, fence: Fence) -> str | None:
    """How the vehicle may breach the fence without setpoints: the end of a sentence, or None.

    `offset`: position when the setpoints stop, relative to where control began, m NED. `reached`:
    how far the vehicle can move from there.
    """
    north, east = offset[0] + reached.stop_position[0], offset[1] + reached.stop_position[1]
    distance = hypot(north, east)
    outward_factor = 1.0 + reached.stop_radius / distance if distance > 0.0 else 1.0
    farthest: Vector = (north * outward_factor, east * outward_factor, offset[2])
    if distance == 0.0:
        farthest = (reached.stop_radius, 0.0, offset[2])
    height = config.flight.takeoff_height_m - offset[2]
    for position, position_height in (
        (farthest, height),
        ((north, east, offset[2] - reached.max_climb), height),
        ((north, east, offset[2]), height - reached.max_fall),
    ):
        breach = fence.breach(position, position_height, None)
        if breach is not None:
            return str(breach)
    return None


def _motions_in_maneuvers(
    config: Config, maneuvers: ManeuverSequence, drag: Drag
) -> Iterator[tuple[float, MotionAtLoss]]:
    """Time (s after control begins) and motion at each checked point of the maneuvers.

    In open-loop steps the tilt follows the attitude law.
    """
    gain = config.planner.gain_per_s
    period = max(_POINT_PERIOD, maneuvers.duration / _MAX_POINTS)
    velocity: Vector = (0.0, 0.0, 0.0)
    offset: Vector = (0.0, 0.0, 0.0)
    tilt = (0.0, 0.0)
    for index in range(int(maneuvers.duration / period) + 1):
        time = index * period
        reference = maneuvers.at(time, _START_POSE)
        if reference.closed_loop:
            offset, velocity = reference.position_ned, reference.velocity_ned
            thrust = path_thrust(reference.acceleration_ned, velocity, drag)
            reference_after = maneuvers.at(time + _DERIVATIVE_STEP, _START_POSE)
            thrust_after = path_thrust(
                reference_after.acceleration_ned, reference_after.velocity_ned, drag
            )
            north_rate, east_rate, down_rate = (
                (b - a) / _DERIVATIVE_STEP for a, b in zip(thrust, thrust_after, strict=True)
            )
            magnitude = hypot(*thrust)
            tilt = (thrust[0] / magnitude, thrust[1] / magnitude)
            yield time, MotionAtLoss(offset, velocity, thrust, (north_rate, east_rate, down_rate))
            continue
        rates, tilt_after = _tilt_step(reference, tilt, gain, period)
        thrust = tilted_thrust(*tilt)
        north_rate, east_rate = (hypot(*thrust) * rate for rate in rates)
        yield time, MotionAtLoss(offset, velocity, thrust, (north_rate, east_rate, 0.0))
        tilt = tilt_after
        north, east, _ = tilted_thrust(*tilt)
        drag_deceleration = drag.deceleration(velocity)
        velocity = (
            velocity[0] + (north - drag_deceleration[0]) * period,
            velocity[1] + (east - drag_deceleration[1]) * period,
            0.0,
        )
        offset = (offset[0] + velocity[0] * period, offset[1] + velocity[1] * period, offset[2])


def _tilt_step(
    reference: Reference, tilt: tuple[float, float], gain: float, period: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Predict the tilt during one `period` (s) of an open-loop step.

    `tilt` is given as acceleration coefficients (north, east); `gain` is that of the planner, 1/s.

    Returns:
        Rates of change of the coefficients at the beginning of the period, 1/s, and the
        coefficients at its end.
    """
    if reference.coefficients is not None:
        tilt_goal = reference.coefficients
        remaining_share = exp(-gain * period)
        north_error, east_error = (
            goal - present for goal, present in zip(tilt_goal, tilt, strict=True)
        )
        tilt_after = (
            tilt_goal[0] - north_error * remaining_share,
            tilt_goal[1] - east_error * remaining_share,
        )
        return (gain * north_error, gain * east_error), tilt_after
    assert reference.body_rates is not None
    north_rate, east_rate = -reference.body_rates.pitch, reference.body_rates.roll
    return (north_rate, east_rate), (tilt[0] + north_rate * period, tilt[1] + east_rate * period)
