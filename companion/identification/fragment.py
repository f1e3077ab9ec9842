"""The configuration fragment of an identified vehicle, written from good fits."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import NamedTuple

from companion.files import bounded_yaml
from companion.identification.response import BadFitError, RateResponse
from companion.identification.vehicle import IdentifiedVehicle

Known = Mapping[str, Sequence[float | None]]
"""Lag (ms), dead time (ms), acceleration limit (°/s²) and damping by axis, as configured."""

_PREFIX = {"roll": "", "pitch": "pitch_", "yaw": "yaw_"}
_UNLIMITED = 100_000.0
"""Written where roll has a slew limit and this axis has none: null would mean roll's, °/s²."""
_ALIKE_MS = 3.0
_ALIKE_SLEW = 0.1
"""Roll and pitch that differ by less, as a share, have one slew limit."""


class AxisValues(NamedTuple):
    """What the configuration says of one axis.

    Attributes:
        lag: ms.
        dead_time: ms.
        slew: °/s²; None without a limit.
        damping: of second order; None in first order.
    """

    lag: float
    dead_time: float
    slew: float | None
    damping: float | None = None

    def described(self) -> str:
        """In one line."""
        slew = "" if self.slew is None else f", slew {self.slew:.0f} °/s²"
        damping = "" if self.damping is None else f", damping {self.damping:.2f}"
        return f"lag {self.lag:.1f} ms, dead time {self.dead_time:.1f} ms{slew}{damping}"


def vehicle_fragment(
    vehicle: IdentifiedVehicle, gravity: float, known: Known, flight: str = ""
) -> str:
    """YAML for the configuration to include, with a comment on the quality of each fit.

    Each axis whose fit is good is written; any other keeps what the configuration knows of it, and
    a comment says so. Pitch is written where it differs from roll, a slew limit where one was found
    (the planner takes the lead of ArduPilot's frame from these times), the hover thrust where the
    thrust map is good.

    A second-order fit is written as a comment only: flown with it, a real PX4 bends the steps at
    90 °/s less (0.002, not 0.004) and those at 400 °/s more (0.006, not 0.004).

    Args:
        vehicle: as identified.
        gravity: m/s², at which it hovers.
        known: of each axis, from the configuration in force; may lack axes and values.
        flight: name of the flight; empty: it is not written.

    Raises:
        BadFitError: no response may be used, or one may not and nothing else is known of its axis;
            it says why, one sentence an axis.
    """
    kept = kept_axes(vehicle, known)
    lines = [_comment(name, response, kept) for name, response in vehicle.axes.items()]
    thrust = vehicle.thrust
    if thrust is not None and thrust.is_good(gravity):
        lines.append(f"# thrust: {thrust.described()}")
        lines += ["thrust:", f"  hover_thrust: {thrust.normalised(gravity):.3f}"]
    axes = {name: kept.get(name) or _found(each) for name, each in vehicle.axes.items()}
    mark = [f"  identified: {bounded_yaml.dump_value(flight)}"] if flight else []
    lines += ["vehicle:", *mark, *_tilt_keys(axes["roll"], axes["pitch"])]
    lines += _axis_keys("yaw", axes["yaw"], axes["roll"].slew)
    return "\n".join(lines) + "\n"


def kept_axes(vehicle: IdentifiedVehicle, known: Known) -> dict[str, AxisValues]:
    """What the configuration keeps saying of the axes whose fits are bad.

    Raises:
        BadFitError: no fit is good, or nothing is known of an axis whose fit is bad.
    """
    faults = vehicle.faults()
    kept = {}
    for name in faults:
        lag, dead_time, slew, damping = known.get(name, (None, None, None, None))
        if lag is not None and dead_time is not None:
            kept[name] = AxisValues(lag, dead_time, slew, damping)
    if len(faults) == len(vehicle.axes) or len(kept) < len(faults):
        raise BadFitError("; ".join(f"{name}: {reason}" for name, reason in faults.items()))
    return kept


def _found(response: RateResponse) -> AxisValues:
    slew = None if response.slew is None else degrees(response.slew)
    return AxisValues(1e3 * response.lag, 1e3 * response.dead_time, slew)


def _tilt_keys(roll: AxisValues, pitch: AxisValues) -> list[str]:
    """The keys of both: their mean where they hardly differ."""
    if _alike(roll, pitch):
        slews = [axis.slew for axis in (roll, pitch) if axis.slew is not None]
        slew = sum(slews) / len(slews) if slews else None
        mean = AxisValues(
            0.5 * (roll.lag + pitch.lag),
            0.5 * (roll.dead_time + pitch.dead_time),
            slew,
            roll.damping,
        )
        return _axis_keys("roll", mean)
    return _axis_keys("roll", roll) + _axis_keys("pitch", pitch, roll.slew)


def _alike(one: AxisValues, other: AxisValues) -> bool:
    if one.slew is not None and other.slew is not None:
        if abs(one.slew - other.slew) > _ALIKE_SLEW * max(one.slew, other.slew):
            return False
    elif one.slew != other.slew:
        return False
    if one.damping != other.damping:
        return False
    apart = max(abs(one.lag - other.lag), abs(one.dead_time - other.dead_time))
    return apart <= _ALIKE_MS


def _axis_keys(name: str, axis: AxisValues, inherited: float | None = None) -> list[str]:
    """Lines of one axis; `inherited` is the slew limit that it would have without its own."""
    prefix = _PREFIX[name]
    lines = [f"  {prefix}lag_ms: {axis.lag:.1f}", f"  {prefix}dead_time_ms: {axis.dead_time:.1f}"]
    slew = axis.slew if axis.slew is not None or inherited is None else _UNLIMITED
    if slew is not None:
        lines.append(f"  {prefix}acceleration_limit_deg_s2: {slew:.0f}")
    if axis.damping is not None:
        lines.append(f"  {prefix}damping: {axis.damping:.2f}")
    return lines


def _comment(name: str, response: RateResponse, kept: Mapping[str, AxisValues]) -> str:
    if name in kept:
        return (
            f"# {name}: kept from the configuration: {kept[name].described()}; the fit is bad: "
            f"{response.reason()}"
        )
    fit = response.fit
    slew = "" if response.slew is None else f", slew {response.slew:.1f} rad/s²"
    nearer = "" if response.second_order is None else f"; nearer: {response.second_order.described}"
    return (
        f"# {name}: lag {1e3 * response.lag:.1f} ± {1e3 * fit.lag_error:.1f} ms, dead time "
        f"{1e3 * response.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f} ms, gain "
        f"{response.gain:.2f}{slew}, explains {fit.explained:.1%}, misfit {fit.misfit:.0%}, "
        f"{fit.excited} samples{nearer}"
    )
