"""Asks and listens for a while, and brings what the checks judge. It only ever reads."""

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from companion.config import Config
from companion.mavlink.errors import CommandRefused, LinkTimeout
from companion.mavlink.messages import dialect, message_id
from companion.mavlink.stats import LinkStats
from companion.preflight.evidence import Evidence, Identity, LinkQuality, Stage
from companion.preflight.link_listener import LinkListener
from companion.preflight.parameter_survey import Survey, survey
from companion.vehicle.clock_estimates import DelayUnknown
from companion.vehicle.link import Link
from companion.vehicle.streams import StreamRate

_WARNING = 4
"""MAV_SEVERITY: this and below is a warning or worse."""
_RELEASES = {0: "-dev", 64: "-alpha", 128: "-beta", 192: "-rc", 255: ""}
"""FIRMWARE_VERSION_TYPE, the lowest byte of `flight_sw_version`."""


def wanted_rates(config: Config, link: Link) -> dict[str, float]:
    """The telemetry a flight asks for, in Hz by message."""
    return {
        **link.autopilot.wanted_rates,
        "ATTITUDE_QUATERNION": config.link.attitude_rate_hz,
        "LOCAL_POSITION_NED": config.link.position_rate_hz,
    }


async def gather(
    link: Link,
    granted: Mapping[str, StreamRate],
    seconds: float,
    *,
    stage: Stage = Stage.GROUND,
    thorough: bool = False,
    notices: Sequence[str] = (),
    known: Survey | None = None,
) -> Evidence:
    """What a flight looks at before it arms; the parameters are read while the rates are counted.

    Args:
        link: To a vehicle that was heard.
        granted: What was asked for.
        seconds: To count for.
        stage: What the vehicle is to be judged for.
        thorough: Ask what forbids arming, too.
        notices: What the link said of itself; read at the end.
        known: The same vehicle's parameters, where they were read before.

    Raises:
        LinkLost: The connection dropped meanwhile.
    """
    loop = asyncio.get_running_loop()
    before, began = replace(link.stats), loop.time()
    with LinkListener(link, loop.time) as ear:
        read, achieved, identity = await asyncio.gather(
            survey(link, link.autopilot.parameters, before=known),
            link.measure_rates(granted, seconds),
            _identity_and_words(link) if thorough else identify(link),
        )
    counts = link.stats.by_message
    return Evidence(
        autopilot=link.autopilot,
        state=link.state,
        survey=read,
        streams={name: rate._replace(achieved=achieved[name]) for name, rate in granted.items()},
        received={name: counts.get(message_id(name), 0) for name in granted},
        window=seconds,
        link=_quality(link, before, tuple(notices)),
        samples=ear.samples,
        company=ear.company,
        resets=ear.resets,
        identity=identity,
        stage=stage,
        words=tuple(
            text.text
            for text in link.state.texts
            if text.severity <= _WARNING and text.time >= began
        ),
    )


async def identify(link: Link) -> Identity:
    """What the autopilot is, as far as it says; raises `LinkLost`."""
    try:
        told = await link.request_message("AUTOPILOT_VERSION")
    except (CommandRefused, LinkTimeout):
        return Identity()
    number = told.flight_sw_version
    version = ".".join(str(number >> shift & 0xFF) for shift in (24, 16, 8))
    return Identity(
        version=version + _RELEASES.get(number & 0xFF, ""),
        capabilities=told.capabilities,
        uid=bytes(told.uid2).hex() if any(told.uid2) else f"{told.uid:016x}" if told.uid else None,
    )


async def _identity_and_words(link: Link) -> Identity:
    """What the autopilot is; and let it say what forbids arming."""
    if not link.state.armed:
        # It answers in texts, and ArduPilot gives them by itself only every 30 s.
        with suppress(CommandRefused, LinkTimeout):
            await link.command(dialect.MAV_CMD_RUN_PREARM_CHECKS, retries=1)
    return await identify(link)


def _quality(link: Link, before: LinkStats, notices: tuple[str, ...]) -> LinkQuality:
    now = link.stats
    return LinkQuality(
        frames=now.frames - before.frames,
        lost=now.lost - before.lost,
        damaged=now.bad_crc - before.bad_crc,
        not_finite=now.non_finite - before.non_finite,
        reconnects=now.reconnects - before.reconnects,
        round_trip=link.timesync.round_trip_s,
        jitter=link.timesync.jitter_s,
        notices=notices,
        other_clock=link.clock.delay.unknown is DelayUnknown.OTHER_CLOCK,
    )
