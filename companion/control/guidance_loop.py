"""The guidance loop: a timer that makes a new command from the newest position."""

from collections.abc import Callable

from companion.attitude import Quaternion, Target, heading, is_unit
from companion.control.command_maker import CommandMaker
from companion.control.control_loop import ControlLoop
from companion.control.flown_source import FlownSource
from companion.control.guidance_command import GuidanceCommand
from companion.control.hold import Hold
from companion.control.hover_learning import HoverLearning
from companion.control.motion_estimate import MotionEstimate
from companion.control.step_recorder import StepRecorder
from companion.control.step_rows import StepFlags, StepOutput
from companion.control.telemetry import GuidedVehicle
from companion.control.ticker import Ticker
from companion.guidance import GuidanceInput, HoverThrust, Pose, Reference, VehicleMotion
from companion.guidance.braking import AssumedBraking
from companion.guidance.linear import Guidance
from companion.guidance.reference import NorthEast
from companion.guidance.source import Source
from companion.recording.trace import FlightTrace
from companion.vehicle.records import AttitudeSample, LocalPosition

_LEVEL_TARGET = Target(0.0, 0.0, 0.0)


class GuidanceLoop:
    """Writes a new `GuidanceCommand` to the control loop at a steady rate while position is fresh.

    On the ground the command is idle until a take-off is commanded. After that, guidance damps the
    motion until it gets a pose. `hold_here` stops and holds a pose; `follow` flies a source from
    that pose. If open-loop rates tilt the vehicle too far, the source ends, and the vehicle brakes
    and holds. Poses and references are in a frame that the estimator's resets do not move.

    Attributes:
        flown_source: the held pose and the source that is flown from it.
        gave_up: True after `give_up`: from then on no source may be flown.
        motion: motion of the vehicle at the last step, in the frame of the poses, or None.
        command_not_finite: True if guidance returned NaN or infinity at the last step.
        acceleration: horizontal acceleration of the vehicle at the last step, m/s², NED.
        tracking_error: `FlownSource.tracking_error` at the last step, m.
        estimate: estimates the motion.
        learning: learns the hover thrust.
        command_maker: makes the commands.
        hold: brakes and holds.
        before_step: called at the beginning of each step with the time, s.
        recorder: records the steps.
    """

    def __init__(
        self,
        loop: ControlLoop,
        guidance: Guidance,
        estimate: MotionEstimate,
        hover_thrust: HoverThrust,
        vehicle: GuidedVehicle,
        trace: FlightTrace,
        *,
        max_tilt: float,
        assumed_braking: AssumedBraking,
        period: float,
        max_position_age: float,
        clock: Callable[[], float],
    ) -> None:
        self.flown_source = FlownSource()
        self.gave_up = False
        self.command_not_finite = False
        self.motion: VehicleMotion | None = None
        self.acceleration: NorthEast = (0.0, 0.0)
        self.tracking_error: float | None = None
        self.estimate = estimate
        self.learning = HoverLearning(hover_thrust, vehicle.state)
        self.command_maker = CommandMaker(
            guidance, self.flown_source, estimate, self.learning, period
        )
        self._loop, self._vehicle = loop, vehicle
        self.hold = Hold(
            self.flown_source, self.command_maker, self.learning, max_tilt, assumed_braking
        )
        self._max_position_age = max_position_age
        self.before_step: Callable[[float], None] = lambda _: None
        self._clock = clock
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._ticker = Ticker(period, clock)
        self.recorder = StepRecorder(trace, self.flown_source, vehicle)

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Use an attitude from now on, if it is a unit quaternion and fits the vehicle's clock."""
        if sample.misfit is None and is_unit(sample.q):
            self._q = sample.q
            self.estimate.note_attitude(sample)

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, or None if it arrived, or was measured, too long ago."""
        return self._vehicle.fresh_position(self._clock(), self._max_position_age)

    def stand_by(self) -> None:
        """Hold no pose: idle on the ground, damp the motion in the air."""
        self.recorder.action(self._clock(), "stand_by")
        self.flown_source.clear()

    def hold_here(self) -> None:
        """Brake, and hold the place where the vehicle stops, with the present heading.

        Raises:
            RuntimeError: no position has come yet.
        """
        now = self._clock()
        self.recorder.action(now, "hold_here")
        self.hold.begin(now, self._heading())

    @property
    def remaining_braking_time(self) -> float:
        """Time until the vehicle has come to rest for a hold, s."""
        return self.flown_source.remaining_braking_time(self._clock())

    def hold_reference(self) -> None:
        """Hold the pose of the present reference, after a maneuver; raises as `hold_here`."""
        now = self._clock()
        self.recorder.action(now, "hold_reference")
        motion = self.command_maker.guidance_input(now).present
        reference = self.flown_source.reference(now, motion, self._heading())(now)
        self.flown_source.clear()
        self.flown_source.pose = Pose(reference.position_ned, reference.heading)

    def give_up(self) -> None:
        """Brake and hold, and never fly a source again; raises as `hold_here`."""
        now = self._clock()
        self.recorder.action(now, "give_up")
        self.gave_up = True
        self.hold.begin(now, self._heading())

    def move_upwind(self) -> None:
        """Move the place of the hold upwind; see `Hold.move_upwind`."""
        now = self._clock()
        self.recorder.action(now, "move_upwind")
        self.hold.move_upwind(now, self.estimate.disturbance)

    def follow(self, source: Source) -> None:
        """Fly `source` from the held pose; after `give_up`, keep holding.

        Without a held pose the source begins where the vehicle would stop if it braked now.

        Raises:
            RuntimeError: no pose is held and no position has come yet.
        """
        if self.gave_up:
            return
        now = self._clock()
        self.recorder.action(now, "follow")
        if self.flown_source.pose is None:
            self.hold.begin(now, self._heading())
        assert self.flown_source.pose is not None
        self.flown_source.begin(source, self.flown_source.pose, now)

    @property
    def finished(self) -> bool:
        """Whether the source has reached its end."""
        return self.flown_source.finished(self._clock())

    async def run(self) -> None:
        """Make commands until cancelled; missed steps are skipped."""
        while True:
            self.step()
            await self._ticker.tick()

    def step_at_once(self) -> None:
        """Make the next command at once, because the source has a new reference."""
        self._ticker.trigger()

    def motion_now(self) -> VehicleMotion:
        """The estimated motion now, in the frame that the estimator's resets do not move.

        Raises:
            RuntimeError: no position has come yet.
        """
        return self.command_maker.guidance_input(self._clock()).present

    def attitude(self) -> Quaternion:
        """The newest attitude, in the frame that the estimator's resets do not move."""
        return self._loop.resets.frame.attitude(self._q)

    def step(self) -> None:
        """Make one command, unless the position is stale or the command would not be finite."""
        now = self._clock()
        self.before_step(now)
        position = self._vehicle.fresh_position(now, self._max_position_age)
        standing = self._vehicle.ground.standing
        may_idle = standing and self._vehicle.ground.may_idle
        command_before, offboard_active = self._loop.command, self._loop.offboard_active
        output = self._step(now, position, standing=standing, may_idle=may_idle)
        command = self._loop.command
        self.recorder.step(
            StepFlags(position is not None, standing, may_idle, offboard_active),
            now,
            output,
            None if command is command_before else command,
        )

    def _step(
        self, now: float, position: LocalPosition | None, *, standing: bool, may_idle: bool
    ) -> StepOutput | None:
        """Make one command; return its inputs and reference, or None if none was computed."""
        if position is None:
            self.learning.hover_thrust.pause()
            return None
        # While offboard is active, a wrong landed flag must not lead to zero thrust: the vehicle
        # would fall. The safety monitors judge the flag.
        standing = standing and not self._loop.offboard_active
        if standing:
            self.learning.hover_thrust.on_ground()
            self._loop.resets.forget()
            if may_idle:
                self._loop.command = GuidanceCommand(_LEVEL_TARGET, 0.0, now, idle=True)
                return None
        position = self._loop.resets.position_without_jumps(position)
        self.estimate.note_heading_resets(self._loop.resets.frame.offset)
        self.estimate.note_position(position, offboard_active=self._loop.offboard_active)
        inputs = self.command_maker.guidance_input(now)
        self.motion, self.acceleration = inputs.present, inputs.acceleration
        self.hold.begin_if_tilted(now, inputs.present, self._q, self._heading())
        reference = self._write_command(now, inputs)
        self.tracking_error = self.flown_source.tracking_error(now, reference, inputs.present)
        if not standing:
            self.learning.step(
                now,
                self._q,
                offboard_active=self._loop.offboard_active,
                steady=reference.thrust_is_steady,
            )
        vehicle_time = self.estimate.vehicle_time(now, position)
        return StepOutput(vehicle_time, self._q, inputs, reference, self.tracking_error)

    def _write_command(self, now: float, inputs: GuidanceInput) -> Reference:
        """Write the command for `now`, unless it would not be finite; return the reference."""
        reference, command = self.command_maker.make(
            now,
            inputs,
            self._heading(),
            self._loop.resets.frame,
            offboard_active=self._loop.offboard_active,
        )
        self.command_not_finite = command is None
        if command is not None:  # else the command before grows stale
            self._loop.command = command
        return reference

    def _heading(self) -> float:
        return heading(self.attitude())
