"""What every phase and the watch work with."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from companion.config import Config
from companion.control.control_loop import ControlLoop
from companion.control.ground_contact import GroundContact
from companion.control.guidance_loop import GuidanceLoop
from companion.flight.preflight_checks import PreflightChecks
from companion.flight.vehicle_identity import SameVehicle
from companion.guidance import ManeuverSequence
from companion.mavlink.commands import MAV_CMD_REQUEST_MESSAGE
from companion.mavlink.errors import LinkError
from companion.safety.snapshot_builder import SnapshotBuilder
from companion.vehicle.link import Link
from companion.vehicle.records import LocalPosition

SLOWEST_HEARTBEAT = 3.0
"""A mode older than this, s, is not known any more, until it is known how often heartbeats come."""

_POLL = 0.02
"""How often a condition is looked at, s; telemetry that changes it is slower."""

_BACKLOG = 0.5
"""What waited to be read while we stood still has been read so long, s, after we go on."""

_HEARTBEAT = 0.0
"""Number of the message."""


@dataclass(slots=True)
class FlightContext:
    """The parts of one flight, and the little that its phases tell each other.

    Attributes:
        detail: what the running phase waits for just now, for the user.
        rate_hz: setpoints a second while the maneuver was flown.
        heartbeat_limit: a mode older than this, in s, is not known any more; set by the checks
            from the rate at which heartbeats really come.
        mode_at_checks: the mode when the checks were over; another one before arming is somebody's.
        arm_sent: whether we asked the autopilot to arm.
        note: writes down and shows that something happened.
    """

    config: Config
    link: Link
    loop: ControlLoop
    guidance_loop: GuidanceLoop
    snapshot_builder: SnapshotBuilder
    maneuvers: ManeuverSequence
    ground: GroundContact
    preflight: PreflightChecks
    same_vehicle: SameVehicle
    detail: str = ""
    rate_hz: float = 0.0
    heartbeat_limit: float = SLOWEST_HEARTBEAT
    mode_at_checks: str | None = None
    arm_sent: bool = False
    note: Callable[[str], None] = lambda _: None

    def release(self) -> None:
        """Stop answering samples: from here on nothing is sent that steers."""
        self.loop.on = False
        self.loop.offboard_active = self.loop.taking_over = False
        self.guidance_loop.stand_by()

    async def until(self, condition: Callable[[], bool], detail: str | None = None) -> None:
        """Wait for a condition of the telemetry."""
        if detail is not None:
            self.detail = detail
        while not condition():  # noqa: ASYNC110 - telemetry sets no events
            await asyncio.sleep(_POLL)

    async def fresh_heartbeat(self) -> None:
        """Wait for a heartbeat that left the vehicle after this call.

        What we read now may have waited long, if we stood still. The answer to a question does not
        come before what was sent before it was asked, so the next heartbeat after it is fresh; and
        so is one that comes when all that waited must have been read, should no answer come.
        """
        loop = asyncio.get_running_loop()
        since = loop.time() + _BACKLOG
        fresh = loop.create_future()

        async def ask() -> None:
            nonlocal since
            with suppress(LinkError):
                for _ in range(2):  # PX4 sends it before its answer, so only the second one counts
                    await self.link.command(MAV_CMD_REQUEST_MESSAGE, _HEARTBEAT, retries=0)
                    since = min(since, loop.time())

        def look(_: object) -> None:
            heartbeat = self.link.state.heartbeat
            if heartbeat is not None and heartbeat.received >= since and not fresh.done():
                fresh.set_result(None)

        unsubscribe = self.link.subscribe("HEARTBEAT", look)
        question = asyncio.create_task(ask())
        try:
            await fresh
        finally:
            question.cancel()
            unsubscribe()

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, unless guidance finds it stale."""
        return self.guidance_loop.fresh_position()

    def armed(self) -> bool:
        """Whether the autopilot says that it is armed."""
        return self.link.state.armed is True


async def cancel(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait until it has ended; its result was read elsewhere."""
    task.cancel()
    await asyncio.wait({task})
    if not task.cancelled():
        task.exception()
