"""Checks of the link: losses, delays, signing, and other nodes on it."""

from collections.abc import Iterable, Iterator

from companion.config import Config
from companion.mavlink.peer import PEER_NOTICE
from companion.mavlink.stats import TOLERABLE_LOSS
from companion.preflight import clock_checks
from companion.preflight.evidence import Evidence
from companion.preflight.finding import INEFFECTIVE, UNSAFE, Finding, Key
from companion.vehicle.parameter_rules import CheckResult

_UNSAFE_LOSS_SHARE = 0.2
_MAX_DAMAGED_SHARE = 0.01
_MAX_REPEATED_SHARE = 0.05
"""If more frames are lost and repeated, two senders with one id may count them."""


def losses(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Check the link for lost messages, damaged messages and reconnects."""
    link = evidence.link
    lost_share = link.loss
    fix = "lower link.attitude_rate_hz and link.position_rate_hz, or use a better link"
    if link.repeated_count > _MAX_REPEATED_SHARE * max(1, link.frame_count):
        ids = f"{config.link.target_system}/{config.link.target_component}"
        fix += f"; a gimbal or another device that sends as {ids}, too, needs ids of its own"
    yield Finding(
        Key.LOSS,
        UNSAFE if lost_share > _UNSAFE_LOSS_SHARE else INEFFECTIVE,
        f"{100.0 * lost_share:.1f} % of the vehicle's messages are lost",
        "our setpoints are lost, too, and we see the pilot's mode changes late",
        fix,
        "gaps in MAVLink sequence numbers",
    ).safe_unless(lost_share > TOLERABLE_LOSS)
    if link.damaged_count > _MAX_DAMAGED_SHARE * max(1, link.frame_count):
        yield Finding(
            Key.DAMAGE,
            INEFFECTIVE,
            f"{link.damaged_count} damaged messages in {evidence.counting_time:g} s",
            "such messages are rejected, and so lost",
            "check the wiring, its ground and the baud rate",
            "checksums",
        )
    if link.not_finite_count:
        yield Finding(
            Key.NOT_FINITE,
            INEFFECTIVE,
            f"{link.not_finite_count} messages with a number that is NaN or infinite",
            "such messages are rejected, and so lost",
            "let the estimator settle; if this goes on, do not fly",
            "decoded messages",
        )
    if link.reconnect_count:
        yield Finding(
            Key.RECONNECTS,
            UNSAFE,
            f"the connection dropped {link.reconnect_count} times in {evidence.counting_time:g} s",
            "it will drop in flight, too",
            "check plugs, cables and power",
            "the operating system",
        )


def delays(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Round trip, its jitter, and pauses between samples."""
    stale_after = config.deadman.telemetry_stale
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
    elif round_trip > stale_after:
        yield Finding(
            Key.ROUND_TRIP,
            UNSAFE,
            f"the link's round trip takes {1e3 * round_trip:.0f} ms, longer than "
            f"deadman.telemetry_stale_ms = {1e3 * stale_after:g}",
            fix="use a faster link",
            source="TIMESYNC",
        )
    else:
        yield clock_checks.round_trip(config, round_trip)
        yield Finding(
            Key.JITTER,
            INEFFECTIVE,
            f"the round trip varies by {1e3 * jitter:.1f} ms",
            "the planner assumes a constant dead time",
            "find what delays the messages: a router, Wi-Fi, a busy computer",
            "TIMESYNC",
        ).safe_unless(jitter > 0.5 * stale_after)
    samples = evidence.samples
    if samples.longest_pause > stale_after:
        yield Finding(
            Key.PAUSES,
            INEFFECTIVE,
            f"attitude paused for {1e3 * samples.longest_pause:.0f} ms, longer than "
            f"deadman.telemetry_stale_ms = {1e3 * stale_after:g}",
            "our setpoints pause as long",
            "find what delays the messages: a router, Wi-Fi, a busy computer",
            "ATTITUDE_QUATERNION",
        )


def signing(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Notices about signatures, and about other senders than the vehicle."""
    yield from signing_findings(evidence.link.notices)


def signing_findings(
    notices: Iterable[str], result: CheckResult = INEFFECTIVE
) -> Iterator[Finding]:
    """Convert notices of the link about signatures and the peer to findings with this `result`."""
    for notice in notices:
        is_about_peer = notice.startswith(PEER_NOTICE)
        fact, _semicolon, fix = notice.removeprefix(PEER_NOTICE).partition("; ")
        key = Key.ENDPOINT if is_about_peer else Key.SIGNING
        source = "senders' addresses" if is_about_peer else "MAVLink 2 signatures"
        yield Finding(key, result, fact, fix=fix, source=source)


def other_nodes(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether other nodes use our ids, are companion computers or vehicles, or send setpoints."""
    link, nodes = config.link, evidence.other_nodes
    our_ids = link.source_system, link.source_component
    if our_ids in nodes.sources:
        yield Finding(
            Key.OUR_IDS,
            UNSAFE,
            f"another program uses system/component {our_ids[0]}/{our_ids[1]}, our own ids",
            "each program receives the answers meant for the other, and both may send setpoints",
            "end the other program, or give each its own link.source_component; if there is none, "
            "a forwarder on the link may send our own frames back to us",
            "frames heard",
        )
    for system, component in sorted(nodes.companions - {our_ids}):
        yield Finding(
            Key.SECOND_COMPANION,
            INEFFECTIVE,
            f"another companion computer is there, {system}/{component}",
            "if it sends commands or setpoints, two programs steer one vehicle",
            "make sure that it only listens",
            "HEARTBEAT of type onboard controller",
        )
    for system, component in sorted(nodes.autopilots):
        if system == link.target_system:
            continue  # a device of our vehicle
        yield Finding(
            Key.SECOND_VEHICLE,
            INEFFECTIVE,
            f"another vehicle is on the link, {system}/{component}",
            f"only system {link.target_system} is checked, commanded and flown",
            "make sure that link.target_system is the vehicle that shall fly",
            "HEARTBEAT of an autopilot",
        )
    senders = sorted(nodes.setpoint_senders)
    if senders or nodes.has_foreign_attitude_target:
        sender_names = ", ".join(f"{system}/{component}" for system, component in senders)
        yield Finding(
            Key.OTHER_SETPOINTS,
            UNSAFE,
            f"somebody else sends setpoints{': ' + sender_names if sender_names else ''}",
            "the autopilot obeys the newest setpoint of any sender, so two programs would steer "
            "one vehicle",
            "end the other program",
            "setpoints heard" if senders else "ATTITUDE_TARGET while disarmed",
        )
