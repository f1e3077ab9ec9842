"""The pilot's right, and the safety ladder's look: on a timer and at every heartbeat."""

import asyncio
from collections.abc import Callable
from math import inf

from companion.flight.asking_again import AskingAgain
from companion.flight.context import FlightContext
from companion.flight.mode_roles import require_role, roles_of
from companion.flight.phases import Phase
from companion.safety import Action, SafetyLadder
from companion.safety.ending import Exit, FlightEnded
from companion.safety.monitor import EXITS
from companion.vehicle.autopilot import Role
from companion.vehicle.records import outdated

_STATUS_PERIOD = 0.45
"""PX4 sends CURRENT_MODE every 0.5 s while nothing changes; one that comes sooner is news."""
_QUESTION_PERIOD = 0.15
"""An autopilot that sends CURRENT_MODE as often as asked is not asked back as often, s."""


class Watch:
    """Notices what the control loop cannot: that nothing comes, or that others fly the vehicle.

    Args:
        context: the parts of the flight.
        ladder: judges what it sees while the autopilot obeys us.
        asking_again: asks for telemetry that has become too rare.
        clock: our clock, s.
    """

    def __init__(
        self,
        context: FlightContext,
        ladder: SafetyLadder,
        asking_again: AskingAgain,
        clock: Callable[[], float],
    ) -> None:
        self._context = context
        self._ladder = ladder
        self._clock = clock
        self._asking_again = asking_again
        self._status_at = self._status_asked_at = -inf
        self._status_question: asyncio.Task[None] | None = None
        self._question: asyncio.Task[None] | None = None

    def judge(self, phase: Phase) -> None:
        """Judge once.

        Raises:
            FlightEnded: the phase must end, with the reason and what is to be done.
        """
        now = self._clock()
        self._context.snapshot_builder.listen(now)
        self._context.ground.look()
        self._context.same_vehicle.look()
        self._context.same_vehicle.require()
        if phase.modes:
            require_role(self._context.link, phase.modes)
        if phase.monitored and self._context.loop.offboard_active:
            self._climb(now)
        if phase.modes:
            self._judge_heartbeat()

    def on_heartbeat(self, phase: Phase) -> None:
        """A heartbeat came: judge what it says.

        Raises:
            FlightEnded: as `judge`.
        """
        self.judge(phase)

    def on_current_mode(self, phase: Phase) -> None:
        """CURRENT_MODE came: twice a second, and at once when the vehicle's status changes.

        One that comes early may mean that it disarmed, or is in a failsafe. Only a heartbeat tells
        of those, so one is asked for; not more often, where an autopilot sends all that is asked.

        Raises:
            FlightEnded: as `judge`.
        """
        now = self._clock()
        early, self._status_at = now - self._status_at < _STATUS_PERIOD, now
        asking = self._status_question is not None and not self._status_question.done()
        if early and not asking and now - self._status_asked_at >= _QUESTION_PERIOD:
            self._status_asked_at = now
            self._status_question = asyncio.create_task(self._context.fresh_heartbeat())
        self.judge(phase)

    def ask_mode(self) -> None:
        """Ask for the mode now, and go on after a gap if the vehicle still obeys us."""
        # Without an answer the silence limit decides.
        self._question = asyncio.create_task(self._confirm())

    async def _confirm(self) -> None:
        """Wait for a heartbeat that is fresh: one that waited to be read may say what was."""
        await self._context.fresh_heartbeat()
        loop, state = self._context.loop, self._context.link.state
        roles = roles_of(self._context.link)
        # While we take over, the stream is needed before offboard is entered; in a failsafe that
        # came in between it would end the failsafe.
        entering = loop.taking_over and Role.READY in roles and not state.failsafe
        if loop.awaiting_mode and (Role.OFFBOARD in roles or entering):
            loop.resume()

    def _climb(self, now: float) -> None:
        """Let the ladder look, and do what it says."""
        snapshot = self._context.snapshot_builder.snapshot(now)
        self._asking_again.look(snapshot.health)
        verdict = self._ladder.step(snapshot)
        if verdict is None:
            return
        if verdict.action is Action.HOLD:
            self._context.guidance_loop.give_up()
            return
        if verdict.mutes:
            self._context.release()
        raise FlightEnded(verdict.reason, EXITS[verdict.action])

    def _judge_heartbeat(self) -> None:
        state, now = self._context.link.state, self._clock()
        if now - state.mode_received > self._context.heartbeat_limit:
            raise FlightEnded(
                "no heartbeat from the vehicle, so its mode is not known any more", Exit.RELEASE
            )
        if state.heartbeat is None or outdated(state.heartbeat.received, now):
            raise FlightEnded(
                "no heartbeat from the vehicle, so whether it is armed is not known any more",
                Exit.RELEASE,
            )
