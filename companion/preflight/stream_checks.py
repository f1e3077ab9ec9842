"""Checks of the rates at which the requested telemetry arrives."""

from collections.abc import Iterator

from companion.config import Config
from companion.config.computer import LinkConfig
from companion.preflight.evidence import Evidence
from companion.preflight.finding import INEFFECTIVE, SAFE, UNSAFE, Finding, Key
from companion.vehicle.streams import StreamRate

_MIN_RATE_SHARE = 0.7
"""Smallest accepted share of the requested rate; PX4 sends 197 Hz of 250 requested (measured)."""
_FULL_RATE_SHARE = 0.95
"""Share of the requested rate from which a rate counts as reached."""
_MIN_EXPECTED_COUNT = 5.0
"""A rate is judged by counting only if at least this many messages are expected."""
_SENT_ON_CHANGE = {"CURRENT_MODE": 2.0}
"""Messages that PX4 sends on change, and otherwise at this rate, Hz, whatever rate is requested.
"""
_FASTER_LOOP = "let the autopilot's main loop run faster"
_RATE_KEYS = {
    "ATTITUDE_QUATERNION": "link.attitude_rate_hz",
    "LOCAL_POSITION_NED": "link.position_rate_hz",
}


def minimum_rates(link: LinkConfig) -> dict[str, tuple[str, float]]:
    """Configuration key (section `link`) and minimum rate, Hz, of each message with a minimum."""
    return {
        "ATTITUDE_QUATERNION": ("min_attitude_rate_hz", link.min_attitude_rate_hz),
        "LOCAL_POSITION_NED": ("min_position_rate_hz", link.min_position_rate_hz),
    }


def streams(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the requested telemetry arrives at the requested rates."""
    min_rates = minimum_rates(config.link)
    good_rates = []
    for name, rate in evidence.streams.items():
        fault = _rate_fault(name, rate, evidence)
        if name in evidence.awaited_messages and rate.granted >= _MIN_RATE_SHARE * rate.requested:
            continue  # `readiness` reports it
        effective_rate = _effective_rate(name, rate, evidence)
        if name in min_rates and effective_rate < min_rates[name][1]:
            key, limit = min_rates[name]
            is_uneven = effective_rate < _MIN_RATE_SHARE * rate.achieved
            arrival_text = f"arrives at {effective_rate:.0f} Hz"
            if is_uneven:
                arrival_text = (
                    f"arrives in bursts: {rate.achieved:.0f} Hz on average, but its gaps are as "
                    f"long as at {effective_rate:.0f} Hz"
                )
            yield Finding(
                f"link.{key}",
                UNSAFE,
                f"{name} {arrival_text}, less than link.{key} = {limit:g}",
                "the flight would be controlled with data that is too old",
                fault[1] if fault else "raise the link's speed",
                source="counted",
            )
        elif fault is not None:
            fact, fix = fault
            consequence = "what depends on this message is delayed or does not work"
            yield Finding(
                f"{Key.STREAMS}.{name}", INEFFECTIVE, fact, consequence, fix, source="counted"
            )
        else:
            good_rates.append(_good_rate(name, rate, evidence))
    if good_rates:
        fact = f"telemetry arrives, Hz: {', '.join(good_rates)}"
        yield Finding(Key.STREAMS, SAFE, fact, source="counted")


def _effective_rate(name: str, rate: StreamRate, evidence: Evidence) -> float:
    """The effective rate, Hz: for attitudes, the pauses between bursts lower it."""
    sample_rate = evidence.samples.rate
    if name != "ATTITUDE_QUATERNION" or sample_rate is None:
        return rate.achieved
    return min(rate.achieved, sample_rate)


def _rate_fault(name: str, rate: StreamRate, evidence: Evidence) -> tuple[str, str] | None:
    """The fault of a message's rate, and the remedy; None: no fault."""
    expected, achieved = rate.requested, rate.achieved
    key = _RATE_KEYS.get(name)
    if rate.refusal:
        return f"{name} is refused ({rate.refusal})", "a newer version of the autopilot may send it"
    if rate.granted < _MIN_RATE_SHARE * expected:
        return (
            f"{name}: asked for {expected:g} Hz, granted {rate.granted:g} Hz",
            f"lower {key}, or {_FASTER_LOOP}" if key else _FASTER_LOOP,
        )
    is_countable = _is_countable(name, rate, evidence)
    expected = _expected_rate(name, rate)
    if (
        achieved >= _MIN_RATE_SHARE * expected
        if is_countable
        else evidence.received_counts[name] > 0
    ):
        return None
    return (
        f"{name} arrives at {achieved:.0f} Hz, asked for {expected:g} Hz",
        "raise the link's speed, lower link.attitude_rate_hz and link.position_rate_hz, or end "
        "other programs on this computer if it is busy",
    )


def _is_countable(name: str, rate: StreamRate, evidence: Evidence) -> bool:
    """Whether enough messages are expected to judge the rate by counting them."""
    return _expected_rate(name, rate) * evidence.counting_time >= _MIN_EXPECTED_COUNT


def _expected_rate(name: str, rate: StreamRate) -> float:
    """Expected rate of a message, Hz: the requested rate, or less for a message sent on change."""
    return min(rate.requested, _SENT_ON_CHANGE.get(name, rate.requested))


def _good_rate(name: str, rate: StreamRate, evidence: Evidence) -> str:
    """Describe a rate without a fault; say why a rate below the requested one suffices."""
    if name in _SENT_ON_CHANGE:
        return f"{name} on change, otherwise at {_SENT_ON_CHANGE[name]:g} Hz"
    if not _is_countable(name, rate, evidence):
        return f"{name} (asked for {rate.requested:g}, too seldom to be counted here)"
    rate_text = f"{name} {rate.achieved:.0f} of {rate.requested:g}"
    if rate.achieved >= _FULL_RATE_SHARE * rate.requested:
        return rate_text
    return f"{rate_text} ({100.0 * _MIN_RATE_SHARE:.0f} % suffices)"
