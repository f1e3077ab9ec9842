"""Checks of time: the age of samples at arrival, the round trip, and the vehicle's clock."""

from collections.abc import Iterator
from math import inf

from companion.attitude import PLANNER_NAMES
from companion.config import Config
from companion.preflight.evidence import Evidence
from companion.preflight.finding import INEFFECTIVE, SAFE, UNSAFE, Finding, Key
from companion.vehicle.clock_estimates import MAX_DRIFT

_UNSAFE_NOT_NEWER_SHARE = 0.2
"""More than this share of samples stamped no later than the previous sample is unsafe."""
_MIN_SAMPLES = 10
"""Smallest number of samples to judge the rate of the clock."""
_UNSAFE_PRODUCT, _SAFE_PRODUCT = 0.3, 0.15
"""Limits of planner.gain_per_s times the round trip (dimensionless), measured on mock vehicles.
Above the first, attitude oscillates at the limit of the roll-pitch rate; above the second, a slow
vehicle may oscillate.
"""


def age(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether samples are fresh at arrival, if TIMESYNC can measure their age."""
    sample_age, stale_after = evidence.samples.age, config.deadman.telemetry_stale
    if sample_age is None:
        if evidence.link.timesync_on_other_clock:
            yield Finding(
                Key.AGE,
                INEFFECTIVE,
                "TIMESYNC uses a different clock than time_boot_ms",
                "the age of a sample on arrival is unknown",
                "let the autopilot itself answer TIMESYNC, not a router in between",
                "TIMESYNC",
            )
        return
    is_stale = sample_age > stale_after
    yield Finding(
        Key.AGE,
        UNSAFE,
        f"attitude is {1e3 * sample_age:.1f} ms old when it arrives"
        + (f", more than deadman.telemetry_stale_ms = {1e3 * stale_after:g}" if is_stale else ""),
        "such samples would not be answered",
        "find what delays the messages: a busy computer, a router, a full queue, a slow link",
        "TIMESYNC and ATTITUDE_QUATERNION time_boot_ms",
    ).safe_unless(is_stale)


def round_trip(config: Config, seconds: float) -> Finding:
    """Judge whether the planner's gain is too high for a round trip of `seconds`.

    When a setpoint takes effect, the attitude sample from which the setpoint was computed is as old
    as the round trip. Every round trip is accepted in lockstep, because the vehicle waits, and with
    another package's planner, whose gain may have another meaning.
    """
    gain = config.planner.gain_per_s
    gain_matters = config.planner_name in PLANNER_NAMES and not config.link.lockstep
    product = gain * seconds if gain_matters else 0.0
    is_late = product > _SAFE_PRODUCT
    return Finding(
        Key.ROUND_TRIP,
        UNSAFE if product > _UNSAFE_PRODUCT else INEFFECTIVE if is_late else SAFE,
        f"the link's round trip takes {1e3 * seconds:.1f} ms"
        + (f", long for planner.gain_per_s {gain:g}" if is_late else ""),
        "the vehicle shakes, because the attitude is corrected too late" if is_late else "",
        f"use a faster link, or lower planner.gain_per_s to {_SAFE_PRODUCT / seconds:.1f}"
        if is_late
        else "",
        "TIMESYNC",
    )


def clocks(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the vehicle's clock runs steadily, at the same rate as this computer's clock."""
    samples, source = evidence.samples, "ATTITUDE_QUATERNION time_boot_ms"
    if samples.clock_change:
        yield Finding(
            Key.CLOCK,
            UNSAFE,
            samples.clock_change,
            "in flight, the program would hand the vehicle back",
            "restart the autopilot and check again; if it recurs, look for a second source of "
            "ATTITUDE_QUATERNION",
            source,
        )
    elif samples.not_newer_count:
        yield Finding(
            Key.CLOCK,
            UNSAFE
            if samples.not_newer_count > _UNSAFE_NOT_NEWER_SHARE * samples.sample_count
            else INEFFECTIVE,
            f"{samples.not_newer_count} of {samples.sample_count} samples are stamped no later "
            "than the one before",
            "they are not answered, and if that lasts, the vehicle is handed back",
            "send attitude over one link only; restart the autopilot if its clock stands still",
            source,
        )
    elif samples.sample_count >= _MIN_SAMPLES and samples.clock_rate is not None:
        yield _clock_rate(config, evidence, samples.clock_rate, source)


def _clock_rate(config: Config, evidence: Evidence, rate: float, source: str) -> Finding:
    """Judge the rate of the vehicle's clock; unsafe if samples would soon count as stale.

    A pause of the samples at either end of the window makes the measured rate uncertain.
    """
    lag_per_s = 1.0 - rate - MAX_DRIFT
    stale_after = config.deadman.telemetry_stale / lag_per_s if lag_per_s > 0.0 else inf
    uncertainty = evidence.samples.longest_pause / max(evidence.counting_time, 1e-3)
    is_too_slow = lag_per_s > uncertainty
    rate_differs = abs(rate - 1.0) > MAX_DRIFT
    consequence = "time limits, such as those of `deadman`, are longer or shorter than configured"
    if is_too_slow:
        consequence = (
            f"within {stale_after:.0f} s the vehicle's samples would count as older than "
            "deadman.telemetry_stale_ms"
        )
    return Finding(
        Key.CLOCK,
        UNSAFE if is_too_slow else INEFFECTIVE,
        f"the vehicle's clock runs {rate:.3f} times as fast as ours",
        consequence,
        "run a simulation at the speed of real time, or in lockstep",
        source,
    ).safe_unless(rate_differs)
