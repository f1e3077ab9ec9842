"""Makes the link and the real-time settings of a session from the configuration."""

from pathlib import Path

from companion.config import Config
from companion.flight.environment import Environment
from companion.mavlink.frame_filter import Notice
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_passphrase_file
from companion.mavlink.stamp_file import StampFile
from companion.mavlink.transport.base import Tap
from companion.mavlink.transport.opening import OpenTransport, open_transport
from companion.realtime import RealtimeSettings
from companion.vehicle.link import Link


def link_settings(config: Config) -> LinkSettings:
    """The link's settings; reads the signing key, if there is one.

    Raises:
        SigningError: the key cannot be used.
    """
    link = config.link
    return LinkSettings(
        endpoint=link.endpoint,
        target_system=link.target_system,
        target_component=link.target_component,
        source_system=link.source_system,
        source_component=link.source_component,
        signing=_signing(link.signing_key_file),
        lockstep=link.lockstep,
    )


def make_link(
    config: Config, tap: Tap | None, notice: Notice, opener: OpenTransport = open_transport
) -> Link:
    """Make the link of `link.backend`, not yet open; see `Link` for the other arguments.

    Raises:
        SigningError: the key cannot be used.
        EndpointError: the endpoint's notation is wrong.
        LinkError: the event loop or MAVSDK cannot do what the configuration demands.
    """
    settings = link_settings(config)
    if config.link.backend == "mavsdk":
        from companion.mavsdk_link import MavsdkLink  # noqa: PLC0415  needs the extra

        return MavsdkLink(settings, tap, notice)
    return Link(settings, tap, opener, notice)


def realtime_settings(config: Config, environment: Environment) -> RealtimeSettings:
    """The real-time settings to request from the operating system; none with a virtual clock."""
    if not environment.realtime:
        return RealtimeSettings()
    section = config.realtime
    return RealtimeSettings(
        fifo_priority=section.priority if section.scheduler == "fifo" else None,
        processors=section.cpu_affinity,
        lock_memory=section.lock_memory,
        freeze_gc=section.freeze_gc,
        required=section.required,
    )


def _signing(key_file: Path | None) -> Signing | None:
    if key_file is None:
        return None
    key = key_from_passphrase_file(key_file)
    return Signing(key, file=StampFile(key))
