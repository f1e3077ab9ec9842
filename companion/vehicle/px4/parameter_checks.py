"""Checks of PX4's parameters that compare them with the configuration.

Each function is a `Check`: it returns the problem of a value, or None.
"""

from math import degrees

from companion.vehicle.parameter_checks import INEFFECTIVE, UNSAFE
from companion.vehicle.parameter_rules import CompanionSettings, Problem, Values

_INTEGRATION_RATES = (100.0, 200.0, 250.0, 400.0)
_TERMINATION_OFF = 121212
_FAILURE_ANGLES = ("FD_FAIL_R", "FD_FAIL_P")
_NAMED_ANGLES = ", ".join(_FAILURE_ANGLES)
_DEFAULT_FAILURE_ANGLE = 60.0
_TILT_OVERSHOOT = 15.0
"""Tilt beyond the limit that a gust or a step may cause, degrees."""


def attitude_rate(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that PX4 estimates attitude (IMU_INTEG_RATE) as often as `link.attitude_rate_hz`."""
    wanted = settings.attitude_rate_hz
    if value >= min(wanted, _INTEGRATION_RATES[-1]):
        return None
    enough = [rate for rate in _INTEGRATION_RATES if rate >= wanted]
    return Problem(
        INEFFECTIVE,
        f"attitude is estimated no faster than that, so link.attitude_rate_hz {wanted:g} is not "
        "reached",
        enough[0] if enough else _INTEGRATION_RATES[-1],
    )


def termination_tilt(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
    """Check that the largest tilt of a flight cannot trigger flight termination."""
    if value == _TERMINATION_OFF:
        return None
    if not all(name in values for name in _FAILURE_ANGLES):
        return Problem(
            UNSAFE,
            f"the tilt at which the motors stop ({_NAMED_ANGLES}) is not known, because these "
            "parameters were not received; check again on a link that loses less",
        )
    angles = [values[name] for name in _FAILURE_ANGLES if values[name] > 0.0]
    if not angles or min(angles) > degrees(settings.max_tilt) + _TILT_OVERSHOOT:
        return None
    return Problem(
        UNSAFE,
        f"a tilt of {min(angles):g}° ({_NAMED_ANGLES}) stops the motors, and "
        f"limits.max_tilt_deg is {degrees(settings.max_tilt):g}; lower limits.max_tilt_deg to "
        f"{_TILT_OVERSHOOT:g}° below that angle, for gusts and steps",
    )


def failure_tilt(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
    """Check that the failure detector's angle is larger than the largest tilt of a flight."""
    if value == 0.0 or value > degrees(settings.max_tilt):
        return None
    raised = degrees(settings.max_tilt) < _DEFAULT_FAILURE_ANGLE
    return Problem(
        INEFFECTIVE,
        f"PX4 reports a failure at a tilt that limits.max_tilt_deg {degrees(settings.max_tilt):g} "
        "allows" + ("" if raised else f"; lower limits.max_tilt_deg below {value:g}"),
        # The detector is never weakened beyond PX4's default angle.
        _DEFAULT_FAILURE_ANGLE if raised else None,
    )


def signing(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that `companion` signs if PX4 requires it.

    If only `companion` signs, no check is needed: it refuses unsigned frames of the vehicle anyway.
    """
    if not value or settings.signing:
        return None
    return Problem(
        INEFFECTIVE,
        "PX4 obeys only signed frames, and companion does not sign; set link.signing_key_file",
    )
