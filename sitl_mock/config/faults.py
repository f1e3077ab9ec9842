"""The faults that the configuration or the control channel can inject."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, TypeAdapter, model_validator
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.section import Finite, Fraction, NonNegative, Positive, Section, suggestion

_MESSAGE_CLASSES = {each.msgname: each for each in dialect.mavlink_map.values()}


def _known_message(name: str) -> str:
    if name not in _MESSAGE_CLASSES:
        raise ValueError(f"unknown message {name}{suggestion(name, _MESSAGE_CLASSES)}")
    return name


MessageName = Annotated[str, AfterValidator(_known_message)]
"""The name of a MAVLink message, e.g. ATTITUDE_QUATERNION."""


class TimedFault(Section):
    """Start and duration of a fault, in vehicle time; without a start the fault begins at once."""

    at_s: NonNegative | None = None
    """Vehicle time at which the fault begins; if this time has passed, the fault begins at once."""
    after_offboard_s: NonNegative | None = None
    """Delay of the fault after setpoints first control the vehicle. On PX4 this is when the vehicle
    is first armed in OFFBOARD; on ArduPilot, when it is first in the air in GUIDED under
    SET_ATTITUDE_TARGET."""
    duration_s: Positive | None = None
    """Duration of the fault; without it, the fault does not end."""

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if self.at_s is not None and self.after_offboard_s is not None:
            raise ValueError("give at_s or after_offboard_s, not both")
        return self


class LinkFault(TimedFault):
    """Datagrams of the companion link are dropped, delayed, duplicated, reordered or corrupted.

    ``reorder`` holds a datagram back until the next one has passed. ``corrupt`` changes one byte.

    In the direction to the companion, each frame counts as a datagram, and a lockstep beacon is
    never affected.
    """

    kind: Literal["drop", "delay", "duplicate", "reorder", "corrupt"]
    direction: Literal["to_companion", "from_companion", "both"] = "both"
    probability: Fraction = 1.0
    """Probability with which the fault affects a datagram."""
    delay_ms: NonNegative = 100.0
    """For ``delay``: delay of the datagram in vehicle time."""


class StopTelemetry(TimedFault):
    """Telemetry streams stop; answers are still sent."""

    kind: Literal["stop_telemetry"]
    messages: tuple[MessageName, ...] = ()
    """Names of the messages to stop; empty = all."""


class FreezeClock(TimedFault):
    """Telemetry continues with a constant timestamp."""

    kind: Literal["freeze_clock"]


class SlipClock(TimedFault):
    """The simulation stalls, and the vehicle clock does not catch up; no effect in lockstep."""

    kind: Literal["slip_clock"]
    slip_ms: Annotated[float, Field(gt=0.0, le=60_000.0)] = 12.0
    """Time that the clock loses; ArduPilot's simulator on a busy computer: 10 to 16 ms."""


class NanField(TimedFault):
    """One float field of one message is NaN, on every link of the vehicle."""

    kind: Literal["nan_field"]
    message: MessageName
    field: str

    @model_validator(mode="after")
    def _float_field(self) -> Self:
        message_class = _MESSAGE_CLASSES[self.message]
        field_types = dict(zip(message_class.fieldnames, message_class.fieldtypes, strict=True))
        float_fields = [name for name in field_types if field_types[name] in ("float", "double")]
        if self.field not in float_fields:
            fields = ", ".join(float_fields) or "none"
            raise ValueError(
                f"{self.message} has no float field {self.field!r}; its float fields: {fields}"
            )
        return self


class PilotTakeover(TimedFault):
    """The pilot takes over and changes the mode."""

    kind: Literal["pilot_takeover"]
    mode: Literal["POSCTL", "ALTCTL", "STABILIZED", "MANUAL"] = "POSCTL"
    """Mode of the pilot, by PX4's name. ArduCopter enters LOITER for POSCTL, ALT_HOLD for ALTCTL,
    and STABILIZE for STABILIZED and MANUAL."""


class EstimatorReset(TimedFault):
    """The estimate jumps, and the reset counter (only PX4 sends it, in ODOMETRY) increments."""

    kind: Literal["estimator_reset"]
    yaw_deg: Finite = 0.0
    position_ned_m: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)


class RefuseArming(TimedFault):
    """Arming is refused with a reason."""

    kind: Literal["refuse_arming"]
    reason: str = "system power unavailable"


class LowBattery(TimedFault):
    """The battery charge drops to a value."""

    kind: Literal["low_battery"]
    remaining: Fraction = 0.06


class GpsLoss(TimedFault):
    """GPS loses its fix; the position becomes invalid after EKF2_NOAID_TOUT (ArduPilot: 10 s)."""

    kind: Literal["gps_loss"]


VehicleFault = (
    StopTelemetry
    | FreezeClock
    | SlipClock
    | NanField
    | PilotTakeover
    | EstimatorReset
    | RefuseArming
    | LowBattery
    | GpsLoss
)
Fault = Annotated[LinkFault | VehicleFault, Field(discriminator="kind")]

fault_adapter: TypeAdapter[LinkFault | VehicleFault] = TypeAdapter(Fault)
"""Validates one fault given as a mapping."""
