"""What entered the loops of a recorded flight, in order: samples, steps of guidance, actions."""

from collections.abc import Iterator
from math import isnan
from typing import Any, NamedTuple

from companion.attitude import BodyRates, Target
from companion.control.guidance_command import GuidanceCommand
from companion.control.sample_rows import LoopFlags
from companion.control.step_rows import StepFlags, StepInput
from companion.drag import Drag
from companion.guidance import Reference
from companion.recording.flight_record import FlightRecord, as_recorded
from companion.recording.mcap_file.channels import (
    ACTION,
    ACTIONS,
    ATTITUDE_TARGET,
    GUIDANCE,
    INPUT,
    REASONS,
    SAMPLE,
    SETPOINT,
    TARGET,
)
from companion.recording.mcap_file.fields import Channel
from companion.recording.mcap_file.happenings import ValuesChange
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import (
    AttitudeSample,
    AttitudeTarget,
    AttitudeTargetThrust,
    Battery,
    LocalPosition,
)

_MISFITS = (None, Misfit.NOT_NEWER, Misfit.AHEAD)


class Setpoint(NamedTuple):
    """A setpoint: body rates in rad/s, and thrust 0..1."""

    rates: BodyRates
    thrust: float


class RecordedSample(NamedTuple):
    """A sample, and what the flight made of it.

    Attributes:
        sample: the sample; its time of arrival for latencies is 0.
        flags: the state of the control loop when it arrived.
        checked: when its age was checked before sending, s; NaN: it was not.
        reason: why it is unanswered, of `REASONS`.
        setpoint: what was sent, or None.
    """

    sample: AttitudeSample
    flags: LoopFlags
    checked: float
    reason: str
    setpoint: Setpoint | None


class RecordedStep(NamedTuple):
    """A step of guidance.

    Attributes:
        read: what it read.
        command: what it left with the control loop, or None.
        reference: its reference, or None.
    """

    read: StepInput
    command: GuidanceCommand | None
    reference: Reference | None


class RecordedAction(NamedTuple):
    """What a phase told guidance to do.

    Attributes:
        time: s on our clock.
        name: of `ACTIONS`.
        clock_offset: vehicle time minus our time, s, or None.
        drag: of an earlier flight, or None.
    """

    time: float
    name: str
    clock_offset: float | None
    drag: Drag | None


Entry = RecordedSample | RecordedStep | RecordedAction | ValuesChange | AttitudeTarget


def entries(record: FlightRecord) -> Iterator[Entry]:
    """All entries of a flight, in the order in which the program took them.

    Raises:
        RecordError: one is not as a flight records it.
    """
    with as_recorded(record.folder):
        yield from _in_order(_Messages(record))


def _in_order(messages: "_Messages") -> Iterator[Entry]:
    while (channel := messages.next()) is not None:
        if channel is SAMPLE:
            row = messages.take(SAMPLE)
            yield _sample(row, messages.take(SETPOINT) if row["unanswered"] == 0 else None)
        elif channel is INPUT:
            read = messages.take(INPUT)
            target = messages.take(TARGET) if messages.next() is TARGET else None
            made = messages.take(GUIDANCE) if messages.next() is GUIDANCE else None
            yield _step(read, target, made)
        elif channel is ACTION:
            yield _action(messages.take(ACTION))
        elif isinstance(channel, str):
            yield messages.take_change()
        else:
            row = messages.take(channel)
            if channel is ATTITUDE_TARGET:
                yield AttitudeTarget(int(row["time_boot_ms"]), _quaternion(row))


_Row = dict[str, Any]


class _Messages:
    """The messages of the replayed channels and the changes, in the order of the file."""

    def __init__(self, record: FlightRecord) -> None:
        used = (SAMPLE, SETPOINT, INPUT, TARGET, GUIDANCE, ACTION, ATTITUDE_TARGET)
        known: dict[str, Channel | str] = {"/change": "/change"}
        known |= {channel.topic: channel for channel in used}
        self._order = [known[topic] for topic in record.content.order if topic in known]
        self._changes = iter(record.changes)
        self._rows = {channel.topic: iter(record.rows(channel.name).tolist()) for channel in used}
        self._at = 0

    def next(self) -> Channel | str | None:
        return self._order[self._at] if self._at < len(self._order) else None

    def take_change(self) -> ValuesChange:
        self._at += 1
        return next(self._changes)

    def take(self, channel: Channel) -> _Row:
        names = channel.dtype.names or ()
        if self.next() is not channel:
            return dict.fromkeys(names, float("nan"))
        self._at += 1
        return dict(zip(names, next(self._rows[channel.topic]), strict=True))


def _sample(row: _Row, sent: _Row | None) -> RecordedSample:
    sample = AttitudeSample(
        int(row["time_boot_ms"]),
        row["vehicle_time_s"],
        row["received_s"],
        0,
        _quaternion(row),
        _rates(row, "measured"),
        row["age_s"],
        _MISFITS[row["misfit"]],
        bool(row["age_known"]),
    )
    setpoint = None if sent is None else Setpoint(_rates(sent, "commanded"), sent["thrust"])
    flags = LoopFlags(*(bool(row[name]) for name in LoopFlags._fields))
    return RecordedSample(sample, flags, row["checked_s"], REASONS[row["unanswered"]], setpoint)


def _step(row: _Row, target: _Row | None, made: _Row | None) -> RecordedStep:
    position = None
    if not isnan(row["position_received_s"]):
        position = LocalPosition(
            row["position_received_s"],
            row["position_vehicle_time_s"],
            _vector(row, "position", "m"),
            _vector(row, "velocity", "m_s"),
        )
    battery = thrust = None
    if not isnan(row["battery_received_s"]):
        battery = Battery(row["battery_received_s"], _known(row["battery_v"]), None)
    if not isnan(received := row["autopilot_thrust_received_s"]):
        thrust = AttitudeTargetThrust(received, row["autopilot_thrust"])
    read = StepInput(
        row["time_s"],
        position,
        _known(row["clock_offset_s"]),
        battery,
        thrust,
        _known(row["height_m"]),
        bool(row["armed"]),
        StepFlags(*(bool(row[name]) for name in StepFlags._fields)),
    )
    reference = None
    if made is not None:
        reference = Reference(
            _vector(made, "reference", "m"),
            _vector(made, "reference", "m_s"),
            heading=made["reference_heading_rad"],
            thrust_steps=not made["height_steady"],
        )
    return RecordedStep(read, None if target is None else _command(target), reference)


def _command(row: _Row) -> GuidanceCommand:
    later = None
    if not isnan(row["later_north"]):
        later = Target(*(row[f"later_{name}"] for name in _TARGET))
    free = isnan(row["body_roll_rad_s"])
    return GuidanceCommand(
        Target(*(row[name] for name in _TARGET)),
        row["acceleration_down_m_s2"],
        row["time_s"],
        bool(row["idle"]),
        bool(row["is_step"]),
        None if free else _rates(row, "body"),
        _known(row["thrust"]),
        row["turn_rad"],
        later,
        row["period_s"],
    )


_TARGET = "north", "east", "heading_rad", "heading_rate_rad_s"


def _action(row: _Row) -> RecordedAction:
    linear = row["drag_per_s"]
    drag = None if isnan(linear) else Drag(linear, row["quadratic_drag_per_m"])
    name = ACTIONS[row["action"]]
    return RecordedAction(row["time_s"], name, _known(row["clock_offset_s"]), drag)


def _known(value: float) -> float | None:
    return None if isnan(value) else value


def _quaternion(row: _Row) -> tuple[float, float, float, float]:
    return row["q_w"], row["q_x"], row["q_y"], row["q_z"]


def _rates(row: _Row, prefix: str) -> BodyRates:
    return BodyRates(*(row[f"{prefix}_{axis}_rad_s"] for axis in ("roll", "pitch", "yaw")))


def _vector(row: _Row, prefix: str, unit: str) -> tuple[float, float, float]:
    return row[f"{prefix}_north_{unit}"], row[f"{prefix}_east_{unit}"], row[f"{prefix}_down_{unit}"]
