"""Requests attitude, position or a status again if another station has lowered its rate."""

import asyncio
from collections.abc import Callable
from math import inf

from companion.config.computer import LinkConfig
from companion.mavlink.errors import LinkError
from companion.safety.snapshot import Health
from companion.vehicle.link import Link
from companion.vehicle.records import MAX_TELEMETRY_AGE

_REQUEST_AGE_FRACTION = 0.5
"""A status message, such as SYS_STATUS, is requested again when its age exceeds this share of the
age from which it counts as unknown."""
_REQUEST_PERIOD = 5.0
"""Shortest time between two requests for one message, s. If the rate stays low, monitors end the
flight sooner. QGroundControl lowers rates every 11 s while ArduPilot sends no BATTERY_STATUS."""
_MAX_POSITION_AGE = 0.2
"""A status is requested only while positions are newer than this, s: else the link is silent."""
_LARGEST_STARVED_SHARE = 0.5
"""If this program was stopped for a larger share of the second, low rates are its own fault."""
_LONGEST_CHECK_PERIOD = 0.5
"""After a longer time between two checks this program was stopped: statuses wait to be read, s."""
_COUNTING_TIME = 0.1
"""Window in which `set_rates` counts messages, s; short, because the result is not used."""


def low_rate_text(message: str, rate: float) -> str:
    """The text of an event: a message comes too rarely, and `rate` (Hz) is requested again."""
    return f"{message} comes too rarely: requesting {rate:g} Hz again"


class RateRequester:
    """Requests a message again if its rate has become too low: another station may have changed it.

    It sends SET_MESSAGE_INTERVAL at most once in `_REQUEST_PERIOD` for each message, and does not
    block.

    Attributes:
        note: called with messages about requests and their errors.
    """

    def __init__(self, link: Link, link_config: LinkConfig) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._link = link
        self._link_config = link_config
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._requested_at: dict[str, float] = {}
        self._last_silence = self._checked_at = -inf

    def check(self, now: float, health: Health) -> None:
        """Request each message whose rate is too low at `now`, s of event-loop time."""
        if (health.starved_share or 0.0) > _LARGEST_STARVED_SHARE:
            return  # this program did not run, so it did not count
        settings = self._link_config
        answer_rate, position_rate = health.answer_rate, health.position_rate
        # After a request, one more gap may have another cause; a low rate causes two at once.
        accepted_gaps = 1 if "ATTITUDE_QUATERNION" in self._tasks else 0
        is_slow = answer_rate is not None and answer_rate < settings.min_attitude_rate_hz
        if is_slow or health.gaps > accepted_gaps:
            self._request(now, "ATTITUDE_QUATERNION", settings.attitude_rate_hz)
        if position_rate is not None and position_rate < settings.min_position_rate_hz:
            self._request(now, "LOCAL_POSITION_NED", settings.position_rate_hz)

    def _request(self, now: float, message: str, rate: float) -> None:
        if now - self._requested_at.get(message, -inf) < _REQUEST_PERIOD:
            return
        self._requested_at[message] = now
        self.note(low_rate_text(message, rate))
        self._tasks[message] = asyncio.create_task(self._request_rate(message, rate))

    def check_statuses(self, now: float, heartbeat_limit: float) -> None:
        """Request each status that has come before, is overdue at `now`, and has a requested rate.

        Args:
            now: event-loop time, s.
            heartbeat_limit: age from which the mode counts as unknown, s.
        """
        state, wanted_rates = self._link.state, self._link.autopilot.wanted_rates
        since_check, self._checked_at = now - self._checked_at, now
        is_silent = state.position is None or now - state.position.received > _MAX_POSITION_AGE
        if is_silent or since_check > _LONGEST_CHECK_PERIOD:
            self._last_silence = now
            return
        statuses = (
            ("HEARTBEAT", state.heartbeat, heartbeat_limit),
            ("GPS_RAW_INT", state.gps, MAX_TELEMETRY_AGE),
            ("SYS_STATUS", state.battery, MAX_TELEMETRY_AGE),
            ("EXTENDED_SYS_STATE", state.landed_state, MAX_TELEMETRY_AGE),
            ("ESTIMATOR_STATUS", state.estimator, MAX_TELEMETRY_AGE),
            ("EKF_STATUS_REPORT", state.estimator, MAX_TELEMETRY_AGE),
        )
        for message, status, max_age in statuses:
            if message not in wanted_rates or status is None:
                continue
            if now - max(status.received, self._last_silence) > _REQUEST_AGE_FRACTION * max_age:
                self._request(now, message, wanted_rates[message])

    async def _request_rate(self, message: str, rate: float) -> None:
        try:
            await self._link.set_rates({message: rate}, window_s=_COUNTING_TIME)
        except LinkError as error:
            self.note(str(error))
