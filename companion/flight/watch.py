"""The deadman and the pilot's right: judged on a timer and at every heartbeat."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from companion.flight.control_loop import ControlLoop
from companion.flight.ending import Exit, FlightEnded
from companion.flight.guide import Guide
from companion.flight.phases import Phase
from companion.flight.roles import Role, require_role, role_of
from companion.flight.safety import SafetyMonitors
from companion.mavlink.errors import LinkError
from companion.mavlink.link import Link


class Watch:
    """Notices what the control loop cannot: that nothing comes, or that others fly the vehicle.

    Args:
        release: ends control; called when it stood still too long, for it is not taken up again.
        silence_limit: how long control may stand still before it is given up, s.
        clock: our clock, s.
    """

    def __init__(
        self,
        link: Link,
        loop: ControlLoop,
        guide: Guide,
        monitors: SafetyMonitors,
        *,
        release: Callable[[], None],
        silence_limit: float,
        clock: Callable[[], float],
    ) -> None:
        self._link = link
        self._loop = loop
        self._guide = guide
        self._monitors = monitors
        self._release = release
        self._silence_limit = silence_limit
        self._clock = clock
        self._question: asyncio.Task[None] | None = None

    def judge(self, phase: Phase) -> None:
        """Judge once.

        Raises:
            FlightEnded: control must end, with the reason and what is to be done.
        """
        self._judge_mode(phase)
        if not (phase.monitored and self._loop.guarded):
            return
        if self._clock() - self._loop.last_answer > self._silence_limit:
            reason = self._why_silent()
            self._release()
            raise FlightEnded(reason, Exit.HOLD)
        self._monitors.check(self._guide.pose)

    def on_heartbeat(self, phase: Phase) -> None:
        """A heartbeat came: it tells whether we may go on after a gap.

        Raises:
            FlightEnded: as `judge`.
        """
        self.judge(phase)
        if self._loop.held_back and self._role() is Role.OFFBOARD:
            self._loop.resume()

    def ask_mode(self) -> None:
        """Ask for a heartbeat now rather than wait up to a second for the next one."""
        self._question = asyncio.create_task(self._ask())

    async def _ask(self) -> None:
        with suppress(LinkError):  # no answer: the silence limit decides
            await self._link.request_message("HEARTBEAT")

    def _judge_mode(self, phase: Phase) -> None:
        if phase.modes:
            require_role(self._link, phase.modes)

    def _role(self) -> Role | None:
        return role_of(self._link.family, self._link.state.mode)

    def _why_silent(self) -> str:
        now, limit, loop = self._clock(), self._silence_limit, self._loop
        if now - loop.last_sample > limit:
            return f"no attitude from the vehicle for {now - loop.last_sample:.1f} s"
        if now - loop.last_newer > limit:
            return "the vehicle's clock stands still"
        if now - loop.last_fresh > limit:
            return "attitude arrives later than deadman.telemetry_stale_ms"
        if loop.command is None or now - loop.command.made_at > limit:
            return "no position from the vehicle"
        if loop.held_back:
            return "after a gap in telemetry the autopilot did not confirm offboard"
        return "attitude from the vehicle cannot be used"
