"""The deadman and the pilot's right: judged on a timer and at every heartbeat."""

import asyncio
from collections.abc import Callable

from companion.flight.ending import Exit, FlightEnded
from companion.flight.phases import Phase
from companion.flight.rig import Rig
from companion.flight.roles import require_role, roles_of
from companion.mavlink.roles import Role

_HEARD = 0.3
"""Nothing at all from the vehicle for this long, s: it would not be heard taking over, either."""


class Watch:
    """Notices what the control loop cannot: that nothing comes, or that others fly the vehicle.

    Args:
        rig: the parts of the flight.
        silence_limit: how long control may stand still before it is given up, s.
        clock: our clock, s.
    """

    def __init__(self, rig: Rig, *, silence_limit: float, clock: Callable[[], float]) -> None:
        self._rig = rig
        self._silence_limit = silence_limit
        self._clock = clock
        self._frames = 0
        self._heard_at = clock()
        self._question: asyncio.Task[None] | None = None

    def judge(self, phase: Phase) -> None:
        """Judge once.

        Raises:
            FlightEnded: the phase must end, with the reason and what is to be done.
        """
        self._listen()
        loop = self._rig.loop
        if phase.modes:
            require_role(self._rig.link, phase.modes)
        if phase.monitored and loop.guarded:
            if self._clock() - loop.last_answer > self._silence_limit:
                self._give_up()
            self._rig.monitors.check(self._rig.guide.pose)
        if phase.modes:
            self._judge_heartbeat()

    def on_heartbeat(self, phase: Phase) -> None:
        """A heartbeat came: it tells whether we may go on after a gap.

        Raises:
            FlightEnded: as `judge`.
        """
        self.judge(phase)
        if self._rig.loop.held_back and Role.OFFBOARD in roles_of(self._rig.link):
            self._rig.loop.resume()

    def ask_mode(self) -> None:
        """Ask for a heartbeat now rather than wait for the next one."""
        # Without an answer the silence limit decides.
        self._question = asyncio.create_task(self._rig.fresh_heartbeat())

    def _listen(self) -> None:
        frames = self._rig.link.stats.frames
        if frames != self._frames:
            self._frames, self._heard_at = frames, self._clock()

    def _judge_heartbeat(self) -> None:
        heartbeat = self._rig.link.state.heartbeat
        if heartbeat is None or self._clock() - heartbeat.received > self._rig.heartbeat_limit:
            raise FlightEnded(
                "no heartbeat from the vehicle, so its mode is not known any more", Exit.LET_GO
            )

    def _give_up(self) -> None:
        """Control stood still too long: it is not taken up again.

        Raises:
            FlightEnded: asks for hold while the vehicle is heard; else its failsafe must do, for
                a pilot who took over could not be heard and would be overruled.
        """
        reason = self._why_silent()
        self._rig.release()
        heard = self._clock() - self._heard_at < _HEARD
        raise FlightEnded(reason, Exit.HOLD if heard else Exit.LET_GO)

    def _why_silent(self) -> str:
        now, limit, loop = self._clock(), self._silence_limit, self._rig.loop
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
        return "attitude from the vehicle cannot be used, or setpoints cannot leave"
