"""The setpoints that reached the autopilot of a mock vehicle."""

from typing import Any, NamedTuple


class ReceivedSetpoint(NamedTuple):
    """A SET_ATTITUDE_TARGET that reached the autopilot.

    Attributes:
        time: vehicle time when the setpoint was handled, s.
        sample_time_boot_ms: time stamp of the sample to which the setpoint responds, ms.
        rates: body rates about x, y, z (FRD), rad/s.
        thrust: normalised thrust, 0..1.
    """

    time: float
    sample_time_boot_ms: int
    rates: tuple[float, float, float]
    thrust: float


def received_setpoint(message: Any, time: float) -> ReceivedSetpoint | None:
    """The setpoint in a message that is handled at vehicle time `time`, s; None: no setpoint."""
    if message.get_type() != "SET_ATTITUDE_TARGET":
        return None
    rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
    return ReceivedSetpoint(time, message.time_boot_ms, rates, message.thrust)
