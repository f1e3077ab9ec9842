"""The guidance loop: a timer that makes a new command from the newest position."""

from collections.abc import Callable
from math import degrees, isfinite

from companion.attitude import Quaternion, Target, heading, is_unit
from companion.attitude.kinematics import tilt_angle
from companion.control.control_loop import ControlLoop
from companion.control.flown_source import FlownSource
from companion.control.ground_contact import GroundContact
from companion.control.guidance_command import GuidanceCommand
from companion.control.hover_learning import HoverLearning
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import Predictive
from companion.control.ticker import Ticker
from companion.control.tracking_record import TrackingRecord
from companion.guidance import GRAVITY, GuidanceInput, HoverThrust, Pose, Reference, VehicleMotion
from companion.guidance.linear import Guidance
from companion.guidance.source import Source
from companion.recording.trace import FlightTrace
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample, LocalPosition
from companion.vehicle.state import VehicleState

_LEVEL = Target(0.0, 0.0, 0.0)


class GuidanceLoop:
    """Writes a new `GuidanceCommand` to the control loop at a steady rate, while position is fresh.

    On the ground the command is idle until a take-off is commanded. After that, without a pose, it
    damps the motion; `hold_here` holds a pose; `follow` flies a source from it. If open-loop rates
    tilt the vehicle too far, the source ends and the vehicle holds where it is. Poses and
    references are in the frame without estimator resets, so no reset moves the vehicle.

    Attributes:
        flown: the held pose and the source that is flown from it.
        given_up: why the source was given up, or None.
        bound_to_hold: whether no source may be flown any more; set by `give_up`.
        motion: motion of the vehicle at the last step, without resets, or None.
        off_course: distance from the reference at the last step, m; see
            `FlownSource.tracking_error`.
        predictive: predictive control, which flies trajectories instead of linear guidance, or
            None.
        estimate: estimates the motion.
        learning: learns the hover thrust.
        guidance: makes targets of references.
        max_tilt: largest tilt in open loop, rad.
        before_step: called at the beginning of each step with the time, s.
        record: records how the reference is tracked.
    """

    def __init__(
        self,
        loop: ControlLoop,
        guidance: Guidance,
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
        self.flown = FlownSource()
        self.given_up: str | None = None
        self.bound_to_hold = False
        self.motion: VehicleMotion | None = None
        self.off_course: float | None = None
        self.predictive: Predictive | None = None
        self.estimate = estimate
        self.learning = HoverLearning(hover_thrust, state)
        self._loop = loop
        self.guidance = guidance
        self._state = state
        self._ground = ground
        self.record = TrackingRecord(trace, self.flown)
        self.max_tilt = max_tilt
        self._period = period
        self._position_stale = position_stale
        self.before_step: Callable[[float], None] = lambda _: None
        self._clock = clock
        self._vehicle_clock = vehicle_clock
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._ticker = Ticker(period, clock)

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Keep an attitude that is a unit quaternion and fits the vehicle's clock."""
        if sample.misfit is None and is_unit(sample.q):
            self._q = sample.q
            self.estimate.note_attitude(sample)

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, or None if it arrived, or was measured, too long ago."""
        position, now = self._state.position, self._clock()
        if position is None or now - position.received > self._position_stale:
            return None
        age = self._vehicle_clock.age(position.vehicle_time, now)
        return None if age is not None and age > self._position_stale else position

    def stand_by(self) -> None:
        """Hold no pose: idle on the ground, damp the motion in the air."""
        self.flown.clear()

    def hold_here(self) -> None:
        """Hold the present position and heading.

        Raises:
            RuntimeError: no position has come yet.
        """
        self.stand_by()
        position_ned = self._guidance_input(self._clock()).now.position_ned
        self.flown.pose = Pose(position_ned, self._heading())

    def hold_reference(self) -> None:
        """Hold the pose of the present reference, at which a maneuver has ended."""
        now = self._clock()
        reference = self.flown.reference(now, self.motion_now(), self._heading())(now)
        self.stand_by()
        self.flown.pose = Pose(reference.position_ned, reference.heading)

    def give_up(self) -> None:
        """Hold here, and fly no source any more."""
        self.bound_to_hold = True
        self.hold_here()

    def follow(self, source: Source) -> None:
        """Fly `source` from the held pose; after `give_up`, keep holding."""
        if self.bound_to_hold:
            return
        if self.flown.pose is None:
            self.hold_here()
        assert self.flown.pose is not None
        self.flown.begin(source, self.flown.pose, self._clock())

    @property
    def finished(self) -> bool:
        """Whether the source has no more to fly."""
        return self.flown.finished(self._clock())

    async def run(self) -> None:
        """Make commands until cancelled; missed steps are not repeated."""
        while True:
            self.step()
            await self._ticker.tick()

    def step_soon(self) -> None:
        """Make the next command at once, because the source has a new reference."""
        self._ticker.soon()

    def motion_now(self) -> VehicleMotion:
        """The estimated motion now, in the frame without estimator resets.

        Raises:
            RuntimeError: no position has come yet.
        """
        return self._guidance_input(self._clock()).now

    def attitude(self) -> Quaternion:
        """The newest attitude, in the frame without estimator resets."""
        return self._loop.resets.attitude(self._q)

    def step(self) -> None:
        """Make one command, unless the position is stale."""
        now = self._clock()
        self.before_step(now)
        position = self.fresh_position()
        if position is None:
            self.learning.pause()
            return
        # While offboard is active, a landed flag must not lead to zero thrust, which would make it
        # true; the safety monitors judge it.
        standing = self._ground.standing and not self._loop.offboard_active
        if standing:
            self.learning.on_ground()
            self._loop.resets.forget()
            if self._ground.may_idle:
                self._loop.command = GuidanceCommand(_LEVEL, 0.0, now, idle=True)
                return
        position = self._loop.resets.without_jumps(position)
        self.estimate.turn_to(self._loop.resets.turn)
        self.estimate.note_position(position, offboard_active=self._loop.offboard_active)
        inputs = self._guidance_input(now)
        self.motion = inputs.now
        self._give_up_if_tilted(now, inputs.now)
        reference = self._write_command(now, inputs)
        self.off_course = self.flown.tracking_error(reference, inputs.now)
        if not standing:
            self.learning.step(
                now,
                self._q,
                offboard_active=self._loop.offboard_active,
                steady=reference.height_is_steady,
            )
        if self._loop.offboard_active:
            measured_at = self.estimate.vehicle_time(now, position)
            self.record.add(now, measured_at, reference, inputs.now)

    def _write_command(self, now: float, inputs: GuidanceInput) -> Reference:
        """Write the command for `now`; return the reference from which it was made."""
        reference_at = self.flown.reference(now, inputs.now, self._heading())
        reference = reference_at(now)
        linear = self.guidance.command(reference_at, now, inputs)
        if self.predictive is not None:
            turn = self._loop.resets.turn
            vehicle, following = self.estimate.vehicle(now, inputs), self.flown.following(now, turn)
            linear = self.predictive.instead_of(linear, turn, vehicle, following)
        target, later, down = linear
        # Open-loop steps, predictive control and `InnerResponse.target` ignore the learned limit.
        target, later = (self.learning.limit_tilt(each, down) for each in (target, later))
        if not all(map(isfinite, (*target, *later, down))):
            return reference  # of another package's guidance: the command before grows stale
        self.estimate.vertical = GRAVITY - down if self._loop.offboard_active else GRAVITY
        self._loop.command = GuidanceCommand(
            target,
            down,
            now,
            is_step=reference.coefficients is not None and reference.thrust is None,
            body_rates=reference.body_rates,
            thrust=reference.thrust,
            turn=self._loop.resets.turn,
            later=later,
            period=self._period,
        )
        return reference

    def _heading(self) -> float:
        return heading(self.attitude())

    def _guidance_input(self, now: float) -> GuidanceInput:
        return self.estimate.guidance_input(
            now, self.guidance.acts_after, self.learning.thrust_limits
        )

    def _give_up_if_tilted(self, now: float, motion: VehicleMotion) -> None:
        """Hold here if open-loop rates have tilted the vehicle too far."""
        name = self.flown.steers_by_rates(now, motion)
        if name is None:
            return
        tilt = tilt_angle(self._q[1], self._q[2])
        most = min(self.max_tilt, self.learning.largest_tilt())
        if tilt <= most:
            return
        limit = "limits.max_tilt_deg" if most == self.max_tilt else "the thrust can hold"
        self.given_up = f"{name} was given up at {degrees(tilt):.0f}° of tilt, more than {limit}"
        self.hold_here()
