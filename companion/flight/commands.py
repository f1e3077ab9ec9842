"""Commands to a vehicle that a pilot or another station may take over at any moment.

Every command of a flight that arms, disarms, takes off or changes the mode goes through
`command_if_ours`, which first checks who controls the vehicle.
"""

import asyncio
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager, suppress

from companion.flight.context import FlightContext
from companion.mavlink.commands import Command, command_name
from companion.mavlink.errors import CommandRefused, CommandTimeout, CommandUnfinished
from companion.safety.actions import DISARMED_IN_FLIGHT, ControlReleased, Exit, FlightEnded
from companion.vehicle.autopilot import Role
from companion.vehicle.link import Link

_MAX_TRIES = 4
_COMMAND_EFFECT_TIMEOUT = 3.0
"""If a repeated command is refused, longest wait for the effect of the first try, s. A take-off
shows its effect later than a mode change."""
_MODE_REPORT_TIMEOUT = 1.0
"""If an accepted mode is not reported within this time, s, the autopilot has left it again."""
FAILSAFE_TEXT = "the autopilot's failsafe took over"
_UNWATCHED_TIME = 3.0
"""Longest time from a long stall of this program to a heartbeat from after the stall, s."""

IsDone = Callable[[], bool]
"""Returns whether the vehicle has obeyed the command; may raise `FlightEnded` instead."""
RequireControl = Callable[[], None]
"""Raises `FlightEnded` if we must not command the vehicle; most call `require_role`."""


def roles_of(link: Link) -> frozenset[Role]:
    """The roles of the vehicle's mode, such as HOLD; empty if the mode is unknown or has no role.

    In a hold that a failsafe chose, READY is left out, so that no take-off or takeover begins: PX4
    holds for COM_FAIL_ACT_T before it returns or lands, and a command of ours would end the
    failsafe.
    """
    state = link.state
    roles = frozenset[Role]() if state.mode is None else link.autopilot.roles(state.mode)
    # If the vehicle held already, only HEARTBEAT tells. On the ground it may be disarmed.
    holds_in_failsafe = Role.HOLD in roles and state.mode_by_failsafe and state.flying
    return roles - {Role.READY} if holds_in_failsafe or state.mode_not_intended else roles


def in_role(link: Link, role: Role) -> bool:
    """Whether the vehicle's mode has this role, such as `Role.HOLD`."""
    return role in roles_of(link)


def require_role(link: Link, allowed: Set[Role], released_by: str = "") -> None:
    """Release control if the present mode has none of the allowed roles.

    `released_by`: client in control that has just commanded another mode; "": none.

    Raises:
        ControlReleased: the client in control commanded that mode.
        FlightEnded: names who took over, as far as known.
    """
    if roles_of(link) & allowed:
        return
    if released_by and not link.state.mode_by_failsafe:
        raise ControlReleased(f"{released_by} commanded mode {link.state.mode}", Exit.RELEASE)
    if link.state.mode_by_failsafe:
        raise FlightEnded(f"{FAILSAFE_TEXT}: mode {link.state.mode}", Exit.RELEASE)
    raise _taken_over(link)


def require_armed_in_air(context: FlightContext) -> None:
    """End the flight if the vehicle was disarmed in the air, in a phase without safety monitors.

    Raises:
        FlightEnded: the vehicle is disarmed, and has not been on the ground all the time.
    """
    if context.link.state.armed is False and not context.ground.standing:
        counters, now = context.snapshot_builder.counters, asyncio.get_running_loop().time()
        was_stopped = now - counters.long_stall_ended_at < _UNWATCHED_TIME
        raise (DisarmedUnwatched if was_stopped else FlightEnded)(DISARMED_IN_FLIGHT, Exit.RELEASE)


class DisarmedUnwatched(FlightEnded):
    """The vehicle is disarmed; this program was stopped when it disarmed."""


class ModeTakenOver(FlightEnded):
    """The vehicle is in a mode that is not ours, and the autopilot reports no failsafe."""


def _taken_over(link: Link) -> ModeTakenOver:
    text = f"the pilot or another station took over: mode {link.state.mode}"
    return ModeTakenOver(text, Exit.RELEASE)


async def command_if_ours(
    context: FlightContext, command: Command, require_control: RequireControl, done: IsDone
) -> None:
    """Send a command until the autopilot answers; before each try, check who has control.

    A command is never repeated blindly. The vehicle may have obeyed a command whose answer was
    lost, and a pilot may have taken over since, even by a mode in which we may command.

    `require_control`: called before each try; if it raises, nothing is sent. `done`: see `IsDone`;
    called before a repetition, and at each report of the mode.

    Raises:
        FlightEnded: somebody else has the vehicle, or another vehicle answers.
        CommandRefused: the autopilot refused.
        CommandTimeout: no try was answered.
        CommandUnfinished: the autopilot answered "in progress", and did not finish in time.
        LinkLost: the connection dropped while waiting.
    """
    with _watching(context, done) as require_not_undone:
        for attempt in range(_MAX_TRIES):
            await context.fresh_heartbeat()
            context.replacement_detector.require()
            if attempt > 0 and done():
                return
            require_control()
            require_not_undone()
            try:
                await context.link.command(*command, retries=0)
                return
            except CommandUnfinished:  # another try would only take as long again
                await context.fresh_heartbeat()
                if not done():
                    raise
                return
            except CommandTimeout:
                pass
            except CommandRefused:
                # A vehicle that has obeyed the first try refuses the second one.
                if attempt == 0 or not await _takes_effect(context, done):
                    raise
                return
        await context.fresh_heartbeat()
        if done():
            return
        require_not_undone()
    name = command_name(command.command)
    raise CommandTimeout(f"{name}: no answer to {_MAX_TRIES} tries; does the uplink work?")


@contextmanager
def _watching(context: FlightContext, done: IsDone) -> Iterator[Callable[[], None]]:
    """Watch a command's effect, so that the command is not repeated after others undid the effect.

    Yields a function to call before the first try, and later if the vehicle shows no effect. It
    raises `ModeTakenOver` if a report since its first call has shown the effect.
    """
    is_commanded = was_seen = False

    def note_effect(_: object) -> None:
        nonlocal was_seen
        with suppress(FlightEnded):  # raised again before the next try
            was_seen = was_seen or (is_commanded and done())

    def require_not_undone() -> None:
        nonlocal is_commanded
        is_commanded = True
        if was_seen:
            raise _taken_over(context.link)

    unsubscribers = [
        context.link.subscribe(name, note_effect) for name in ("HEARTBEAT", "CURRENT_MODE")
    ]
    try:
        yield require_not_undone
    finally:
        for unsubscribe in unsubscribers:
            unsubscribe()


async def change_mode(
    context: FlightContext, command: Command, require_control: RequireControl, done: IsDone
) -> None:
    """Send a mode command like `command_if_ours`, and wait until the mode is reported.

    Raises:
        FlightEnded: somebody else has the vehicle, or the accepted mode ended at once.
        CommandUnfinished: the autopilot accepted the mode, but still obeys our setpoints.
        CommandRefused, CommandTimeout, LinkLost: see `command_if_ours`.
    """
    await command_if_ours(context, command, require_control, done)
    accepted_at = asyncio.get_running_loop().time()

    def entered() -> bool:
        state = context.link.state
        if done():
            return True
        if state.mode_received_at > accepted_at + _MODE_REPORT_TIMEOUT:
            if in_role(context.link, Role.OFFBOARD):
                raise CommandUnfinished(
                    f"{command_name(command.command)}: the autopilot accepted the command, but "
                    f"still obeys our setpoints in mode {state.mode}"
                )
            raise FlightEnded(
                "the autopilot accepted the change of mode, but reports a mode that we did not "
                f"command: {state.mode}",
                Exit.RELEASE,
            )
        return False

    await context.until(entered)


async def ask_to_hold(context: FlightContext, require_control: RequireControl) -> None:
    """Change to the autopilot's hold mode; raises what `change_mode` raises."""
    await change_mode(
        context,
        context.link.autopilot.hold(),
        require_control,
        lambda: in_role(context.link, Role.HOLD),
    )


async def _takes_effect(context: FlightContext, done: IsDone) -> bool:
    try:
        async with asyncio.timeout(_COMMAND_EFFECT_TIMEOUT):
            await context.until(done)
    except TimeoutError:
        return False
    return True
