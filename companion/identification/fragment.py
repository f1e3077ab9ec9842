"""What the configuration includes of an identified vehicle, written from fits that may be used."""

from math import degrees

from companion.identification.response import BadFitError, RateResponse
from companion.identification.vehicle import IdentifiedVehicle

KEEP_FRAME_LEAD = (
    "Acceleration is limited, as by ArduPilot: keep `vehicle.yaw_frame_lead_ms` of "
    "vehicle-ardupilot.yaml, which is not identified."
)
"""For whoever includes a vehicle with a slew limit."""


def vehicle_fragment(vehicle: IdentifiedVehicle, gravity: float) -> str:
    """YAML that the configuration includes, a comment on how good each fit is above it.

    The configuration has one value for roll and pitch: the mean of the two. A slew limit stands in
    it where one was found, the hover thrust where the thrust map is good.

    Args:
        vehicle: as identified.
        gravity: m/s², at which it hovers.

    Raises:
        BadFitError: a response must not be used; it says why, one sentence an axis.
    """
    faults = vehicle.faults()
    if faults:
        raise BadFitError("; ".join(f"{name}: {reason}" for name, reason in faults.items()))
    lines = [f"# {name}: {_described(response)}" for name, response in vehicle.axes.items()]
    thrust = vehicle.thrust
    if thrust is not None and thrust.is_good(gravity):
        lines.append(f"# thrust: {thrust.described()}")
        lines += ["thrust:", f"  hover_thrust: {thrust.normalised(gravity):.3f}"]
    if vehicle.slews:
        lines.append(f"# {KEEP_FRAME_LEAD}")
    lines.append("vehicle:")
    lines += _response_keys("", (vehicle.roll, vehicle.pitch))
    lines += _response_keys("yaw_", (vehicle.yaw,))
    return "\n".join(lines) + "\n"


def _response_keys(prefix: str, axes: tuple[RateResponse, ...]) -> list[str]:
    lines = [
        f"  {prefix}lag_ms: {1e3 * _mean([axis.lag for axis in axes]):.1f}",
        f"  {prefix}dead_time_ms: {1e3 * _mean([axis.dead_time for axis in axes]):.1f}",
    ]
    slews = [axis.slew for axis in axes if axis.slew is not None]
    if slews:
        lines.append(f"  {prefix}acceleration_limit_deg_s2: {degrees(_mean(slews)):.0f}")
    return lines


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _described(response: RateResponse) -> str:
    fit = response.fit
    slew = "" if response.slew is None else f", slew {response.slew:.1f} rad/s²"
    return (
        f"lag {1e3 * response.lag:.1f} ± {1e3 * fit.lag_error:.1f} ms, dead time "
        f"{1e3 * response.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f} ms, gain "
        f"{response.gain:.2f}{slew}, explains {fit.explained:.1%}, {fit.excited} samples"
    )
