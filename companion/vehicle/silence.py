"""Why no heartbeat or no lockstep beacon came from the vehicle, in words."""

from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats


def no_heartbeat_message(settings: LinkSettings, stats: LinkStats, timeout_s: float) -> str:
    """The error message if no heartbeat of the autopilot came within `timeout_s`."""
    opening = f"no heartbeat from system {settings.target_system} within {timeout_s:g} s"
    refused = _refusal_message(opening, stats)
    if refused is not None:
        return refused
    if stats.bad_crc:
        return (
            f"{opening}, but {stats.bad_crc} damaged frames; is the baud rate right? "
            "(link.endpoint)"
        )
    if settings.endpoint.startswith("serial:"):
        return (
            f"{opening} on {settings.endpoint}; is the vehicle running, does its port send "
            "MAVLink at this baud rate, and are TX and RX crossed?"
        )
    return f"{opening} on {settings.endpoint}; is the vehicle running and sending to this address?"


def no_beacon_message(settings: LinkSettings, stats: LinkStats) -> str:
    """The error message if no lockstep beacon came within `first_beacon_timeout_s`."""
    opening = f"no lockstep beacon within {settings.first_beacon_timeout_s:g} s"
    why = f"{opening} on {settings.endpoint}; is the vehicle running, and in lockstep?"
    return _refusal_message(opening, stats) or why


def _refusal_message(opening: str, stats: LinkStats) -> str | None:
    """The error message if frames were refused for their sender or signature; otherwise None.

    Args:
        opening: first clause of the message.
        stats: counters of the link.
    """
    if stats.unclaimed:
        return (
            f"{opening}, but {stats.unclaimed} other frames with the vehicle's ids; let the "
            "autopilot send HEARTBEAT on this link, because only its sender counts as the vehicle"
        )
    if stats.ignored_foreign:
        source = "/".join(map(str, min(stats.foreign_sources)))
        return (
            f"{opening}, but {stats.ignored_foreign} frames from others, such as system/component "
            f"{source}; is link.target_system right?"
        )
    if stats.bad_signature:
        return (
            f"{opening}, but {stats.bad_signature} frames that are not signed with the key in "
            "link.signing_key_file, or whose time stamp is refused; give both sides the same key, "
            "and set this computer's clock"
        )
    return None
