"""The flight as a table: its phases in order, how long each may take, and how each is left."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from companion.config.flight import FlightConfig
from companion.flight import control_phases, preflight_phases, takeoff
from companion.flight.context import FlightContext
from companion.safety.actions import Exit
from companion.vehicle.autopilot import Autopilot, ControlEntry, Role

_RISING = frozenset({Role.TAKEOFF, Role.READY})
_AIRBORNE = frozenset({Role.TAKEOFF, Role.READY, Role.HOLD})
_SHORT = 10.0
"""For what the autopilot does at once or not at all, s."""
_TAKE_OVER = 15.0
"""The same, and the judgement before it, whose parameters a bad link may lose, s."""


@dataclass(frozen=True, slots=True)
class Phase:
    """One phase.

    Attributes:
        name: what the user sees.
        waits_for: what the user is told it waits for.
        work: what is done in it.
        timeout: s; then the phase has failed.
        on_failure: what is done with the vehicle if the phase fails.
        on_failure_landed: the same while the vehicle still stands on the ground, if that differs.
        modes: the modes that the autopilot may be in; any other one means that someone else has
            taken the vehicle, and one that is not known any more is as bad. Empty: any.
        monitored: whether silence and the safety monitors end it; what follows a breach must not
            be ended by the same breach.
    """

    name: str
    waits_for: str
    work: Callable[[FlightContext], Coroutine[Any, Any, None]]
    timeout: float
    on_failure: Exit = Exit.LEAVE
    on_failure_landed: Exit | None = None
    modes: frozenset[Role] = frozenset()
    monitored: bool = False

    def exit_on_failure(self, *, standing: bool) -> Exit:
        """The exit if the phase fails; `standing`: the vehicle still stands on the ground."""
        if self.on_failure_landed is not None and standing:
            return self.on_failure_landed
        return self.on_failure


def ground_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """The phases before anything is asked of the vehicle but its telemetry, in order."""
    return (
        # A second more than the link waits: its own words on why nothing came are the better ones.
        Phase("connect", "a heartbeat", preflight_phases.connect, config.connect_timeout_s + 1.0),
        Phase("checks", "the vehicle to be ready", preflight_phases.checks, config.ready_timeout_s),
    )


def flight_phases(
    config: FlightConfig, maneuver_duration: float, autopilot: Autopilot
) -> tuple[Phase, ...]:
    """The phases from there on, in the autopilot's order; `maneuver_duration` in s."""
    stream = Phase("stream", "setpoints to flow", preflight_phases.stream, _SHORT)
    return (
        *((stream,) if autopilot.control_entry is ControlEntry.BY_COMMAND else ()),
        Phase(
            "arm", "the vehicle to arm", preflight_phases.arm, config.arming_timeout_s, Exit.DISARM
        ),
        Phase(
            "takeoff",
            "the height",
            takeoff.takeoff,
            config.takeoff_timeout_s,
            Exit.LAND,
            on_failure_landed=Exit.DISARM,
            modes=_RISING,
        ),
        Phase(
            "offboard",
            "the autopilot to take our rates",
            takeoff.offboard,
            _TAKE_OVER,
            Exit.LAND,
            modes=_RISING | {Role.OFFBOARD},
            monitored=True,
        ),
        Phase(
            "maneuvers",
            "the maneuver to end",
            control_phases.maneuvers,
            maneuver_duration + 10.0,
            Exit.LAND,
            modes=frozenset({Role.OFFBOARD}),
            monitored=True,
        ),
        _hand_back(),
        _land(config),
        _disarm(),
    )


def exit_phases(config: FlightConfig, exit_: Exit) -> tuple[Phase, ...]:
    """What is flown to leave the vehicle as `exit_` says."""
    return {
        Exit.LEAVE: (),
        Exit.RELEASE: (),
        Exit.DISARM: (_undo_arming(),),
        Exit.HOLD: (_hand_back(),),
        Exit.LAND: (_land(config), _disarm()),
    }[exit_]


def _hand_back() -> Phase:
    return Phase(
        "hand back",
        "the autopilot to hold",
        control_phases.hand_back,
        _SHORT,
        Exit.LAND,
        modes=_AIRBORNE | {Role.OFFBOARD},
    )


def _land(config: FlightConfig) -> Phase:
    return Phase(
        "land",
        "touchdown",
        control_phases.land,
        config.landing_timeout_s,
        modes=_AIRBORNE | {Role.OFFBOARD, Role.LAND},
    )


def _undo_arming() -> Phase:
    """Where it is refused, the vehicle flies after all; on the ground a landing does no harm."""
    return Phase("disarm", "the motors to stop", preflight_phases.undo_arming, _SHORT, Exit.LAND)


def _disarm() -> Phase:
    return Phase("disarm", "the motors to stop", control_phases.disarm, 20.0)
