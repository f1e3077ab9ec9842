"""Checks of the link: message rates, losses, delays, signing, and other nodes on it."""

from collections.abc import Iterable, Iterator

from companion.config import Config
from companion.mavlink.peer import PEER_NOTICE
from companion.mavlink.stats import TOLERABLE_LOSS
from companion.preflight import clock_checks
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding, Key
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.streams import StreamRate

SAFE, UNSAFE, INEFFECTIVE = CheckResult.SAFE, CheckResult.UNSAFE, CheckResult.INEFFECTIVE

_MIN_RATE_SHARE = 0.7
"""Share of a requested rate that must be granted and arrive; PX4 sends 197 Hz of 250 (measured)."""
_MIN_EXPECTED_COUNT = 5.0
"""A rate is judged by counting only if at least this many messages are expected."""
_SENT_ON_CHANGE = {"CURRENT_MODE": 2.0}
"""Messages that PX4 sends on change, and otherwise at this rate, Hz, whatever rate is requested.
"""
_RATE_KEYS = {
    "ATTITUDE_QUATERNION": "link.attitude_rate_hz",
    "LOCAL_POSITION_NED": "link.position_rate_hz",
}
_UNSAFE_LOSS_SHARE = 0.2
_MAX_DAMAGED_SHARE = 0.01


def streams(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the requested telemetry arrives at the requested rates."""
    link = config.link
    minimum_rates = {
        "ATTITUDE_QUATERNION": ("min_attitude_rate_hz", link.min_attitude_rate_hz),
        "LOCAL_POSITION_NED": ("min_position_rate_hz", link.min_position_rate_hz),
    }
    good_rates = []
    for name, rate in evidence.streams.items():
        fault = _rate_fault(name, rate, evidence)
        if name in evidence.awaited and rate.granted >= _MIN_RATE_SHARE * rate.asked:
            continue  # `readiness` reports it
        effective = _effective_rate(name, rate, evidence)
        if name in minimum_rates and effective < minimum_rates[name][1]:
            key, limit = minimum_rates[name]
            uneven = effective < _MIN_RATE_SHARE * rate.achieved
            arrives = f"arrives at {effective:.0f} Hz"
            if uneven:
                arrives = (
                    f"arrives in bursts: {rate.achieved:.0f} Hz on average, but its gaps are as "
                    f"long as at {effective:.0f} Hz"
                )
            yield Finding(
                f"link.{key}",
                UNSAFE,
                f"{name} {arrives}, less than link.{key} = {limit:g}",
                "the flight would be controlled with data that is too old",
                fault[1] if fault else "raise the link's speed",
                source="counted",
            )
        elif fault is not None:
            found, fix = fault
            because = "what depends on this message is delayed or does not work"
            yield Finding(
                f"{Key.STREAMS}.{name}", INEFFECTIVE, found, because, fix, source="counted"
            )
        else:
            good_rates.append(f"{name} {rate.achieved:.0f} of {rate.asked:g}")
    if good_rates:
        found = f"telemetry arrives, Hz: {', '.join(good_rates)}"
        yield Finding(Key.STREAMS, SAFE, found, source="counted")


def _effective_rate(name: str, rate: StreamRate, evidence: Evidence) -> float:
    """The effective rate, Hz: for attitudes, the pauses between bursts lower it."""
    sample_rate = evidence.samples.rate
    if name != "ATTITUDE_QUATERNION" or sample_rate is None:
        return rate.achieved
    return min(rate.achieved, sample_rate)


def _rate_fault(name: str, rate: StreamRate, evidence: Evidence) -> tuple[str, str] | None:
    """The fault of a message's rate, and the remedy; None: no fault."""
    asked, achieved = rate.asked, rate.achieved
    key, faster_loop = _RATE_KEYS.get(name), "raise the rate of the autopilot's loop"
    if rate.refusal:
        return f"{name} is refused ({rate.refusal})", "a newer version of the autopilot may send it"
    if rate.granted < _MIN_RATE_SHARE * asked:
        return (
            f"{name}: asked for {asked:g} Hz, granted {rate.granted:g} Hz",
            f"lower {key}, or {faster_loop}" if key else faster_loop,
        )
    asked = min(asked, _SENT_ON_CHANGE.get(name, asked))
    countable = asked * evidence.window >= _MIN_EXPECTED_COUNT
    if achieved >= _MIN_RATE_SHARE * asked if countable else evidence.received[name] > 0:
        return None
    return (
        f"{name} arrives at {achieved:.0f} Hz, asked for {asked:g} Hz",
        "raise the link's speed, lower link.attitude_rate_hz and link.position_rate_hz, or end "
        "other programs on this computer if it is busy",
    )


def losses(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Check the link for lost messages, damaged messages and reconnects."""
    link = evidence.link
    share = link.loss
    result = (
        UNSAFE if share > _UNSAFE_LOSS_SHARE else INEFFECTIVE if share > TOLERABLE_LOSS else SAFE
    )
    bad = result is not SAFE
    yield Finding(
        Key.LOSS,
        result,
        f"{100.0 * share:.1f} % of the vehicle's messages are lost",
        "our setpoints are lost, too, and we see the pilot's mode changes late" if bad else "",
        "lower link.attitude_rate_hz and link.position_rate_hz, or use a better link"
        if bad
        else "",
        "gaps in MAVLink sequence numbers",
    )
    if link.damaged > _MAX_DAMAGED_SHARE * max(1, link.frames):
        yield Finding(
            Key.DAMAGE,
            INEFFECTIVE,
            f"{link.damaged} damaged messages in {evidence.window:g} s",
            "such messages are rejected, and so lost",
            "check the wiring, its ground and the baud rate",
            "checksums",
        )
    if link.not_finite:
        yield Finding(
            Key.NOT_FINITE,
            INEFFECTIVE,
            f"{link.not_finite} messages with a number that is NaN or infinite",
            "such messages are rejected, and so lost",
            "let the estimator settle; if this goes on, do not fly",
            "decoded messages",
        )
    if link.reconnects:
        yield Finding(
            Key.RECONNECTS,
            UNSAFE,
            f"the connection dropped {link.reconnects} times in {evidence.window:g} s",
            "it will drop in flight, too",
            "check plugs, cables and power",
            "the operating system",
        )


def delays(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Round trip, its jitter, and pauses between samples."""
    stale = config.deadman.telemetry_stale
    round_trip, jitter = evidence.link.round_trip, evidence.link.jitter
    if round_trip is None or jitter is None:
        yield Finding(
            Key.ROUND_TRIP,
            INEFFECTIVE,
            "the autopilot does not answer TIMESYNC",
            "the age of a sample on arrival is unknown",
            "check whether a router on the way blocks TIMESYNC",
            "TIMESYNC",
        )
    elif round_trip > stale:
        yield Finding(
            Key.ROUND_TRIP,
            UNSAFE,
            f"the link's round trip takes {1e3 * round_trip:.0f} ms, longer than "
            f"deadman.telemetry_stale_ms = {1e3 * stale:g}",
            fix="use a faster link",
            source="TIMESYNC",
        )
    else:
        yield clock_checks.round_trip(config, round_trip)
        uneven = jitter > 0.5 * stale
        yield Finding(
            Key.JITTER,
            INEFFECTIVE if uneven else SAFE,
            f"the round trip varies by {1e3 * jitter:.1f} ms",
            "the planner assumes a constant dead time" if uneven else "",
            "find what delays the messages: a router, Wi-Fi, a busy computer" if uneven else "",
            "TIMESYNC",
        )
    samples = evidence.samples
    if samples.longest_pause > stale:
        yield Finding(
            Key.PAUSES,
            INEFFECTIVE,
            f"attitude paused for {1e3 * samples.longest_pause:.0f} ms, longer than "
            f"deadman.telemetry_stale_ms = {1e3 * stale:g}",
            "setpoints pause with it",
            "find what delays the messages: a router, Wi-Fi, a busy computer",
            "ATTITUDE_QUATERNION",
        )


def signing(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether both sides sign with the same key or not at all, and who claims to be the peer."""
    yield from signing_findings(evidence.link.notices)


def signing_findings(
    notices: Iterable[str], result: CheckResult = INEFFECTIVE
) -> Iterator[Finding]:
    """Convert notices of the link about signatures and the peer to findings with this `result`."""
    for notice in notices:
        of_peer = notice.startswith(PEER_NOTICE)
        found, _semicolon, fix = notice.removeprefix(PEER_NOTICE).partition("; ")
        key = Key.ENDPOINT if of_peer else Key.SIGNING
        source = "senders' addresses" if of_peer else "MAVLink 2 signatures"
        yield Finding(key, result, found, fix=fix, source=source)


def other_nodes(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether other nodes use our ids, are companion computers, or send setpoints."""
    link, others = config.link, evidence.other_nodes
    ours = link.source_system, link.source_component
    if ours in others.sources:
        yield Finding(
            Key.OUR_IDS,
            UNSAFE,
            f"another program uses system/component {ours[0]}/{ours[1]}, our own ids",
            "each program receives answers to the other one, and both may send setpoints",
            "end the other program, or give each its own link.source_component",
            "frames heard",
        )
    for system, component in sorted(others.companions - {ours}):
        yield Finding(
            Key.SECOND_COMPANION,
            INEFFECTIVE,
            f"another companion computer is there, {system}/{component}",
            "if it sends commands or setpoints, two programs steer one vehicle",
            "make sure that it only listens",
            "HEARTBEAT of type onboard controller",
        )
    steering = sorted(others.steering)
    if steering or others.foreign_target:
        who = ", ".join(f"{system}/{component}" for system, component in steering)
        yield Finding(
            Key.OTHER_SETPOINTS,
            UNSAFE,
            f"somebody else sends setpoints{': ' + who if who else ''}",
            "the autopilot obeys whichever came last, so two would steer one vehicle",
            "end the other program",
            "setpoints heard" if steering else "ATTITUDE_TARGET while disarmed",
        )
