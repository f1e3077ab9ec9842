"""Guidance at work: a timer that makes a fresh command from the newest position."""

import asyncio
from collections.abc import Callable
from math import degrees, dist, nan, sin

from companion.attitude import Quaternion, Target, heading, is_unit
from companion.attitude.kinematics import tilt_angle
from companion.control.command import Command
from companion.control.control_loop import ControlLoop
from companion.control.ground_contact import GroundContact
from companion.control.hover_learning import HoverLearning
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import Following, Predictive
from companion.guidance import (
    GRAVITY,
    GuidanceInput,
    HoverThrust,
    LinearCommand,
    LinearGuidance,
    ManeuverSequence,
    Pose,
    Reference,
    VehicleMotion,
)
from companion.guidance.follow import Follow
from companion.guidance.horizontal import limited
from companion.guidance.linear import ReferenceAt
from companion.recording.trace import FlightTrace
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample, LocalPosition
from companion.vehicle.state import VehicleState

_REJOINED = 1.0
"""Nearer than this to its reference a vehicle is back from open-loop commands, m."""

_LEVEL = Target(0.0, 0.0, 0.0)


class GuidanceLoop:
    """Leaves a new `Command` with the control loop at a steady rate, while position is fresh.

    On the ground the command is idle until a take-off is commanded. From then on, and without a
    maneuver, it damps the motion where the vehicle is; `hold` keeps a pose; `follow` flies a
    maneuver from it. A maneuver's open-loop rates are given up, and the vehicle held where it
    is, once it tilts too far. Jumps of the autopilot's estimate are not chased: poses and
    references go on without them.

    Attributes:
        begun_at: when the maneuver began, s on our clock, or None.
        pose: the pose that is held, or None.
        given_up: why the maneuver was given up, or None.
        bound_to_hold: no maneuver is flown any more; set by `give_up`.
        motion: of the vehicle at the last step, without the jumps of the estimate, or None.
        off_course: distance from the reference at the last step, m; None where none is followed,
            and on the way back to it after open-loop commands.
        predictive: flies trajectories instead of linear guidance, or None.
        estimate: of the motion.
        learning: of the hover thrust.
    """

    def __init__(
        self,
        loop: ControlLoop,
        guidance: LinearGuidance,
        estimate: MotionEstimate,
        hover_thrust: HoverThrust,
        state: VehicleState,
        ground: GroundContact,
        trace: FlightTrace,
        *,
        max_tilt: float,
        period: float,
        position_stale: float,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self.begun_at: float | None = None
        self.pose: Pose | None = None
        self.given_up: str | None = None
        self.bound_to_hold = False
        self.motion: VehicleMotion | None = None
        self.off_course: float | None = None
        self._astray = False
        self.predictive: Predictive | None = None
        self._loop = loop
        self._guidance = guidance
        self.estimate = estimate
        self.learning = HoverLearning(hover_thrust, state)
        self._state = state
        self._ground = ground
        self._trace = trace
        self._max_tilt = max_tilt
        self._period = period
        self._position_stale = position_stale
        self._clock = clock
        self._vehicle_clock = vehicle_clock
        self._maneuvers: ManeuverSequence | None = None
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Keep an attitude that has a heading and fits the vehicle's clock."""
        if sample.misfit is None and is_unit(sample.q):
            self._q = sample.q
            self.estimate.note_attitude(sample)

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, unless it is stale: nothing came since, or it was long under way.

        The latter is told by the vehicle's clock, which every attitude sample keeps up to date.
        """
        position, now = self._state.position, self._clock()
        if position is None or now - position.received > self._position_stale:
            return None
        age = self._vehicle_clock.age(position.vehicle_time, now)
        return None if age is not None and age > self._position_stale else position

    def stand_by(self) -> None:
        """Hold nothing: idle on the ground, damp the motion in the air."""
        self.pose, self._maneuvers, self.begun_at = None, None, None

    def hold_here(self) -> None:
        """Hold the present position and heading."""
        self.stand_by()
        self.pose = Pose(self._situation(self._clock()).now.position_ned, self._heading())

    def give_up(self) -> None:
        """Hold here, and fly no maneuver any more."""
        self.bound_to_hold = True
        self.hold_here()

    def follow(self, maneuvers: ManeuverSequence) -> None:
        """Fly `maneuvers` from the pose that is held; after `give_up`, go on holding."""
        if self.bound_to_hold:
            return
        if self.pose is None:
            self.hold_here()
        self._maneuvers = maneuvers
        self.begun_at = self._clock()

    @property
    def finished(self) -> bool:
        """Whether the maneuver has come to its end."""
        if self._maneuvers is None or self.begun_at is None:
            return False
        return self._clock() - self.begun_at >= self._maneuvers.duration

    async def run(self) -> None:
        """Make commands for ever; late ones are not made up for."""
        due = self._clock()
        while True:
            self.step()
            due = max(due + self._period, self._clock())
            await asyncio.sleep(due - self._clock())

    def step(self) -> None:
        """Make one command, unless position is too old to make it from."""
        now = self._clock()
        position = self.fresh_position()
        if position is None:
            self.learning.pause()
            return
        # In control a vehicle that says it has landed is the watch's matter: no thrust would make
        # it true.
        standing = self._ground.standing and not self._loop.offboard_active
        if standing:
            self.learning.stand()
            self._loop.resets.forget()
            if self._ground.may_idle:
                self._loop.command = Command(_LEVEL, 0.0, now, idle=True)
                return
        position = self._loop.resets.without_jumps(position)
        self.estimate.turn_to(self._loop.resets.turn)
        self.estimate.note_position(position, offboard_active=self._loop.offboard_active)
        situation = self._situation(now)
        self.motion = situation.now
        self._give_up_if_tilted()
        reference_at = self._reference(situation.now)
        reference = reference_at(now)
        command = self._guidance.command(reference_at, now, situation)
        target, later, down = self._predicted(now, command, situation)
        target, later = (self._height_first(each, down) for each in (target, later))
        self.estimate.vertical = GRAVITY - down if self._loop.offboard_active else GRAVITY
        self._loop.command = Command(
            target,
            down,
            now,
            is_step=reference.coefficients is not None,
            body_rates=reference.body_rates,
            turn=self._loop.resets.turn,
            later=later,
            period=self._period,
        )
        self.off_course = self._distance(reference, situation.now)
        if not standing:
            self.learning.step(
                now,
                self._q,
                offboard_active=self._loop.offboard_active,
                steady=reference.height_is_steady,
            )
        if self._loop.offboard_active:
            measured_at = self.estimate.vehicle_time(now, position)
            self._note_tracking(measured_at, reference, situation.now)

    def _heading(self) -> float:
        return heading(self._loop.resets.attitude(self._q))

    def _height_first(self, target: Target, down: float) -> Target:
        """The target with no more tilt than leaves the thrust for its height.

        Whoever made it: open-loop steps, predictive control and the lead do not ask what the
        vehicle's thrust has turned out to be.
        """
        most = sin(self.learning.largest_tilt(down))
        north, east = limited(target.north, target.east, most)
        return target._replace(north=north, east=east)

    def _predicted(
        self, now: float, linear: LinearCommand, situation: GuidanceInput
    ) -> LinearCommand:
        """What predictive control says, if it flies; its headings are the estimate's own.

        Its targets stay for a period, which it accounts for.
        """
        if self.predictive is None:
            return linear
        turn = self._loop.resets.turn
        own = linear.target._replace(heading=linear.target.heading + turn), linear.down
        vehicle = self.estimate.vehicle(now, situation)
        target, down = chosen = self.predictive.command(own, vehicle, self._following(now))
        if chosen is own:
            return linear
        target = target._replace(heading=target.heading - turn)
        return LinearCommand(target, target, down)

    def _distance(self, reference: Reference, motion: VehicleMotion) -> float | None:
        distance = dist(reference.position_ned, motion.position_ned)
        self._astray = not reference.position_is_meant or (self._astray and distance > _REJOINED)
        return None if self.pose is None or self._astray else distance

    def _situation(self, now: float) -> GuidanceInput:
        return self.estimate.situation(now, self._guidance.acts_after, self.learning.thrust_limits)

    def _reference(self, motion: VehicleMotion) -> ReferenceAt:
        """What is to be flown, by our clock."""
        pose, maneuvers, begun_at = self.pose, self._maneuvers, self.begun_at
        if pose is None:
            here = Reference(motion.position_ned, heading=self._heading())
            return lambda _: here
        if maneuvers is None or begun_at is None:
            held = Reference(pose.position_ned, heading=pose.heading)
            return lambda _: held
        return lambda time: maneuvers.at(time - begun_at, pose)

    def _following(self, now: float) -> Following | None:
        """The trajectory that is followed, if that is what is flown just now."""
        if self._maneuvers is None or self.begun_at is None or self.pose is None:
            return None
        part, within = self._maneuvers.part_at(now - self.begun_at)
        if not isinstance(part, Follow):
            return None
        return Following(part, within, self.pose, self._loop.resets.turn)

    def _give_up_if_tilted(self) -> None:
        """Hold where we are if open-loop rates have tilted the vehicle too far."""
        if self.pose is None or self._maneuvers is None or self.begun_at is None:
            return
        tilt = tilt_angle(self._q[1], self._q[2])
        within = self._clock() - self.begun_at
        most = min(self._max_tilt, self.learning.largest_tilt())
        if self._maneuvers.at(within, self.pose).body_rates is None or tilt <= most:
            return
        whose = "limits.max_tilt_deg" if most == self._max_tilt else "the thrust can hold"
        name, lean = self._maneuvers.name, f"{degrees(tilt):.0f}° of tilt"
        self.given_up = f"{name} was given up at {lean}, more than {whose}"
        self.hold_here()

    def _note_tracking(
        self, vehicle_time: float, reference: Reference, motion: VehicleMotion
    ) -> None:
        north, east, down = reference.position_ned
        if not reference.position_is_meant:
            north = east = nan  # open loop: only the height is meant
        self._trace.add_tracking(vehicle_time, (north, east, down), motion.position_ned)
