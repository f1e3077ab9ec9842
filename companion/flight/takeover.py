"""The phase before a takeover in the air: a vehicle that somebody else armed and flew there."""

from companion.flight.context import SLOWEST_HEARTBEAT, FlightContext
from companion.flight.preflight_phases import note_heartbeat_rate, report_offboard_loss
from companion.preflight.evidence import Stage
from companion.safety.actions import Exit, FlightEnded


async def look_over(context: FlightContext) -> None:
    """Check a vehicle that flies already; nothing but telemetry is asked of it.

    Raises:
        FlightEnded: it does not fly, or a finding blocks the takeover.
    """
    context.same_vehicle.begin()
    context.same_vehicle.commit()
    context.heartbeat_limit = SLOWEST_HEARTBEAT
    context.detail = "requesting telemetry"
    await context.preflight.ask_for_telemetry()
    state = context.link.state
    await context.until(lambda: state.landed or state.flying, "whether the vehicle flies")
    _require_flying(context)
    await context.until(lambda: context.fresh_position() is not None, "a fresh position")
    context.detail = "counting telemetry rates and reading the autopilot's parameters"
    evidence = await context.preflight.require(Stage.AIRBORNE)
    note_heartbeat_rate(context, evidence)
    report_offboard_loss(context, evidence.survey.values)
    _require_flying(context)
    context.ground.note_flying()


def _require_flying(context: FlightContext) -> None:
    if not context.armed() or not context.link.state.flying:
        raise FlightEnded("the vehicle does not fly: take off first", Exit.LEAVE)
