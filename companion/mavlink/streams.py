"""Asking for message rates, and counting what really comes."""

import asyncio
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from companion.mavlink.codec import message_id
from companion.mavlink.commands import CommandClient
from companion.mavlink.errors import CommandRefused
from companion.mavlink.stats import LinkStats

MAV_CMD_SET_MESSAGE_INTERVAL = 511
_DISABLE = -1.0
_TIMEOUT_S = 1.0
_RETRIES = 3


class StreamRate(NamedTuple):
    """What was asked for and what came, in Hz.

    Attributes:
        asked: Requested rate; 0 asked the autopilot to stop sending it.
        achieved: Counted over the window. An ACK says nothing about it: PX4 accepts every
            request and sends what its loops allow.
        refusal: The autopilot's answer if it refused, otherwise empty.
    """

    asked: float
    achieved: float
    refusal: str = ""


async def set_rates(
    commands: CommandClient, stats: LinkStats, rates: Mapping[str, float], window_s: float
) -> dict[str, StreamRate]:
    """Request an interval for each message, then count for `window_s` seconds.

    Raises:
        UnknownMessage: A name is not in MAVLink common; nothing was sent then.
        CommandTimeout: The autopilot did not answer a request.
        LinkLost: The connection dropped meanwhile.
    """
    numbers = {name: message_id(name) for name in rates}
    refusals: dict[str, str] = {}
    for name, rate in rates.items():
        interval_us = round(1e6 / rate) if rate > 0.0 else _DISABLE
        params = (float(numbers[name]), float(interval_us))
        try:
            await commands.send(MAV_CMD_SET_MESSAGE_INTERVAL, params, _TIMEOUT_S, _RETRIES)
        except CommandRefused as refused:
            refusals[name] = refused.result_name
    achieved = await measure(stats, rates, window_s)
    return {
        name: StreamRate(rate, achieved[name], refusals.get(name, ""))
        for name, rate in rates.items()
    }


async def measure(stats: LinkStats, names: Iterable[str], window_s: float) -> dict[str, float]:
    """Rates in Hz at which messages arrive, counted over `window_s` seconds."""
    numbers = {name: message_id(name) for name in names}
    before = dict(stats.by_message)
    began = asyncio.get_running_loop().time()
    await asyncio.sleep(window_s)
    elapsed = asyncio.get_running_loop().time() - began
    return {
        name: (stats.by_message.get(number, 0) - before.get(number, 0)) / elapsed
        for name, number in numbers.items()
    }
