"""Whether ArduCopter may be armed, and if not, why: the first problem found, in its words."""

from sitl_mock.ardupilot.modes import NEEDS_POSITION, NEVER_ARMED_IN
from sitl_mock.autopilot.modes import Mode
from sitl_mock.autopilot.state import BatteryWarning, State


def arming_problem(
    state: State,
    *,
    initialised: bool,
    home_set: bool,
    crashed: bool,
    gcs_failsafe: bool,
    refusal: str | None,
) -> str | None:
    """Return why arming is refused now, None if it is not.

    Args:
        state: the autopilot's state.
        initialised: whether the autopilot has said that it is ready.
        home_set: whether the estimator has settled on its origin.
        crashed: whether the vehicle is broken.
        gcs_failsafe: whether the ground station is lost.
        refusal: a reason given from outside (fault injection).
    """
    mode: Mode = state.mode
    problems = (
        (not initialised, "System not initialised"),
        (refusal is not None, refusal),
        (crashed, "Vehicle has crashed"),
        (not home_set, "AHRS: waiting for home"),
        (mode in NEEDS_POSITION and not state.position_valid, "Need Position Estimate"),
        (mode in NEVER_ARMED_IN, "Mode not armable"),
        (state.battery_warning > BatteryWarning.OK, "Battery failsafe on"),
        (gcs_failsafe, "GCS failsafe on"),
    )
    return next((problem for present, problem in problems if present), None)
