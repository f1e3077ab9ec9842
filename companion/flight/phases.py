"""The table of phases: order, timeouts, allowed modes, and the exit if a phase fails."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf

from companion.config.flight import FlightConfig
from companion.flight import control_phases, listening, preflight_phases, takeoff, takeover
from companion.flight.hand_over import ROLES_BEFORE_LANDING
from companion.flight.phase import Phase, Work
from companion.safety.actions import Exit
from companion.vehicle.autopilot import Autopilot, ControlEntry, Role

_TAKEOFF_ROLES = frozenset({Role.TAKEOFF, Role.READY})
_ARMED_ON_GROUND_ROLES = frozenset({Role.READY})
_OFFBOARD_ROLES = frozenset({Role.OFFBOARD})
_MANEUVER_GRACE = 10.0
"""Time that the maneuvers may take beyond their duration, s."""
_COMMAND_TIMEOUT = 10.0
"""Timeout for commands that the autopilot carries out at once or not at all, s."""
_TAKEOVER_TIMEOUT = 15.0
"""Timeout for preflight checks and takeover, s; reading parameters over a lossy link takes long."""

HAND_BACK = Phase(
    "hand back",
    "the autopilot to hold",
    control_phases.hand_back,
    _COMMAND_TIMEOUT,
    Exit.LAND,
    allowed_roles=ROLES_BEFORE_LANDING,
)
"""The phase in which the autopilot holds by itself and our setpoints stop."""

_LAND = Phase(
    "land",
    "touchdown",
    control_phases.land,
    inf,
    allowed_roles=ROLES_BEFORE_LANDING | {Role.LAND},
    lands=True,
)
"""The phase of the landing. `control_phases.land` itself limits the time until the landing begins,
and until touchdown. A vehicle that would drift without our setpoints is held beyond this limit."""

_DISARM = Phase("disarm", "the motors to stop", control_phases.disarm, 20.0)

_UNDO_ARMING = Phase(
    "disarm", "the motors to stop", preflight_phases.undo_arming, _COMMAND_TIMEOUT, Exit.LAND
)
"""The phase that disarms after a failure. If the autopilot refuses to disarm, the vehicle is in the
air, so it is commanded to land."""

_LISTEN = Phase("listen", "the vehicle to be heard and to hold", listening.hold_when_heard, inf)
"""The phase after a lost link; `hold_when_heard` itself limits the time to hear the vehicle."""

LANDING_PHASES = HAND_BACK, _LAND, _DISARM
"""The phases from our control back to the ground."""

EXIT_PHASES: Mapping[Exit, tuple[Phase, ...]] = {
    Exit.LEAVE: (),
    Exit.LISTEN: (_LISTEN,),
    Exit.RELEASE: (),
    Exit.DISARM: (_UNDO_ARMING,),
    Exit.HOLD: (HAND_BACK,),
    Exit.LAND: (_LAND, _DISARM),
}
"""The phases that the flight runs for each exit."""


def ground_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """The phases before arming, in order: they connect, request telemetry and check.

    A vehicle that stands disarmed in a mode in which it cannot be armed is asked to hold.
    """
    return (
        # A second longer than the link waits, because the link's error message says more.
        Phase("connect", "a heartbeat", preflight_phases.connect, config.connect_timeout_s + 1.0),
        Phase("checks", "the vehicle to be ready", preflight_phases.checks, config.ready_timeout_s),
    )


def opening_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """Like `ground_phases`, but a vehicle that already flies is checked in `handover_phases`."""
    connect, checks = ground_phases(config)
    return connect, replace(checks, work=takeover.check_unless_flying)


def flight_phases(
    config: FlightConfig, maneuver_duration: float, autopilot: Autopilot
) -> tuple[Phase, ...]:
    """The phases after the ground phases, in order; `maneuver_duration` in s."""
    maneuvers = control_phase(
        "maneuvers", "the maneuver to end", control_phases.maneuvers, maneuver_duration
    )
    if config.take_over:
        return (*handover_phases(config), maneuvers, HAND_BACK)
    maneuvers_then_landing = replace(maneuvers, on_failure=Exit.LAND)
    return (*takeoff_phases(config, autopilot), maneuvers_then_landing, *LANDING_PHASES)


def takeoff_phases(config: FlightConfig, autopilot: Autopilot) -> tuple[Phase, ...]:
    """The phases from the ground until the autopilot obeys our rates; PX4 gets setpoints first."""
    stream = Phase("stream", "the first setpoints", preflight_phases.stream, _COMMAND_TIMEOUT)
    return (
        *((stream,) if autopilot.control_entry is ControlEntry.BY_COMMAND else ()),
        Phase(
            "arm", "the vehicle to arm", preflight_phases.arm, config.arming_timeout_s, Exit.DISARM
        ),
        _takeoff(config),
        _takeover(Exit.LAND),
    )


def takeover_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """Checks and takeover of a vehicle that its autopilot holds in the air."""
    checks = _checks(config, "to be taken over", takeover.check_airborne, _TAKEOFF_ROLES)
    return checks, _takeover(Exit.HOLD, Exit.LEAVE)


def handover_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """The wait until the pilot hands over a flying vehicle, then its checks and takeover."""
    hand_over = Phase(
        "hand over",
        "the pilot to hand over in the air",
        takeover.wait_for_handover,
        config.arming_timeout_s,
    )
    return hand_over, *takeover_phases(config)


def takeoff_for_client_phases(config: FlightConfig) -> tuple[Phase, ...]:
    """Checks, take-off and takeover of a vehicle that somebody else armed on the ground."""
    checks = _checks(config, "to take off", takeover.check_armed_on_ground, _ARMED_ON_GROUND_ROLES)
    return checks, _takeoff(config), _takeover(Exit.HOLD, Exit.LEAVE)


def _checks(config: FlightConfig, purpose: str, work: Work, roles: frozenset[Role]) -> Phase:
    return Phase(
        "checks",
        f"the vehicle to be ready {purpose}",
        work,
        config.ready_timeout_s,
        allowed_roles=roles,
    )


def _takeoff(config: FlightConfig) -> Phase:
    return Phase(
        "takeoff",
        "the take-off height",
        takeoff.takeoff,
        config.takeoff_timeout_s,
        Exit.LAND,
        on_failure_on_ground=Exit.DISARM,
        allowed_roles=_TAKEOFF_ROLES,
    )


def _takeover(on_failure: Exit, on_failure_untaken: Exit | None = None) -> Phase:
    """The phase of the takeover.

    After a failure, `on_failure` lands or holds the vehicle. Before the takeover is commanded,
    `on_failure_untaken` may leave it to those who flew it.
    """
    return Phase(
        "offboard",
        "the autopilot to obey our body rates",
        takeover.offboard,
        _TAKEOVER_TIMEOUT,
        on_failure,
        on_failure_untaken=on_failure_untaken,
        allowed_roles=_TAKEOFF_ROLES | _OFFBOARD_ROLES,
        monitored=True,
    )


def control_phase(name: str, waits_for: str, work: Work, duration: float = inf) -> Phase:
    """A phase in which the autopilot obeys our rates, such as the maneuvers.

    If the phase fails, the vehicle is handed back and holds. After some breaches of the safety
    monitors the vehicle lands.

    Args:
        name: name of the phase, shown to the user.
        waits_for: what the phase waits for, such as "the autopilot to obey our rates".
        work: the coroutine of the phase.
        duration: expected duration, s.
    """
    return Phase(
        name,
        waits_for,
        work,
        duration + _MANEUVER_GRACE,
        Exit.HOLD,
        allowed_roles=_OFFBOARD_ROLES,
        monitored=True,
    )
