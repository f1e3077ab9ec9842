"""Asks once, in flight, for telemetry that has become rare: somebody else may have lowered it."""

import asyncio
from collections.abc import Callable

from companion.config.computer import LinkConfig
from companion.mavlink.errors import LinkError
from companion.safety.snapshot import Health
from companion.vehicle.link import Link

_COUNTED = 0.1
"""`set_rates` counts what arrives for so long, s; nobody waits for it."""


class AskingAgain:
    """Requests a rate again, at most once a flight for each message, and waits for nothing.

    SET_MESSAGE_INTERVAL changes nothing of what the vehicle does.

    Attributes:
        note: Takes what was asked for, and what was answered amiss, in words.

    Args:
        link: To the vehicle.
        section: The rates.
    """

    def __init__(self, link: Link, section: LinkConfig) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._link = link
        self._section = section
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def look(self, health: Health) -> None:
        """Ask for what comes too rarely just now."""
        section = self._section
        answers, positions = health.answer_rate, health.position_rate
        if health.gaps or (answers is not None and answers < section.min_attitude_rate_hz):
            self._ask("ATTITUDE_QUATERNION", section.attitude_rate_hz)
        if positions is not None and positions < section.min_position_rate_hz:
            self._ask("LOCAL_POSITION_NED", section.position_rate_hz)

    def _ask(self, message: str, rate: float) -> None:
        if message not in self._tasks:
            self.note(f"{message} comes too rarely: asking for {rate:g} Hz again")
            self._tasks[message] = asyncio.create_task(self._request(message, rate))

    async def _request(self, message: str, rate: float) -> None:
        try:
            await self._link.set_rates({message: rate}, window_s=_COUNTED)
        except LinkError as error:
            self.note(str(error))
