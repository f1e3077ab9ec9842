"""The `vehicle:` section of the configuration, written from fits that may be used."""

from companion.identification.response import NEEDS, BadFitError, FitNeeds, RateResponse
from companion.identification.thrust_map import ThrustMap


def vehicle_fragment(
    roll: RateResponse,
    pitch: RateResponse,
    yaw: RateResponse,
    thrust: ThrustMap | None = None,
    needs: FitNeeds = NEEDS,
) -> str:
    """YAML that the configuration takes, a comment on how good each fit is above it.

    The configuration has one lag and one dead time for roll and pitch: the mean of the two.

    Args:
        roll: as fitted.
        pitch: as fitted.
        yaw: as fitted.
        thrust: noted in a comment if it is good.
        needs: what each response must reach.

    Raises:
        BadFitError: one of the responses does not; it says why, one sentence an axis.
    """
    axes = {"roll": roll, "pitch": pitch, "yaw": yaw}
    faults = [(name, response.reason(needs)) for name, response in axes.items()]
    if any(reason for _, reason in faults):
        raise BadFitError("; ".join(f"{name}: {reason}" for name, reason in faults if reason))
    lines = [f"# {name}: {_described(response)}" for name, response in axes.items()]
    if thrust is not None and thrust.is_good():
        lines.append(
            f"# thrust: T/m = {thrust.slope:.2f}·u {thrust.offset:+.2f} m/s² for u in 0..1, "
            f"rotor lag {1e3 * thrust.lag:.0f} ms, explains {thrust.explained:.1%}"
        )
    values = {
        "lag_ms": 0.5 * (roll.lag + pitch.lag),
        "dead_time_ms": 0.5 * (roll.dead_time + pitch.dead_time),
        "yaw_lag_ms": yaw.lag,
        "yaw_dead_time_ms": yaw.dead_time,
    }
    lines.append("vehicle:")
    lines.extend(f"  {key}: {1e3 * value:.1f}" for key, value in values.items())
    return "\n".join(lines) + "\n"


def _described(response: RateResponse) -> str:
    fit = response.fit
    slew = "" if response.slew is None else f", slew {response.slew:.1f} rad/s²"
    return (
        f"lag {1e3 * response.lag:.1f} ± {1e3 * fit.lag_error:.1f} ms, dead time "
        f"{1e3 * response.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f} ms, gain "
        f"{response.gain:.2f}{slew}, explains {fit.explained:.1%}, {fit.excited} samples"
    )
