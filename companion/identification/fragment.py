"""Writes an identified vehicle as YAML to include; a bad fit is replaced by configured values."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import NamedTuple

from companion.files import bounded_yaml
from companion.identification.response import BadFitError, RateResponse
from companion.identification.vehicle import IdentifiedVehicle

ConfiguredValues = Mapping[str, Sequence[float | None]]
"""Lag (ms), dead time (ms), acceleration limit (°/s²) and damping by axis, as configured."""

_KEY_PREFIX = {"roll": "", "pitch": "pitch_", "yaw": "yaw_"}
_AXIS_KEYS = "lag_ms", "dead_time_ms", "acceleration_limit_deg_s2", "damping"
_NO_SLEW_LIMIT = 100_000.0
"""Slew limit, °/s², written for an axis without a slew limit if roll has a slew limit, because null
would mean the slew limit of roll."""
_NEGLIGIBLE_TIME_DIFFERENCE_MS = 3.0
"""Largest difference of lag and of dead time at which roll and pitch count as the same, ms."""
_NEGLIGIBLE_SLEW_DIFFERENCE_SHARE = 0.1
"""Largest relative difference of the slew limits at which roll and pitch count as the same."""
_NEGLIGIBLE_DAMPING_DIFFERENCE = 0.05
"""Largest difference of the damping ratios at which roll and pitch count as the same."""
_ACCEPTED_DAMPINGS = 0.3, 10.0
"""Smallest and largest damping ratio that `vehicle.damping` accepts."""


class AxisValues(NamedTuple):
    """The configuration values of one axis."""

    lag_ms: float
    dead_time_ms: float
    slew_deg_s2: float | None
    """Slew limit, °/s²; None: no limit."""
    damping: float | None = None
    """Damping ratio ζ of a second-order lag; None: first order."""

    def described(self) -> str:
        """Text for the user: the values in one line."""
        slew = "" if self.slew_deg_s2 is None else f", slew {self.slew_deg_s2:.0f} °/s²"
        damping = "" if self.damping is None else f", damping {self.damping:.2f}"
        return f"lag {self.lag_ms:.1f} ms, dead time {self.dead_time_ms:.1f} ms{slew}{damping}"


def vehicle_fragment(
    vehicle: IdentifiedVehicle,
    gravity: float,
    configured: ConfiguredValues,
    flight: str = "",
    allow_second_order: bool = True,
    autopilot: str = "",
) -> str:
    """YAML for the configuration to include, with a comment on the quality of each fit.

    An axis with a good fit gets its fitted values. An axis with a bad fit keeps its configured
    values, and a comment says so. If roll and pitch hardly differ, their mean values are written as
    those of roll. The hover thrust is written only if the thrust map is good.

    Roll and pitch are written as second-order lags if these fit clearly better on both axes.

    Args:
        vehicle: the identified vehicle.
        gravity: gravity, m/s², which gives the hover thrust.
        configured: configured values by axis; axes may be missing, and values None.
        flight: name of the flight, written as `identified`; empty: it is not written.
        allow_second_order: whether second-order lags may be written.
        autopilot: name of the vehicle's autopilot, written as `autopilot`; empty: not written.

    Raises:
        BadFitError: no fit is good, or an axis with a bad fit has no configured values; the message
            gives a reason for each bad axis.
    """
    kept = kept_axes(vehicle, configured)
    lines = [_fit_comment(name, response, kept) for name, response in vehicle.axes.items()]
    thrust = vehicle.thrust
    if thrust is not None and thrust.flaw(gravity) is None:
        lines.append(f"# thrust: {thrust.described()}")
        lines += ["thrust:", f"  hover_thrust: {thrust.normalised(gravity):.3f}"]
    axes = {
        name: kept.get(name) or _fitted_values(response) for name, response in vehicle.axes.items()
    }
    if allow_second_order:
        axes |= second_order_axes(vehicle)
    identified = [f"  identified: {bounded_yaml.dump_value(flight)}"] if flight else []
    flown_by = [f"  autopilot: {bounded_yaml.dump_value(autopilot)}"] if autopilot else []
    lines += ["vehicle:", *identified, *flown_by, *_tilt_lines(axes["roll"], axes["pitch"])]
    lines += _axis_lines("yaw", axes["yaw"], axes["roll"].slew_deg_s2)
    return "\n".join(lines) + "\n"


def second_order_axes(vehicle: IdentifiedVehicle) -> dict[str, AxisValues]:
    """Values of roll and pitch as second-order lags, as the vehicle file holds them.

    Empty unless both axes have a good fit, and on both a second-order lag without a slew limit fits
    clearly better than a first-order one, with a damping ratio that the configuration accepts.
    """
    axes = {}
    for name in ("roll", "pitch"):
        response = vehicle.axes[name]
        fit = response.second_order
        if fit is None or fit.slew is not None or not response.is_good():
            return {}
        if not _ACCEPTED_DAMPINGS[0] <= fit.damping <= _ACCEPTED_DAMPINGS[1]:
            return {}
        axes[name] = AxisValues(1e3 * fit.lag, 1e3 * fit.dead_time, None, fit.damping)
    return axes


def kept_axes(vehicle: IdentifiedVehicle, configured: ConfiguredValues) -> dict[str, AxisValues]:
    """The axes whose fit is bad, with their configured values, which they keep.

    Raises:
        BadFitError: no fit is good, or an axis with a bad fit has no configured values.
    """
    flaws = vehicle.flaws()
    kept = {}
    for name in flaws:
        lag, dead_time, slew, damping = configured.get(name, (None, None, None, None))
        if lag is not None and dead_time is not None:
            kept[name] = AxisValues(lag, dead_time, slew, damping)
    if len(flaws) == len(vehicle.axes) or len(kept) < len(flaws):
        raise BadFitError("; ".join(f"{name}: {flaw}" for name, flaw in flaws.items()))
    return kept


def _fitted_values(response: RateResponse) -> AxisValues:
    slew = None if response.slew is None else degrees(response.slew)
    return AxisValues(1e3 * response.lag, 1e3 * response.dead_time, slew)


def _tilt_lines(roll: AxisValues, pitch: AxisValues) -> list[str]:
    """YAML lines of roll and pitch; if they hardly differ, mean values for roll, null for pitch."""
    if not _nearly_same_axes(roll, pitch):
        return _axis_lines("roll", roll) + _axis_lines("pitch", pitch, roll.slew_deg_s2)
    mean = AxisValues(
        0.5 * (roll.lag_ms + pitch.lag_ms),
        0.5 * (roll.dead_time_ms + pitch.dead_time_ms),
        _mean(roll.slew_deg_s2, pitch.slew_deg_s2),
        _mean(roll.damping, pitch.damping),
    )
    return _axis_lines("roll", mean) + [f"  pitch_{key}: null" for key in _AXIS_KEYS]


def _mean(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else 0.5 * (one + other)


def _nearly_same_axes(one: AxisValues, other: AxisValues) -> bool:
    return (
        max(abs(one.lag_ms - other.lag_ms), abs(one.dead_time_ms - other.dead_time_ms))
        <= _NEGLIGIBLE_TIME_DIFFERENCE_MS
        and _nearly_equal(
            one.slew_deg_s2,
            other.slew_deg_s2,
            _NEGLIGIBLE_SLEW_DIFFERENCE_SHARE
            * max(one.slew_deg_s2 or 0.0, other.slew_deg_s2 or 0.0),
        )
        and _nearly_equal(one.damping, other.damping, _NEGLIGIBLE_DAMPING_DIFFERENCE)
    )


def _nearly_equal(one: float | None, other: float | None, tolerance: float) -> bool:
    """Whether both are None, or differ by at most `tolerance`."""
    return one == other or (one is not None and other is not None and abs(one - other) <= tolerance)


def _axis_lines(name: str, axis: AxisValues, roll_slew: float | None = None) -> list[str]:
    """YAML lines of one axis; a null slew limit would mean `roll_slew`, the slew limit of roll.

    Keys without a value are written as null, so that no value of another file remains in effect.
    """
    slew = axis.slew_deg_s2 if axis.slew_deg_s2 is not None or roll_slew is None else _NO_SLEW_LIMIT
    values = {
        "lag_ms": f"{axis.lag_ms:.1f}",
        "dead_time_ms": f"{axis.dead_time_ms:.1f}",
        "acceleration_limit_deg_s2": "null" if slew is None else f"{slew:.0f}",
        "damping": "null" if axis.damping is None else f"{axis.damping:.2f}",
    }
    keys = _AXIS_KEYS[:-1] if name == "yaw" else _AXIS_KEYS  # there is no yaw_damping
    return [f"  {_KEY_PREFIX[name]}{key}: {values[key]}" for key in keys]


def _fit_comment(name: str, response: RateResponse, kept: Mapping[str, AxisValues]) -> str:
    """A YAML comment on the fit of an axis, or on why its configured values are kept."""
    if name in kept:
        return (
            f"# {name}: kept from the configuration: {kept[name].described()}; the fit is bad: "
            f"{response.flaw()}"
        )
    fit = response.fit
    slew = "" if response.slew is None else f", slew {response.slew:.1f} rad/s²"
    second_order = response.second_order
    second_text = "" if second_order is None else f"; clearly better: {second_order.described}"
    return (
        f"# {name}, first order: lag {1e3 * response.lag:.1f} ± {1e3 * fit.lag_error:.1f} ms, dead "
        f"time {1e3 * response.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f} ms, gain "
        f"{response.gain:.2f}{slew}, explains {fit.explained:.1%} of the variance, misfit "
        f"{fit.misfit:.0%}, {fit.excited_samples} samples show the response{second_text}"
    )
