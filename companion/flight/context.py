"""The flight context: the parts of one flight that every phase and the safety watch use."""

import asyncio
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf
from typing import Any

from companion.attitude import is_unit
from companion.attitude.kinematics import tilt_angle
from companion.config import Config
from companion.config.known_drag import KnownDrag
from companion.control.control_loop import ControlLoop
from companion.control.ground_contact import GroundContact
from companion.control.guidance_loop import GuidanceLoop
from companion.flight.preflight_checks import PreflightChecks
from companion.flight.vehicle_identity import ReplacementDetector
from companion.guidance import ManeuverSequence
from companion.guidance.fence import FenceCentre
from companion.guidance.reference import NorthEast
from companion.mavlink.errors import LinkError
from companion.mavlink.messages import dialect
from companion.safety.actions import Exit, FlightEnded
from companion.safety.snapshot_builder import SnapshotBuilder
from companion.vehicle.link import Link
from companion.vehicle.records import LocalPosition

INITIAL_HEARTBEAT_LIMIT = 3.0
"""`FlightContext.heartbeat_limit` until the checks have measured the heartbeat rate, s."""

_POLL_PERIOD = 0.02
"""Period with which a condition is checked, s; shorter than the period of telemetry."""

_LAST_SETPOINT_TIMEOUT = 0.1
"""Time allowed to send the last setpoint, s: it is sent when the next attitude sample arrives."""

_BACKLOG_DRAIN_TIME = 0.5
"""Time after a stall of this program within which the queued telemetry is read, s."""

_SHORTEST_STALL = 0.2
"""Time for which this program stalled, s, from which telemetry may be queued: a heartbeat awaited
meanwhile does not count as fresh, and a timeout is extended (`wait_for_first`)."""

_MAX_STALLED_WAITS = 3
"""After this number of waits with a stall, a heartbeat counts as fresh: a computer that always
stalls must still be able to hand back."""

_MAX_ATTITUDE_AGE = 1.0
"""Largest age of the attitude from which the tilt is computed, s."""

_HEARTBEAT_ID = 0.0
"""Message id of HEARTBEAT, as a float for the command that requests a message."""


async def wait_for_first(awaited: Iterable[asyncio.Future[Any]], seconds: float) -> None:
    """Wait until one of `awaited` is done, at most `seconds` s in which this program runs.

    After a stall of this program, what happened meanwhile has yet to be read.
    """
    clock, timeout = asyncio.get_running_loop().time, None if seconds == inf else seconds
    due = clock() + seconds
    done, _ = await asyncio.wait(awaited, timeout=timeout, return_when=asyncio.FIRST_COMPLETED)
    stalled = clock() - due
    if not done and stalled > _SHORTEST_STALL:
        timeout = min(stalled, seconds)
        await asyncio.wait(awaited, timeout=timeout, return_when=asyncio.FIRST_COMPLETED)


@dataclass(slots=True)
class FlightContext:
    """The parts of one flight, and the state that its phases share."""

    config: Config
    link: Link
    loop: ControlLoop
    guidance_loop: GuidanceLoop
    snapshot_builder: SnapshotBuilder
    maneuvers: ManeuverSequence
    ground: GroundContact
    preflight: PreflightChecks
    replacement_detector: ReplacementDetector
    known_drag: KnownDrag = field(default_factory=KnownDrag)
    """What was known of the vehicle's drag when the checks ended."""
    waiting_for: str = ""
    """What the running phase waits for, shown to the user."""
    setpoint_rate_hz: float = 0.0
    """Rate of setpoints over the maneuvers, Hz."""
    heartbeat_limit: float = INITIAL_HEARTBEAT_LIMIT
    """Largest age of the last report of the mode, s, before it counts as unknown; the checks set
    this limit from the heartbeat rate."""
    mode_at_checks: str | None = None
    """The mode when the checks ended. If the mode differs before we command arming, the pilot or
    another station has changed it, and the flight ends."""
    must_disarm: bool = False
    """Whether the flight must disarm the vehicle on the ground, because we commanded arming or
    take-off."""
    takeoff_position: NorthEast | None = None
    """Position (north, east) where we commanded the take-off, m; None before the take-off, and
    after the takeover or the start of the landing. If the link is lost during the take-off, the
    vehicle would hover without end, so it must land when it is heard again."""
    landing_requested: bool = False
    """Whether a landing was requested; if the link is lost afterwards, the vehicle must land."""
    fence_centre: FenceCentre | None = None
    """Centre of the fence in an earlier flight, if the vehicle has not been disarmed since; None:
    the fence is centred where control begins."""
    released_by: Callable[[], str] = lambda: ""
    """Returns the name of a client in control that has just commanded another mode; else ""."""
    note: Callable[[str], None] = lambda _: None
    """Records and shows an event."""

    def release(self) -> None:
        """Stop the setpoints at once."""
        self.loop.release()
        self.guidance_loop.stand_by()

    def end_stream(self) -> None:
        """Stop the setpoints; if the autopilot obeys us, the last setpoint has zero body rates.

        Call this method if this program ends the control. If the pilot has taken over, or data are
        doubtful, call `release`.
        """
        self.loop.end_stream()
        self.guidance_loop.stand_by()

    async def stop(self, tasks: Iterable[asyncio.Task[Any]]) -> None:
        """Cancel `tasks`, end the setpoints, and wait until the last setpoint was sent."""
        try:
            for task in tasks:
                await cancel(task)
            self.loop.end_stream()
            with suppress(TimeoutError):
                async with asyncio.timeout(_LAST_SETPOINT_TIMEOUT):
                    await self.until(lambda: not self.loop.on)
        finally:
            self.release()

    async def until(self, condition: Callable[[], bool], waiting_for: str | None = None) -> None:
        """Wait until `condition` holds; `waiting_for` tells the user what the phase waits for."""
        if waiting_for is not None:
            self.waiting_for = waiting_for
        while not condition():  # noqa: ASYNC110 - telemetry sets no events
            await asyncio.sleep(_POLL_PERIOD)

    def timed_out(self, seconds: float, waited_for: str, exit_: Exit | None = None) -> FlightEnded:
        """The exception to raise for a wait that took longer than `seconds`."""
        return FlightEnded(f"waited {seconds:g} s for {waited_for}: {self.waiting_for}", exit_)

    async def fresh_heartbeat(self) -> None:
        """Wait for a heartbeat that left the vehicle after this call.

        After a stall of this program, queued frames look new, so a heartbeat is requested. The
        heartbeat after the answer is fresh; without an answer, a heartbeat after
        `_BACKLOG_DRAIN_TIME` is fresh. If this program stalls during the wait, the answer may have
        been queued, too, so this function waits again.
        """
        # The watch reads these counters on each heartbeat, so before the wait below ends.
        counters, clock = self.snapshot_builder.counters, asyncio.get_running_loop().time
        for _ in range(_MAX_STALLED_WAITS):
            began = clock()
            await self._wait_for_heartbeat()
            if counters.stall_time(since=began) < _SHORTEST_STALL:
                return

    async def _wait_for_heartbeat(self) -> None:
        """Wait for a heartbeat like `fresh_heartbeat`, but do not wait again after a stall."""
        loop = asyncio.get_running_loop()
        fresh_from = loop.time() + _BACKLOG_DRAIN_TIME
        heartbeat_future = loop.create_future()

        async def request_heartbeat() -> None:
            nonlocal fresh_from
            with suppress(LinkError):
                for _ in range(2):  # PX4 sends the first heartbeat before its answer
                    await self.link.command(
                        dialect.MAV_CMD_REQUEST_MESSAGE, _HEARTBEAT_ID, retries=0
                    )
                    fresh_from = min(fresh_from, loop.time())

        def on_heartbeat(_: object) -> None:
            heartbeat = self.link.state.heartbeat
            if (
                heartbeat is not None
                and heartbeat.received >= fresh_from
                and not heartbeat_future.done()
            ):
                heartbeat_future.set_result(None)

        unsubscribe = self.link.subscribe("HEARTBEAT", on_heartbeat)
        request_task = asyncio.create_task(request_heartbeat())
        try:
            await heartbeat_future
        finally:
            request_task.cancel()
            unsubscribe()

    async def next_position(self) -> LocalPosition:
        """The newest position, or the next one if there is no fresh one."""
        while (position := self.fresh_position()) is None:
            await self.until(lambda: self.fresh_position() is not None, "a fresh position")
        return position

    def fresh_position(self) -> LocalPosition | None:
        """The newest position, or None if it is stale."""
        return self.guidance_loop.fresh_position()

    def tilt(self) -> float | None:
        """Tilt of the vehicle, rad; None if its attitude is stale or no unit quaternion."""
        sample, now = self.loop.resets.newest_attitude, asyncio.get_running_loop().time()
        if sample is None or now - sample.received > _MAX_ATTITUDE_AGE or not is_unit(sample.q):
            return None
        return tilt_angle(sample.q[1], sample.q[2])

    def heard_instead(self) -> str:
        """Other systems that are heard, as a clause for the user; "" if there is none.

        A vehicle may come back from a restart with another system id.
        """
        link = self.config.link
        sources = self.link.stats.foreign_sources
        systems = {system for system, component in sources if component == link.target_component}
        if not systems:
            return ""
        names = ", ".join(map(str, sorted(systems)))
        return f"; system {names} is heard, but link.target_system is {link.target_system}"

    def armed(self) -> bool:
        """Whether the autopilot reports that the vehicle is armed."""
        return self.link.state.armed is True


async def cancel(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait until it has ended; ignore its result or exception."""
    task.cancel()
    await asyncio.wait({task})
    if not task.cancelled():
        task.exception()
