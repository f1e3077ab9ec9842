"""Whether PX4 may be armed, and if not, why: the first problem found, in words."""

from sitl_mock.autopilot.modes import Mode
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import BatteryWarning, State
from sitl_mock.px4.modes import PILOTED

NEVER_ARMED_IN = frozenset({Mode.RTL, Mode.LAND})
"""Modes that forbid arming; they are not gone back to after disarming, either."""


def arming_problem(
    state: State,
    parameters: ParameterTable,
    *,
    ready_us: int,
    crashed: bool,
    offboard_alive: bool,
    gcs_alive: bool,
    pilot: bool,
    refusal: str | None,
) -> str | None:
    """Return why arming is refused now, None if it is not.

    Args:
        state: the autopilot's state.
        parameters: the autopilot's parameters.
        ready_us: vehicle time at which the estimator is ready.
        crashed: whether the vehicle is broken.
        offboard_alive: whether setpoints stream in.
        gcs_alive: whether a ground station is heard.
        pilot: whether somebody is at the sticks.
        refusal: a reason given from outside (fault injection).
    """
    problems = (
        (state.time_us < ready_us, "no heading reference"),
        (refusal is not None, refusal),
        (crashed, "vehicle has crashed"),
        (not state.position_valid, "no valid position estimate"),
        (state.battery_warning >= BatteryWarning.CRITICAL, "battery too low"),
        (
            parameters["NAV_DLL_ACT"] > 0 and not gcs_alive,
            "no connection to the ground station",
        ),
    )
    for present, problem in problems:
        if present:
            return problem
    return _mode_problem(state.mode, offboard_alive=offboard_alive, pilot=pilot)


def _mode_problem(mode: Mode, *, offboard_alive: bool, pilot: bool) -> str | None:
    if mode is Mode.OFFBOARD and not offboard_alive:
        return "no offboard signal"
    if mode in PILOTED and not pilot:
        return "no manual control input"
    if mode in NEVER_ARMED_IN:
        return "mode is not suitable for arming"
    return None
