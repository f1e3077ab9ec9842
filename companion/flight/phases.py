"""The flight as a table: its phases in order, how long each may take, and how each is left."""

from typing import NamedTuple

from companion.config import FlightConfig
from companion.flight.ending import Exit
from companion.flight.roles import Role


class Phase(NamedTuple):
    """One phase.

    Attributes:
        name: also the name of the method of `Procedures` that flies it, with underscores.
        waits_for: what the user is told.
        timeout: s; then the phase has failed.
        on_failure: what is done with the vehicle if the phase fails.
        modes: the modes that the autopilot may be in; any other one means that someone else has
            taken the vehicle. Empty: any.
        monitored: whether silence and the safety monitors end it; what follows a breach must not
            be ended by the same breach.
    """

    name: str
    waits_for: str
    timeout: float
    on_failure: Exit
    modes: frozenset[Role] = frozenset()
    monitored: bool = False


def flight_phases(config: FlightConfig, programme_duration: float) -> tuple[Phase, ...]:
    """The phases of a flight; `programme_duration` in s."""
    airborne = frozenset({Role.TAKEOFF, Role.HOLD})
    return (
        Phase("connect", "a heartbeat", config.connect_timeout_s, Exit.LEAVE),
        Phase("checks", "the vehicle to be ready", config.ready_timeout_s, Exit.LEAVE),
        Phase("stream", "setpoints to flow", 10.0, Exit.LEAVE),
        Phase("arm", "the vehicle to arm", config.arming_timeout_s, Exit.DISARM),
        Phase("takeoff", "the height", config.takeoff_timeout_s, Exit.LAND, airborne),
        Phase(
            "offboard",
            "the autopilot to take our rates",
            10.0,
            Exit.LAND,
            airborne | {Role.OFFBOARD},
            monitored=True,
        ),
        Phase(
            "programme",
            "the programme to end",
            programme_duration + 10.0,
            Exit.LAND,
            frozenset({Role.OFFBOARD}),
            monitored=True,
        ),
        Phase(
            "hand back",
            "the autopilot to hold",
            10.0,
            Exit.LAND,
            airborne | {Role.OFFBOARD},
        ),
        Phase(
            "land",
            "touchdown",
            config.landing_timeout_s,
            Exit.LEAVE,
            airborne | {Role.OFFBOARD, Role.LAND},
        ),
        Phase("disarm", "the motors to stop", 20.0, Exit.LEAVE),
    )
