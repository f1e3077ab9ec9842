"""The control channel: JSON requests that inject faults or return the true state (pure).

Requests, one object each:

- ``{"fault": {"kind": "drop", "probability": 0.5, "duration_s": 3}}``: any fault of the
  configuration; without a start it begins at once -> ``{"ok": true}``
- ``{"clear": true}``: end all faults -> ``{"ok": true}``
- ``{"state": true}``: return the true state -> see `truth`

Anything else -> ``{"error": "..."}``.
"""

import json
from typing import Any

from pydantic import ValidationError

from sitl_mock.config.faults import fault_adapter
from sitl_mock.simulation import Simulation

_USAGE = 'send {"fault": {...}}, {"clear": true} or {"state": true}'


def reply(simulation: Simulation, request: bytes) -> bytes:
    """Execute one request and return the answer, both JSON."""
    return json.dumps(_answer(simulation, request), allow_nan=False).encode()


def _answer(simulation: Simulation, request: bytes) -> dict[str, Any]:
    try:
        requested = json.loads(request)
    except (ValueError, RecursionError):
        return {"error": f"not JSON; {_USAGE}"}
    match requested:
        case {"fault": dict(fault)} if len(requested) == 1:
            return _add_fault(simulation, fault)
        case {"clear": True} if len(requested) == 1:
            simulation.clear_faults()
            return {"ok": True}
        case {"state": True} if len(requested) == 1:
            return truth(simulation)
    return {"error": _USAGE}


def _add_fault(simulation: Simulation, fault: dict[str, Any]) -> dict[str, Any]:
    try:
        valid = fault_adapter.validate_python(fault)
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"])
        return {"error": f"fault {where}: {detail['msg']}".replace("fault :", "fault:")}
    simulation.faults.add(valid, simulation.time_us)
    return {"ok": True}


def truth(simulation: Simulation) -> dict[str, Any]:
    """Return the true state: SI, NED (origin: home on the ground), FRD, q body to world.

    Keys: ``time`` (s), ``armed``, ``mode``, ``intended_mode``, ``failsafe``, ``landed``,
    ``aborted`` (the autopilot's process has ended: it neither flies nor answers),
    ``position``, ``velocity``, ``q``, ``rates``, ``on_ground``, ``crashed``,
    ``touchdown_speed`` (None before the first), ``battery`` (0..1), ``setpoints`` (number
    accepted), ``last_setpoint`` (vehicle time in s, None if none), ``signing`` (None, or the number
    of the companion's frames that were ``accepted``, ``unsigned``, ``refused``).
    """
    state, stream = simulation.state, simulation.stream
    now = simulation.vehicle.truth
    signing = simulation.companion.signing
    touched = now.touchdown_speed == now.touchdown_speed  # not NaN
    return {
        "time": state.time_s,
        "armed": state.armed,
        "mode": state.mode.name,
        "intended_mode": state.intended_mode.name,
        "failsafe": state.failsafe,
        "landed": state.landed,
        "aborted": state.aborted,
        "position": now.position_ned,
        "velocity": now.velocity_ned,
        "q": now.q,
        "rates": now.body_rates,
        "on_ground": now.on_ground,
        "crashed": now.crashed,
        "touchdown_speed": now.touchdown_speed if touched else None,
        "battery": simulation.vehicle.battery.remaining,
        "setpoints": stream.received,
        "last_setpoint": None if stream.last_us is None else stream.last_us / 1e6,
        "signing": None if signing is None else signing.counts(),
    }
