"""Requests message rates, and counts what really comes."""

import asyncio
from collections.abc import Iterable, Mapping
from math import floor
from typing import NamedTuple

from companion.mavlink.commands import CommandClient
from companion.mavlink.errors import CommandRefused
from companion.mavlink.messages import message_id
from companion.mavlink.stats import LinkStats

MAV_CMD_SET_MESSAGE_INTERVAL = 511
_DISABLE = -1.0
_TIMEOUT_S = 1.0
_RETRIES = 3
_DENIED = 2
_HALVINGS = 3
_ROUNDING = 1e-6  # so that 1e6 / 333.333… does not lose a whole step


class StreamRate(NamedTuple):
    """A message's rate as requested, granted and counted, Hz.

    Attributes:
        asked: Requested rate; 0 asked the autopilot to stop sending it.
        granted: What the autopilot agreed to; 0 if it refused altogether.
        achieved: Counted over the window. An ACK says nothing about it: PX4 accepts every
            request and sends what its loops allow.
        refusal: The autopilot's answer if it refused, otherwise empty.
    """

    asked: float
    granted: float
    achieved: float
    refusal: str = ""


async def set_rates(
    commands: CommandClient,
    stats: LinkStats,
    rates: Mapping[str, float],
    window_s: float,
    interval_step_us: int,
) -> dict[str, StreamRate]:
    """Request an interval for each message, then count for `window_s` seconds.

    A denied rate is halved until it is granted: ArduPilot denies rates above its loop rate, and
    keeps the rate it had.

    Args:
        commands: Sends the requests.
        stats: Counts what comes.
        rates: In Hz, by message; 0 stops one.
        window_s: How long to count, s.
        interval_step_us: Intervals are rounded down to whole multiples of this.

    Raises:
        UnknownMessage: A name is not in the dialect; nothing was sent then.
        CommandTimeout: The autopilot did not answer a request.
        LinkLost: The connection dropped meanwhile.
    """
    numbers = {name: message_id(name) for name in rates}
    answers = {
        name: await _request(commands, numbers[name], rate, interval_step_us)
        for name, rate in rates.items()
    }
    achieved = await measure(stats, rates, window_s)
    return {
        name: StreamRate(rate, answers[name][0], achieved[name], answers[name][1])
        for name, rate in rates.items()
    }


async def _request(
    commands: CommandClient, number: int, rate: float, interval_step_us: int
) -> tuple[float, str]:
    """Request one message; what was granted in Hz, and the last refusal if nothing was."""
    refusal = ""
    for _ in range(_HALVINGS + 1):
        interval_us = _DISABLE
        if rate > 0.0:
            steps = max(1, floor(1e6 / rate / interval_step_us + _ROUNDING))
            interval_us = float(steps * interval_step_us)
        try:
            params = (float(number), interval_us)
            await commands.send(MAV_CMD_SET_MESSAGE_INTERVAL, params, _TIMEOUT_S, _RETRIES)
        except CommandRefused as refused:
            refusal = refused.result_name
            if refused.result != _DENIED or rate <= 0.0:
                break
            rate /= 2.0
        else:
            return (1e6 / interval_us if rate > 0.0 else 0.0), ""
    return 0.0, refusal


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
