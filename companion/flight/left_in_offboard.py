"""A vehicle that stands disarmed in offboard is asked to hold: it could not be armed again.

PX4's pre-arm checks also fail in AUTO.LAND, where it stays if it was told to land on the ground.

PX4 goes back to the last mode that its user chose when it disarms. After a landing that began in
OFFBOARD, by our command or by its failsafe, that is OFFBOARD, and without setpoints its pre-arm
checks fail there for ever (measured).
"""

from companion.flight.context import FlightContext
from companion.flight.mode_roles import in_role, require_role, roles_of
from companion.flight.orders import change_mode
from companion.mavlink.errors import CommandRefused, CommandTimeout
from companion.safety.ending import Exit, FlightEnded
from companion.vehicle.autopilot import Role

_OFFBOARD = frozenset({Role.OFFBOARD})


async def leave_offboard(
    context: FlightContext, cannot_arm_in: frozenset[Role] = _OFFBOARD
) -> None:
    """Ask a vehicle that stands disarmed in offboard to hold, and wait until it does.

    Nothing is asked of a vehicle that is armed or in any other mode.

    Args:
        context: of the flight.
        cannot_arm_in: what the modes are to a flight that are to be left.

    Raises:
        FlightEnded: Somebody else changed its mode meanwhile, or it does not want to hold.
    """
    if context.armed() or not roles_of(context.link) & cannot_arm_in:
        return
    mode = context.link.state.mode
    context.note(
        f"disarmed in {mode}, in which it cannot be armed again: asking the autopilot to hold"
    )
    context.detail = f"the autopilot to leave {mode}"

    def ours() -> None:
        if context.armed():
            raise FlightEnded("somebody else armed the vehicle", Exit.RELEASE)
        require_role(context.link, cannot_arm_in)

    try:
        await change_mode(
            context, context.link.autopilot.hold(), ours, lambda: in_role(context.link, Role.HOLD)
        )
    except (CommandRefused, CommandTimeout) as error:
        raise FlightEnded(
            f"the vehicle is left disarmed in {mode}, in which it cannot be armed again; "
            f"command another mode ({error})",
            Exit.LEAVE,
        ) from error
