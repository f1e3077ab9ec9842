"""Checks of PX4's parameters that compare them with the configuration.

Each function is a `Check`: it returns the problem of a value, or None.
"""

from math import degrees

from companion.vehicle.parameter_checks import INEFFECTIVE, UNSAFE
from companion.vehicle.parameter_rules import CompanionSettings, Problem, Values

_INTEGRATION_RATES_HZ = (100.0, 200.0, 250.0, 400.0)
_TERMINATION_OFF = 121212
_ANGLE_PARAMETERS = ("FD_FAIL_R", "FD_FAIL_P")
_ANGLE_NAMES = ", ".join(_ANGLE_PARAMETERS)
_DEFAULT_FAILURE_ANGLE_DEG = 60.0
_TILT_OVERSHOOT_DEG = 15.0
"""Tilt beyond the limit that a gust or a step may cause, degrees."""


def attitude_rate(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that PX4 estimates attitude (IMU_INTEG_RATE) as often as `link.attitude_rate_hz`."""
    rate_hz = settings.attitude_rate_hz
    if value >= min(rate_hz, _INTEGRATION_RATES_HZ[-1]):
        return None
    sufficient_rates = [rate for rate in _INTEGRATION_RATES_HZ if rate >= rate_hz]
    return Problem(
        INEFFECTIVE,
        f"attitude is estimated no faster than that, so link.attitude_rate_hz {rate_hz:g} is not "
        "reached",
        sufficient_rates[0] if sufficient_rates else _INTEGRATION_RATES_HZ[-1],
    )


def termination_tilt(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
    """Check that the largest tilt of a flight cannot trigger flight termination."""
    if value == _TERMINATION_OFF:
        return None
    if not all(name in values for name in _ANGLE_PARAMETERS):
        return Problem(
            UNSAFE,
            f"the tilt at which the motors stop ({_ANGLE_NAMES}) is not known, because these "
            "parameters were not received; check again on a link that loses less",
        )
    angles_deg = [values[name] for name in _ANGLE_PARAMETERS if values[name] > 0.0]
    if not angles_deg or min(angles_deg) > degrees(settings.max_tilt) + _TILT_OVERSHOOT_DEG:
        return None
    return Problem(
        UNSAFE,
        f"a tilt of {min(angles_deg):g}° ({_ANGLE_NAMES}) stops the motors, and "
        f"limits.max_tilt_deg is {degrees(settings.max_tilt):g}; lower limits.max_tilt_deg to "
        f"{_TILT_OVERSHOOT_DEG:g}° below that angle, for gusts and steps",
    )


def failure_tilt(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
    """Check that the failure detector's angle is larger than the largest tilt of a flight."""
    if value == 0.0 or value > degrees(settings.max_tilt):
        return None
    raisable = degrees(settings.max_tilt) < _DEFAULT_FAILURE_ANGLE_DEG
    return Problem(
        INEFFECTIVE,
        f"PX4 reports a failure at a tilt that limits.max_tilt_deg {degrees(settings.max_tilt):g} "
        "allows" + ("" if raisable else f"; lower limits.max_tilt_deg below {value:g}"),
        # The detector is never weakened beyond PX4's default angle.
        _DEFAULT_FAILURE_ANGLE_DEG if raisable else None,
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
