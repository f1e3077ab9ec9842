"""Converts rows of `flight.mcap` into inputs and outputs of the loops, and into telemetry."""

from math import isnan
from typing import Any, NamedTuple

from companion.attitude import BodyRates, Target
from companion.control.guidance_command import GuidanceCommand
from companion.control.heading_frame import HeadingFrame
from companion.control.sample_rows import LoopFlags
from companion.control.step_rows import StepFlags, StepInput
from companion.drag import Drag
from companion.guidance import Reference
from companion.guidance.reference import VerticalMode
from companion.recording.mcap_file.loop_channels import ACTION_NAMES, UNANSWERED_CODES
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import (
    AttitudeSample,
    AttitudeTarget,
    AttitudeTargetThrust,
    Battery,
    LocalPosition,
)

Row = dict[str, Any]
"""A message of `flight.mcap`: value by column name."""

_TARGET_COLUMNS = "north", "east", "heading_rad", "heading_rate_rad_s"
_MISFIT_BY_CODE = (None, Misfit.NOT_NEWER, Misfit.AHEAD)  # by number in the record


class Setpoint(NamedTuple):
    """A setpoint: body rates in rad/s, and thrust 0..1."""

    rates: BodyRates
    thrust: float


class RecordedSample(NamedTuple):
    """An attitude sample, and the setpoint that the flight sent for the sample, if any."""

    sample: AttitudeSample
    """The sample; `received_ns`, from which latencies are computed, is 0."""
    flags: LoopFlags
    """State of the control loop when the sample arrived."""
    checked_at: float
    """Time when the sample's age was checked before sending, s on our clock; NaN: not checked."""
    reason: str
    """"answered", or why no setpoint was sent; one of `UNANSWERED_CODES`."""
    setpoint: Setpoint | None
    """Setpoint that was sent; None: none was sent."""


class RecordedStep(NamedTuple):
    """A step of the guidance loop."""

    inputs: StepInput
    command: GuidanceCommand | None
    """Command that the step gave to the control loop; None: no command."""
    reference: Reference | None
    """Reference that the step followed; None: the step had no reference."""


class RecordedAction(NamedTuple):
    """A call by which a phase of the flight controlled guidance or the control loop."""

    time: float
    """Time of the call, s on our clock."""
    name: str
    """Name of the call, one of `ACTION_NAMES`."""
    clock_offset: float | None
    """Vehicle time minus our time, s; None: unknown."""
    drag: Drag | None
    """Drag learned in an earlier flight, for the action `drag_prior`; None: there is none."""


class ReplayedVehicle:
    """Telemetry, ground contact and clock of a recorded vehicle, as guidance reads them.

    The attributes are those of `Telemetry`, `Ground` and `Clock` in `companion.control.telemetry`.

    Attributes:
        attitude_target: the newest ATTITUDE_TARGET; None: there was none yet.
    """

    def __init__(self) -> None:
        self.position: LocalPosition | None = None
        self.battery: Battery | None = None
        self.attitude_target_thrust: AttitudeTargetThrust | None = None
        self.attitude_target: AttitudeTarget | None = None
        self.height: float | None = None
        self.armed: bool | None = None
        self.standing = self.may_idle = False
        self.offset: float | None = None

    def set_inputs(self, inputs: StepInput) -> None:
        """Set the attributes to the inputs of the next guidance step.

        A position that was stale in the flight is set to None, so that the replay does not use it.
        """
        self.position = inputs.position if inputs.flags.fresh else None
        self.battery = inputs.battery
        self.attitude_target_thrust = inputs.autopilot_thrust
        self.height, self.armed = inputs.height, inputs.armed
        self.standing, self.may_idle = inputs.flags.standing, inputs.flags.may_idle
        self.offset = inputs.clock_offset

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Always None: the age is unknown, but `set_inputs` has left out stale positions."""
        return None


def recorded_sample(row: Row, setpoint_row: Row | None) -> RecordedSample:
    """The sample in a row of the channel `SAMPLE`, with its setpoint.

    `setpoint_row`: row of `SETPOINT` for the same sample; None: no setpoint was sent.
    """
    sample = AttitudeSample(
        int(row["time_boot_ms"]),
        row["vehicle_time_s"],
        row["received_s"],
        0,
        _quaternion(row),
        _rates(row, "measured"),
        row["age_s"],
        _MISFIT_BY_CODE[row["misfit"]],
        bool(row["age_known"]),
    )
    setpoint = None
    if setpoint_row is not None:
        setpoint = Setpoint(_rates(setpoint_row, "commanded"), setpoint_row["thrust"])
    flags = LoopFlags(*(bool(row[name]) for name in LoopFlags._fields))
    return RecordedSample(
        sample, flags, row["checked_s"], UNANSWERED_CODES[row["unanswered"]], setpoint
    )


def recorded_step(row: Row, target: Row | None, guidance: Row | None) -> RecordedStep:
    """The step in a row of `INPUT`, with its rows of `TARGET` and `GUIDANCE`.

    `target` is None if the step gave no command, `guidance` if it had no reference.
    """
    position = None
    if not isnan(row["position_received_s"]):
        position = LocalPosition(
            row["position_received_s"],
            row["position_vehicle_time_s"],
            _vector(row, "position", "m"),
            _vector(row, "velocity", "m_s"),
        )
    battery = autopilot_thrust = None
    if not isnan(row["battery_received_s"]):
        battery = Battery(row["battery_received_s"], _none_if_nan(row["battery_v"]), None)
    if not isnan(thrust_arrival := row["autopilot_thrust_received_s"]):
        autopilot_thrust = AttitudeTargetThrust(thrust_arrival, row["autopilot_thrust"])
    inputs = StepInput(
        row["time_s"],
        position,
        _none_if_nan(row["clock_offset_s"]),
        battery,
        autopilot_thrust,
        _none_if_nan(row["height_m"]),
        bool(row["armed"]),
        StepFlags(*(bool(row[name]) for name in StepFlags._fields)),
    )
    reference = None
    if guidance is not None:
        reference = Reference(
            _vector(guidance, "reference", "m"),
            _vector(guidance, "reference", "m_s"),
            heading=guidance["reference_heading_rad"],
            vertical=(
                VerticalMode.HEIGHT if guidance["height_steady"] else VerticalMode.HEIGHT_IN_STEPS
            ),
        )
    return RecordedStep(inputs, None if target is None else _command(target), reference)


def _command(row: Row) -> GuidanceCommand:
    later_target = None
    if not isnan(row["later_north"]):
        later_target = Target(*(row[f"later_{name}"] for name in _TARGET_COLUMNS))
    no_body_rates = isnan(row["body_roll_rad_s"])
    return GuidanceCommand(
        Target(*(row[name] for name in _TARGET_COLUMNS)),
        row["acceleration_down_m_s2"],
        row["time_s"],
        bool(row["idle"]),
        bool(row["is_step"]),
        None if no_body_rates else _rates(row, "body"),
        _none_if_nan(row["thrust"]),
        HeadingFrame(row["turn_rad"]),
        later_target,
        row["period_s"],
    )


def recorded_action(row: Row) -> RecordedAction:
    """The action in a row of `ACTION`."""
    linear_drag = row["drag_per_s"]
    drag = None if isnan(linear_drag) else Drag(linear_drag, row["quadratic_drag_per_m"])
    name = ACTION_NAMES[row["action"]]
    return RecordedAction(row["time_s"], name, _none_if_nan(row["clock_offset_s"]), drag)


def attitude_target(row: Row) -> AttitudeTarget:
    """The ATTITUDE_TARGET in a row of the channel `ATTITUDE_TARGET`."""
    return AttitudeTarget(int(row["time_boot_ms"]), _quaternion(row))


def _none_if_nan(value: float) -> float | None:
    return None if isnan(value) else value


def _quaternion(row: Row) -> tuple[float, float, float, float]:
    return row["q_w"], row["q_x"], row["q_y"], row["q_z"]


def _rates(row: Row, prefix: str) -> BodyRates:
    return BodyRates(*(row[f"{prefix}_{axis}_rad_s"] for axis in ("roll", "pitch", "yaw")))


def _vector(row: Row, prefix: str, unit: str) -> tuple[float, float, float]:
    return row[f"{prefix}_north_{unit}"], row[f"{prefix}_east_{unit}"], row[f"{prefix}_down_{unit}"]
