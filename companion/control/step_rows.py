"""Converts the record of a guidance step to messages of `flight.mcap`.

As in `companion.control.sample_rows`, the functions run in the recorder's thread.
"""

from math import nan, sqrt
from typing import NamedTuple

from companion.attitude import Quaternion, Target
from companion.control.guidance_command import GuidanceCommand
from companion.control.scene_rows import SceneWriter
from companion.guidance import GuidanceInput, Reference
from companion.guidance.reference import Vector
from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.loop_channels import GUIDANCE, INPUT, TARGET
from companion.recording.mcap_file.writer import McapWriter
from companion.vehicle.records import AttitudeTargetThrust, Battery, LocalPosition

_NO_VECTOR = (nan, nan, nan)
_NO_TARGET = Target(nan, nan, nan, nan)
_SQRT_HALF = sqrt(0.5)
_STEPS_PER_POSE, _STEPS_PER_DRAWING = 2, 5
"""Number of guidance steps per recorded pose, and per drawing of the vehicle."""


class StepFlags(NamedTuple):
    """State of the vehicle at a guidance step."""

    fresh: bool
    """Whether the position is fresh."""
    standing: bool
    """Whether the vehicle stands on the ground."""
    may_idle: bool
    """Whether zero thrust is safe."""
    offboard_active: bool
    """Whether the autopilot obeys the setpoints."""


class StepInput(NamedTuple):
    """The telemetry that a step of guidance reads; None: unknown."""

    time: float
    """When the step began, s of event-loop time."""
    position: LocalPosition | None
    clock_offset: float | None
    """Vehicle time minus event-loop time, s."""
    battery: Battery | None
    autopilot_thrust: AttitudeTargetThrust | None
    """Thrust in ATTITUDE_TARGET."""
    height: float | None
    """Height above home, m."""
    armed: bool | None
    flags: StepFlags
    """State of the vehicle at the step."""


class StepOutput(NamedTuple):
    """The result of a guidance step."""

    vehicle_time: float
    """When the step began, on the vehicle's clock, s."""
    q: Quaternion
    """Newest attitude."""
    inputs: GuidanceInput
    """Motion, wind and drag at the step."""
    reference: Reference
    tracking_error: float | None
    """Distance from the reference, m; None as in `FlownSource.tracking_error`."""


class StepEntry(NamedTuple):
    """Record of a guidance step."""

    inputs: StepInput
    """The telemetry that the step read."""
    output: StepOutput | None
    """Result of the step; None without a fresh position or while idle on the ground."""
    command: GuidanceCommand | None
    """The command for the control loop; None: no new command."""


class StepWriter:
    """Writes the channels of guidance, and the vehicle as 3D viewers draw it (ENU)."""

    def __init__(self) -> None:
        self._scene = SceneWriter()
        self._count = 0

    def step(self, writer: McapWriter, time_ns: int, entry: StepEntry) -> None:
        """Write the inputs, the result and the command of a step."""
        inputs, output, command = entry
        writer.row(INPUT, time_ns, _input_row(inputs))
        if command is not None:
            writer.row(TARGET, time_ns, _target_row(command))
            self._scene.note_command(command)
        if output is not None:
            active = inputs.flags.offboard_active
            writer.row(GUIDANCE, time_ns, (inputs.time, *_guidance_row(output), active))
            self._count += 1
            if self._count % _STEPS_PER_POSE == 0:
                self._draw(writer, time_ns, output)
            if self._count % _STEPS_PER_DRAWING == 0:
                position = _east_north_up(output.inputs.present.position_ned)
                reference = _east_north_up(output.reference.position_ned)
                self._scene.draw(writer, time_ns, output.q, position, reference)

    def _draw(self, writer: McapWriter, time_ns: int, output: StepOutput) -> None:
        pose = (*_east_north_up(output.inputs.present.position_ned), *_enu_from_flu(output.q))
        writer.message("/tf", time_ns, cdr.pose_message(time_ns, pose, "world", "vehicle"))
        writer.message("/pose", time_ns, cdr.pose_message(time_ns, pose, "world"))
        # Drawn with the attitude of the vehicle, because a reference has none.
        reference_pose = (*_east_north_up(output.reference.position_ned), *_enu_from_flu(output.q))
        writer.message("/reference", time_ns, cdr.pose_message(time_ns, reference_pose, "world"))


def _input_row(inputs: StepInput) -> tuple[float, ...]:
    position, battery, thrust = inputs.position, inputs.battery, inputs.autopilot_thrust
    return (
        inputs.time,
        *(
            (nan,) * 8
            if position is None
            else (
                position.received,
                position.vehicle_time,
                *position.position_ned,
                *position.velocity_ned,
            )
        ),
        _nan_if_none(inputs.clock_offset),
        nan if battery is None else battery.received,
        nan if battery is None else _nan_if_none(battery.voltage_v),
        nan if thrust is None else thrust.received,
        nan if thrust is None else thrust.thrust,
        _nan_if_none(inputs.height),
        inputs.armed is True,
        *inputs.flags,
    )


def _target_row(command: GuidanceCommand) -> tuple[float, ...]:
    return (
        command.made_at,
        *command.target,
        *(command.later_target or _NO_TARGET),
        command.acceleration_down,
        *(command.body_rates or _NO_VECTOR),
        _nan_if_none(command.thrust),
        command.frame.offset,
        command.period,
        command.idle,
        command.is_step,
    )


def _guidance_row(output: StepOutput) -> tuple[float, ...]:
    inputs, reference = output.inputs, output.reference
    return (
        output.vehicle_time,
        *reference.position_ned,
        *reference.velocity_ned,
        reference.heading,
        *inputs.present.position_ned,
        *inputs.present.velocity_ned,
        _nan_if_none(output.tracking_error),
        *inputs.disturbance,
        *inputs.drag,
        reference.holds_position,
        reference.holds_height,
        reference.thrust_is_steady,
    )


def _nan_if_none(value: float | None) -> float:
    return nan if value is None else value


def _east_north_up(ned: Vector) -> Vector:
    return ned[1], ned[0], -ned[2]


def _enu_from_flu(q: Quaternion) -> Quaternion:
    """(x, y, z, w) of body FLU → world ENU, from (w, x, y, z) of body FRD → world NED.

    The result is −(0, √½, √½, 0) ⊗ q ⊗ (0, 1, 0, 0): the first factor converts the axes of the
    world, the last factor converts the axes of the body.
    """
    w, x, y, z = q
    return (_SQRT_HALF * (x + y), _SQRT_HALF * (x - y), _SQRT_HALF * (w - z), _SQRT_HALF * (w + z))
