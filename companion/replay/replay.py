"""Replays a recorded flight: the same control and guidance loops get the recorded inputs, in order.

Guidance flies the maneuvers of the configuration again, unless a program or the solver process of
predictive control commanded the flight. The record lacks the inputs of these two; guidance's
recorded commands are used instead, and only the control loop is replayed. Changes of values in
flight are repeated.
"""

from math import isnan
from typing import NamedTuple

from companion.attitude import BodyRates
from companion.config import Config
from companion.config.files import changed
from companion.config.known_drag import KnownDrag, prior_of
from companion.control.loops import make_loops
from companion.control.retuning import Retuning, Slew, loop_settings, reason_against_changes
from companion.control.telemetry import GuidedVehicle
from companion.drag import Drag
from companion.flight.maneuvers import configured_maneuvers
from companion.guidance import Pose, Reference, VehicleMotion
from companion.guidance.reference import ReferenceAt
from companion.guidance.source import ManeuverSource, Source
from companion.mavlink.codec import SetpointEncoder
from companion.recording.flight_record import FlightRecord, record_errors
from companion.recording.mcap_file.flight_events import ValuesChange
from companion.recording.mcap_file.loop_channels import UNANSWERED_CODES
from companion.recording.trace import FlightTrace
from companion.replay.entries import recorded_inputs
from companion.replay.recorded import (
    RecordedAction,
    RecordedSample,
    RecordedStep,
    ReplayedVehicle,
    Setpoint,
)


class ReplayedSample(NamedTuple):
    """One sample, with the setpoints sent for the sample in the flight and in the replay."""

    received: float
    """Arrival of the sample, s on our clock."""
    vehicle_time: float
    """Time stamp of the sample, s."""
    recorded_setpoint: Setpoint | None
    """Setpoint of the flight; None: no setpoint."""
    replayed_setpoint: Setpoint | None
    """Setpoint of the replay; None: no setpoint."""
    recorded_reason: str
    """"answered", or why the flight sent no setpoint; one of `UNANSWERED_CODES`."""
    replayed_reason: str
    """"answered", or why the replay sent no setpoint; one of `UNANSWERED_CODES`."""

    @property
    def is_same(self) -> bool:
        """Whether flight and replay answered the sample in the same way.

        Either both sent bit-identical setpoints, or neither sent a setpoint, for the same reason.
        """
        return (
            self.recorded_setpoint == self.replayed_setpoint
            and self.recorded_reason == self.replayed_reason
        )


class Replay:
    """Replays a flight with its own configuration or another one.

    Attributes:
        follows_record: whether the commands of guidance are those of the record.

    Raises:
        ConfigError: a maneuver of the configuration cannot be flown.
        RecordError: the drag in the record is not valid.
    """

    def __init__(self, record: FlightRecord, config: Config) -> None:
        commanded_by_program = record.metadata["flight"].get("plan") == "program"
        self.follows_record = commanded_by_program or config.guidance.kind == "nmpc"
        self._record = record
        self._now = 0.0
        self._vehicle = vehicle = ReplayedVehicle()
        self._loop, self._guidance = make_loops(
            config,
            self._send,
            GuidedVehicle(vehicle, vehicle, vehicle),
            FlightTrace(),
            lambda: self._now,
            lambda: 0,
        )
        self._loop.is_same_vehicle = lambda: self._same_vehicle
        self._loop.planner.attitude_target = lambda: vehicle.attitude_target
        self._wanted_config, self._slew = config, Slew(config)
        self._retuning = Retuning(self._loop, self._guidance)
        self._guidance.before_step = self._apply_slew
        self._same_vehicle = self._accepts_setpoint = True
        self._sent_setpoint: Setpoint | None = None
        self._encoder = SetpointEncoder(1, 1, 1, 1, signed=False)
        self._recorded_source = _RecordedSource()
        self._source: Source = self._recorded_source
        if not self.follows_record:
            self._source = ManeuverSource(
                configured_maneuvers(config, _assumed_drag(record, config))
            )

    def run(self) -> list[ReplayedSample]:
        """Replay the whole flight; return every sample that reached the control loop.

        Raises:
            RecordError: a recorded input is not valid.
            ConfigError: a recorded change of values does not fit the configuration.
        """
        samples = []
        for entry in recorded_inputs(self._record):
            if isinstance(entry, RecordedSample):
                samples.append(self._replay_sample(entry))
            elif isinstance(entry, RecordedStep):
                self._replay_step(entry)
            elif isinstance(entry, RecordedAction):
                self._replay_action(entry)
            elif isinstance(entry, ValuesChange):
                self._replay_change(entry)
            else:
                self._vehicle.attitude_target = entry
        return samples

    def _replay_sample(self, entry: RecordedSample) -> ReplayedSample:
        loop, flags, sample = self._loop, entry.flags, entry.sample
        loop.on, loop.taking_over = flags.on, flags.taking_over
        loop.offboard_active = flags.offboard_active
        self._same_vehicle = flags.same_vehicle
        if loop.awaiting_mode and not flags.awaiting_mode:
            loop.resume()
        self._accepts_setpoint = entry.reason != "not_sent"
        self._now = sample.received if isnan(entry.checked_at) else entry.checked_at
        self._sent_setpoint = None
        loop.on_sample(sample)
        self._guidance.note_attitude(sample)
        reason = loop.record.reason
        answered, control_off, *_ = UNANSWERED_CODES
        replayed_reason = (
            control_off if not flags.on else answered if reason is None else reason.value
        )
        replayed_setpoint = self._sent_setpoint if replayed_reason == answered else None
        return ReplayedSample(
            sample.received,
            sample.vehicle_time,
            entry.setpoint,
            replayed_setpoint,
            entry.reason,
            replayed_reason,
        )

    def _replay_step(self, entry: RecordedStep) -> None:
        inputs = entry.inputs
        self._vehicle.set_inputs(inputs)
        self._now = inputs.time
        self._loop.offboard_active = inputs.flags.offboard_active
        self._recorded_source.step_reference = entry.reference
        command_before = self._loop.command
        self._guidance.step()
        if self.follows_record:
            self._loop.command = command_before if entry.command is None else entry.command

    def _replay_action(self, entry: RecordedAction) -> None:
        guidance = self._guidance
        self._now, self._vehicle.offset = entry.time, entry.clock_offset
        match entry.name:
            case "drop_command":
                self._loop.drop_command()
            case "restart_planner":
                self._loop.restart_planner()
            case "stop_turning":
                self._loop.end_stream()
            case "drag_prior":
                guidance.estimate.drag.begin(prior_of(entry.drag))
            case "follow":
                guidance.follow(self._source)
            case "stand_by" | "hold_here" | "hold_reference" | "give_up" | "move_upwind" as name:
                getattr(guidance, name)()
            case _:
                raise ValueError(f"unknown action: {entry.name}")

    def _replay_change(self, entry: ValuesChange) -> None:
        """Begin a change of values, if the loops can change values in flight."""
        if reason_against_changes(self._wanted_config) is not None:
            return
        self._wanted_config = changed(self._wanted_config, entry.values, "the record")
        if entry.at_once:
            self._slew.jump(self._wanted_config)
            self._retuning.apply(loop_settings(self._wanted_config))
        else:
            self._slew.begin(self._wanted_config, entry.time)

    def _apply_slew(self, now: float) -> None:
        values = self._slew.step(now)
        if values is not None:
            self._retuning.apply(values)

    def _send(self, time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
        self._encoder.frame(0, time_boot_ms, rates, thrust)  # raises for an invalid setpoint
        self._sent_setpoint = Setpoint(rates, thrust)
        return self._accepts_setpoint


def _assumed_drag(record: FlightRecord, config: Config) -> KnownDrag:
    """The drag assumed for the maneuvers: as configured, else as recorded before the flight."""
    if config.guidance.drag is not None:
        return KnownDrag(config.guidance.drag)
    flight = record.metadata["flight"]
    linear = flight.get("assumed_drag_per_s")
    if linear is None:
        return KnownDrag()
    with record_errors(record.folder):
        return KnownDrag(Drag(float(linear), float(flight.get("assumed_quadratic_drag_per_m", 0))))


class _RecordedSource:
    """Gives guidance the recorded references.

    The commands that guidance computes from these references are replaced by the recorded commands.

    Attributes:
        step_reference: recorded reference of the next step; None: the step had none.
    """

    name = "the record"
    failure: str | None = None

    def __init__(self) -> None:
        self.step_reference: Reference | None = None

    def begin(self, now: float, pose: Pose) -> None:
        """Do nothing: the references are set step by step."""

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The recorded reference of this step."""
        step_reference = self.step_reference
        reference = Reference(motion.position_ned) if step_reference is None else step_reference
        return lambda _: reference

    def finished(self, now: float) -> bool:
        """Always false, because a recorded action ends this source."""
        return False
