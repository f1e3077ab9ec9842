"""Requests message rates, and measures the rates at which messages arrive."""

import asyncio
from collections.abc import Iterable, Mapping
from math import floor
from typing import NamedTuple

from companion.mavlink.commands import CommandClient
from companion.mavlink.errors import CommandRefused
from companion.mavlink.messages import dialect, message_id
from companion.mavlink.stats import LinkStats

_DISABLED_INTERVAL = -1.0
_TIMEOUT_S = 1.0
_RETRIES = 3
_MAX_HALVINGS = 3
_ROUNDING_TOLERANCE = 1e-6  # so that a rounding error, as in 1e6 / 333.333…, loses no step


class StreamRate(NamedTuple):
    """The rate of one message, as requested, granted and measured, Hz."""

    requested: float
    """Requested rate; 0 requests that the message stops."""
    granted: float
    """Rate that the autopilot accepted; 0 if it refused all rates."""
    achieved: float
    """Measured rate, which may differ from `granted`: PX4 accepts requests (other than for
    HEARTBEAT) at any rate, and sends as often as its loops allow."""
    refusal: str = ""
    """Result of the last refused request if all were refused, otherwise empty."""


async def set_rates(
    commands: CommandClient,
    stats: LinkStats,
    rates: Mapping[str, float],
    window_s: float,
    interval_step_us: int,
) -> dict[str, StreamRate]:
    """Request an interval for each message, then count arrivals; see `VehicleClient.set_rates`.

    ArduPilot denies a rate above its loop rate and keeps the old one, so a denied rate is halved
    and requested again, up to three times. Intervals are rounded down to a whole multiple of
    `interval_step_us`, us.
    """
    message_ids = {name: message_id(name) for name in rates}
    granted_and_refusal = {
        name: await _request_rate(commands, message_ids[name], rate, interval_step_us)
        for name, rate in rates.items()
    }
    achieved = await measure_rates(stats, rates, window_s)
    return {
        name: StreamRate(
            rate, granted_and_refusal[name][0], achieved[name], granted_and_refusal[name][1]
        )
        for name, rate in rates.items()
    }


async def _request_rate(
    commands: CommandClient, message_number: int, rate: float, interval_step_us: int
) -> tuple[float, str]:
    """Request a message rate (Hz); return the granted rate, and the last refusal if it is 0."""
    refusal = ""
    for _ in range(_MAX_HALVINGS + 1):
        interval_us = _DISABLED_INTERVAL
        if rate > 0.0:
            steps = max(1, floor(1e6 / rate / interval_step_us + _ROUNDING_TOLERANCE))
            interval_us = float(steps * interval_step_us)
        try:
            params = (float(message_number), interval_us)
            await commands.send(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, params, _TIMEOUT_S, _RETRIES)
        except CommandRefused as error:
            refusal = error.result_name
            if error.result != dialect.MAV_RESULT_DENIED or rate <= 0.0:
                break
            rate /= 2.0
        else:
            return (1e6 / interval_us if rate > 0.0 else 0.0), ""
    return 0.0, refusal


async def measure_rates(
    stats: LinkStats, names: Iterable[str], window_s: float
) -> dict[str, float]:
    """Rates in Hz at which messages arrive, by name; see `VehicleClient.measure_rates`."""
    message_ids = {name: message_id(name) for name in names}
    counts_before = dict(stats.by_message)
    start_time = asyncio.get_running_loop().time()
    await asyncio.sleep(window_s)
    elapsed = asyncio.get_running_loop().time() - start_time
    return {
        name: (stats.by_message.get(number, 0) - counts_before.get(number, 0)) / elapsed
        for name, number in message_ids.items()
    }
