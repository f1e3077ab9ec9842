"""The control channel: JSON requests that inject faults or return the true state (no sockets).

Requests, one object each:

- ``{"fault": {"kind": "drop", "probability": 0.5, "duration_s": 3}}``: any fault of the
  configuration; without a start it begins at once -> ``{"ok": true}``
- ``{"clear": true}``: end all faults, and cancel those to come -> ``{"ok": true}``
- ``{"state": true}``: return the true state -> see `Truth`

Anything else -> ``{"error": "..."}``.
"""

import json
from collections.abc import Mapping
from math import isnan
from typing import Any, TypedDict

from pydantic import ValidationError

from sitl_mock.config.faults import Fault, fault_adapter
from sitl_mock.config.section import ConfigError, describe_wrong_kind, describe_wrong_value
from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.simulation import Simulation

_USAGE = 'send {"fault": {...}}, {"clear": true} or {"state": true}'


class Truth(TypedDict):
    """The true state of a vehicle, and what its autopilot reports.

    SI; position and velocity NED (origin: where it booted), body rates FRD, q body to world.
    """

    time: float
    """Vehicle time since boot, s."""
    armed: bool
    mode: str
    """Flight mode, by PX4's or ArduCopter's name."""
    intended_mode: str
    """The mode that the user chose last, which a failsafe of PX4 does not change; on ArduPilot
    always equal to ``mode``."""
    failsafe: bool
    landed: bool
    """Whether the autopilot's land detector reports landed."""
    aborted: bool
    """Whether the autopilot's process has ended: it neither flies nor answers."""
    position: Vector
    velocity: Vector
    q: Quaternion
    rates: Vector
    on_ground: bool
    crashed: bool
    touchdown_speed: float | None
    """Sink speed of the last touchdown, m/s; None before the first."""
    battery: float
    """Battery charge, 0..1."""
    setpoints: int
    """Number of setpoints that the autopilot accepted."""
    last_setpoint: float | None
    """Vehicle time of the last setpoint, s; None if there was none."""
    signing: dict[str, int] | None
    """Numbers of validly signed (``accepted``), ``unsigned`` and ``refused`` frames of the
    companion; None: no signing."""


def reply(simulation: Simulation, request: bytes) -> bytes:
    """Execute one request and return the answer, both JSON."""
    return json.dumps(_answer(simulation, request), allow_nan=False).encode()


def add_fault(simulation: Simulation, fault: Mapping[str, Any]) -> None:
    """Inject a fault, given as in the configuration; without a start it begins in the next step.

    Raises:
        ConfigError: the fault has an unknown kind, an unknown key or an invalid value; the message
            names the key.
    """
    if not isinstance(fault, Mapping):
        raise ConfigError(f"a fault is written as {{'kind': 'gps_loss'}}, not as {fault!r}")
    try:
        valid_fault = fault_adapter.validate_python(dict(fault))
    except ValidationError as error:
        error_detail = error.errors()[0]
        key_path = ".".join(str(part) for part in error_detail["loc"])
        wrong_value = f" {key_path}{describe_wrong_value(error)}"
        problem = describe_wrong_kind(error_detail, Fault) or wrong_value
        raise ConfigError(f"fault{problem}") from error
    simulation.faults.add(valid_fault, simulation.time_us)


def _answer(simulation: Simulation, request: bytes) -> Mapping[str, Any]:
    try:
        decoded = json.loads(request)
    except (ValueError, RecursionError):
        return {"error": f"not JSON; {_USAGE}"}
    match decoded:
        case {"fault": dict(fault)} if len(decoded) == 1:
            try:
                add_fault(simulation, fault)
            except ConfigError as error:
                return {"error": str(error)}
            return {"ok": True}
        case {"clear": True} if len(decoded) == 1:
            simulation.clear_faults()
            return {"ok": True}
        case {"state": True} if len(decoded) == 1:
            return truth(simulation)
    return {"error": _USAGE}


def truth(simulation: Simulation) -> Truth:
    """Return the true state of the vehicle, and what its autopilot reports."""
    state, stream = simulation.state, simulation.stream
    true_state = simulation.vehicle.truth
    touchdown_speed = true_state.touchdown_speed
    signing = simulation.companion.signing
    return {
        "time": state.time_s,
        "armed": state.armed,
        "mode": state.mode.name,
        "intended_mode": state.intended_mode.name,
        "failsafe": state.failsafe,
        "landed": state.landed,
        "aborted": state.aborted,
        "position": true_state.position_ned,
        "velocity": true_state.velocity_ned,
        "q": true_state.q,
        "rates": true_state.body_rates,
        "on_ground": true_state.on_ground,
        "crashed": true_state.crashed,
        "touchdown_speed": None if isnan(touchdown_speed) else touchdown_speed,
        "battery": simulation.vehicle.battery.remaining,
        "setpoints": stream.setpoint_count,
        "last_setpoint": None if stream.last_setpoint_us is None else stream.last_setpoint_us / 1e6,
        "signing": None if signing is None else signing.counts(),
    }
