"""The pilot's right, and the safety ladder's look: on a timer and at every heartbeat."""

import asyncio
from collections.abc import Callable

from companion.flight.asking_again import AskingAgain
from companion.flight.ending import Exit, FlightEnded
from companion.flight.phases import Phase
from companion.flight.rig import Rig
from companion.flight.roles import require_role, roles_of
from companion.flight.safety import Action, SafetyLadder
from companion.flight.safety.monitor import EXITS
from companion.mavlink.roles import Role


class Watch:
    """Notices what the control loop cannot: that nothing comes, or that others fly the vehicle.

    Args:
        rig: the parts of the flight.
        ladder: judges what it sees while the autopilot obeys us.
        asking_again: asks for telemetry that has become too rare.
        clock: our clock, s.
    """

    def __init__(
        self,
        rig: Rig,
        ladder: SafetyLadder,
        asking_again: AskingAgain,
        clock: Callable[[], float],
    ) -> None:
        self._rig = rig
        self._ladder = ladder
        self._clock = clock
        self._asking_again = asking_again
        self._question: asyncio.Task[None] | None = None

    def judge(self, phase: Phase) -> None:
        """Judge once.

        Raises:
            FlightEnded: the phase must end, with the reason and what is to be done.
        """
        now = self._clock()
        self._rig.lookout.listen(now)
        self._rig.ground.look()
        self._rig.same_vehicle.require()
        if phase.modes:
            require_role(self._rig.link, phase.modes)
        if phase.monitored and self._rig.loop.guarded:
            self._climb(now)
        if phase.modes:
            self._judge_heartbeat()

    def on_heartbeat(self, phase: Phase) -> None:
        """A heartbeat came: it tells whether we may go on after a gap.

        Raises:
            FlightEnded: as `judge`.
        """
        self._rig.same_vehicle.note_heartbeat()
        self.judge(phase)
        if self._rig.loop.held_back and Role.OFFBOARD in roles_of(self._rig.link):
            self._rig.loop.resume()

    def ask_mode(self) -> None:
        """Ask for a heartbeat now rather than wait for the next one."""
        # Without an answer the silence limit decides.
        self._question = asyncio.create_task(self._rig.fresh_heartbeat())

    def _climb(self, now: float) -> None:
        """Let the ladder look, and do what it says."""
        snapshot = self._rig.lookout.snapshot(now)
        self._asking_again.look(snapshot.health)
        verdict = self._ladder.step(snapshot)
        if verdict is None:
            return
        if verdict.action is Action.HOLD:
            self._rig.guide.give_up()
            return
        if verdict.mutes:
            self._rig.release()
        raise FlightEnded(verdict.reason, EXITS[verdict.action])

    def _judge_heartbeat(self) -> None:
        heartbeat, limit = self._rig.link.state.heartbeat, self._rig.same_vehicle.heartbeat_limit
        if heartbeat is None or self._clock() - heartbeat.received > limit:
            raise FlightEnded(
                "no heartbeat from the vehicle, so its mode is not known any more", Exit.LET_GO
            )
