"""Why nothing is heard of a vehicle, in words: what came instead, or what to look at."""

from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats


def no_heartbeat(settings: LinkSettings, stats: LinkStats, timeout_s: float) -> str:
    """No heartbeat of the autopilot came within `timeout_s`."""
    start = f"no heartbeat from system {settings.target_system} within {timeout_s:g} s"
    refused = _refused(start, stats)
    if refused is not None:
        return refused
    if stats.bad_crc:
        return f"{start}, but {stats.bad_crc} damaged frames; is the baud rate right?"
    return f"{start} on {settings.endpoint}; is the vehicle running and sending to this address?"


def no_beacon(settings: LinkSettings, stats: LinkStats) -> str:
    """No lockstep beacon came within `first_beacon_timeout_s`."""
    start = f"no lockstep beacon within {settings.first_beacon_timeout_s:g} s"
    why = f"{start} on {settings.endpoint}; is the vehicle running, and in lockstep?"
    return _refused(start, stats) or why


def _refused(start: str, stats: LinkStats) -> str | None:
    """What came instead and was refused, `None` if nothing was."""
    if stats.unclaimed:
        return (
            f"{start}, but {stats.unclaimed} other frames with its ids; no sender is taken for the "
            "vehicle before its autopilot's heartbeat"
        )
    if stats.ignored_foreign:
        source = "/".join(map(str, min(stats.foreign_sources)))
        return (
            f"{start}, but {stats.ignored_foreign} frames from others, such as system/component "
            f"{source}; is link.target_system right?"
        )
    if stats.bad_signature:
        return (
            f"{start}, but {stats.bad_signature} frames not signed with our key, or with a time "
            "stamp that is not believed"
        )
    return None
