"""What every phase and the watch work with."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from companion.config import Config
from companion.flight.control_loop import ControlLoop
from companion.flight.guide import Guide
from companion.flight.safety import Lookout
from companion.guidance import Sequence
from companion.mavlink.errors import LinkError
from companion.mavlink.link import Link
from companion.mavlink.records import LocalPosition

_POLL = 0.02
"""How often a condition is looked at, s; telemetry that changes it is slower."""

_SLOWEST_HEARTBEAT = 3.0


@dataclass(slots=True)
class Rig:
    """The parts of one flight, and the little that its phases tell each other.

    Attributes:
        detail: what the running phase waits for just now, for the user.
        rate_hz: setpoints a second while the programme was flown.
        heartbeat_limit: a mode older than this, in s, is not known any more; set by the checks
            from the rate at which heartbeats really come.
        mode_at_checks: the mode when the checks were over; another one before arming is somebody's.
        arm_sent: whether we asked the autopilot to arm.
        note: writes down and shows that something happened.
    """

    config: Config
    link: Link
    loop: ControlLoop
    guide: Guide
    lookout: Lookout
    programme: Sequence
    detail: str = ""
    rate_hz: float = 0.0
    heartbeat_limit: float = _SLOWEST_HEARTBEAT
    mode_at_checks: str | None = None
    arm_sent: bool = False
    note: Callable[[str], None] = lambda _: None

    def release(self) -> None:
        """Stop answering samples: from here on nothing is sent that steers."""
        self.loop.on = False
        self.loop.guarded = False
        self.link.quiet()
        self.guide.stand_by()

    async def until(self, condition: Callable[[], bool], detail: str | None = None) -> None:
        """Wait for a condition of the telemetry."""
        if detail is not None:
            self.detail = detail
        while not condition():  # noqa: ASYNC110 - telemetry sets no events
            await asyncio.sleep(_POLL)

    async def fresh_heartbeat(self) -> None:
        """Wait for a heartbeat that is newer than this call; asked for, or the next one due."""
        began = asyncio.get_running_loop().time()

        def newer() -> bool:
            heartbeat = self.link.state.heartbeat
            return heartbeat is not None and heartbeat.received >= began

        # One that comes by itself is as good: a lost answer must not keep us waiting.
        question = asyncio.create_task(self._ask_heartbeat())
        try:
            await self.until(newer)
        finally:
            question.cancel()

    async def _ask_heartbeat(self) -> None:
        with suppress(LinkError):  # an autopilot that does not send it on demand sends it anyway
            await self.link.request_message("HEARTBEAT")

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, unless guidance finds it stale."""
        return self.guide.fresh_position()

    def armed(self) -> bool:
        """Whether the autopilot says that it is armed."""
        return self.link.state.armed is True
