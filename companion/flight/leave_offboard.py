"""Changes a disarmed vehicle to hold mode if its present mode forbids arming."""

from companion.flight.commands import ask_to_hold, require_role, roles_of
from companion.flight.context import FlightContext
from companion.mavlink.errors import CommandRefused, CommandTimeout
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role

_OFFBOARD_ONLY = frozenset({Role.OFFBOARD})


async def leave_offboard(
    context: FlightContext, roles_forbidding_arming: frozenset[Role] = _OFFBOARD_ONLY
) -> None:
    """Change a disarmed vehicle to hold mode if its mode, such as offboard, forbids arming.

    When PX4 disarms, it returns to the last mode that its user chose: OFFBOARD, if the landing
    began there. PX4's pre-arm checks fail in AUTO.LAND, and in OFFBOARD without setpoints
    (measured). Other modes and armed vehicles are left alone.

    `roles_forbidding_arming`: roles of the modes to leave.

    Raises:
        FlightEnded: somebody else armed the vehicle or changed its mode, or hold was refused.
    """
    if context.armed() or not roles_of(context.link) & roles_forbidding_arming:
        return
    mode = context.link.state.mode
    context.note(disarmed_text(mode))
    context.waiting_for = f"the autopilot to leave {mode}"

    def require_control() -> None:
        if context.armed():
            raise FlightEnded("somebody else armed the vehicle", Exit.RELEASE)
        require_role(context.link, roles_forbidding_arming)

    try:
        await ask_to_hold(context, require_control)
    except (CommandRefused, CommandTimeout) as error:
        raise FlightEnded(left_disarmed_text(mode, error), Exit.LEAVE) from error


def disarmed_text(mode: str | None) -> str:
    """A sentence for the user: why the autopilot is asked to leave `mode`."""
    return (
        f"the vehicle is disarmed in {mode}, in which it cannot be armed again: asking the "
        "autopilot to hold"
    )


def left_disarmed_text(mode: str | None, error: Exception) -> str:
    """A sentence for the user: the autopilot did not leave `mode`, because of `error`."""
    return (
        f"the vehicle is left disarmed in {mode}, in which it cannot be armed again; "
        f"command another mode ({error})"
    )
