"""Predictive control beside linear guidance, which flies every step that it misses."""

from array import array
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import sqrt
from time import monotonic, sleep
from typing import NamedTuple

from companion.attitude import Target
from companion.guidance import GRAVITY, Pose
from companion.guidance.follow import Follow
from companion.nmpc import Answer, Input, Request, Solver, Start, Trouble, Vehicle

_LONGEST_START = 30.0
"""In lockstep, longest wait for the solver to start, s of wall time."""
_LONGEST_WAIT = 1.0
"""In lockstep, longest wait for an answer, s of wall time."""


class Following(NamedTuple):
    """The trajectory that is followed now.

    Attributes:
        part: the trajectory as a maneuver.
        time: since the maneuver began, s.
        pose: where the maneuver began.
        turn: sum of the heading resets, rad; the solver works in the estimator's own frame.
    """

    part: Follow
    time: float
    pose: Pose
    turn: float = 0.0


@dataclass
class PredictiveRecord:
    """What predictive control did in one flight.

    Attributes:
        flown: number of answers that were flown.
        troubles: number of answers that were not flown, by cause.
        seconds: computation time of each flown answer in the solver's process.
    """

    flown: int = 0
    troubles: Counter[Trouble] = field(default_factory=Counter)
    seconds: "array[float]" = field(default_factory=lambda: array("d"))


class Predictive:
    """Requests at each step of guidance the solver's answer for the next step.

    Linear guidance makes its own command at every step, so it replaces an answer that is late,
    failed or implausible without a pause. The first trouble of each kind is reported.

    Args:
        solver: starts the solver's process for a trajectory.
        period: of guidance, s.
        lockstep: wait for the solver, as the vehicle waits for us.
        note: takes messages for the user.
    """

    def __init__(
        self,
        solver: Callable[[Callable[[Trouble, str], None]], Solver],
        *,
        period: float,
        lockstep: bool,
        note: Callable[[str], None],
    ) -> None:
        self.record = PredictiveRecord()
        self._note = note
        self._period = period
        self._lockstep = lockstep
        self._number = 0
        self._inputs: deque[Input] = deque(maxlen=50)
        self._solver = solver(self._report)

    def close(self) -> None:
        """End the solver's process."""
        self._solver.close()

    def command(
        self, linear: tuple[Target, float], vehicle: Vehicle, following: Following | None
    ) -> tuple[Target, float]:
        """The solver's answer for now, else `linear`; also requests the next answer.

        Args:
            linear: target and downward acceleration (m/s²) by linear guidance.
            vehicle: state of the vehicle now.
            following: the trajectory, or None.
        """
        chosen = linear
        if following is not None:
            answer = self._answer(vehicle.time)
            if answer is not None:
                self.record.flown += 1
                self.record.seconds.append(answer.seconds)
                chosen = _command_of(answer)
        self._remember(vehicle.time, chosen)
        if following is not None:
            self._ask(vehicle, following)
        return chosen

    def _answer(self, now: float) -> Answer | None:
        if self._lockstep:
            self._wait_until_ready()
        answer = self._solver.take(_LONGEST_WAIT if self._lockstep else 0.0)
        # An answer for a step that guidance has missed is too old.
        if answer is None or abs(answer.time - now) > self._period:
            return None
        return answer

    def _ask(self, vehicle: Vehicle, following: Following) -> None:
        part, pose = following.part, following.pose
        at = following.time - part.turns_for
        if at < 0.0:
            return
        self._number += 1
        turned = pose.heading if part.trajectory.holds_heading else 0.0
        start = Start(pose.position_ned, turned + following.turn)
        self._solver.request(Request(self._number, vehicle, at, start, tuple(self._inputs)))

    def _remember(self, now: float, command: tuple[Target, float]) -> None:
        target, down = command
        lift = GRAVITY - down
        thrust = lift / max(0.2, sqrt(max(0.0, 1.0 - target.north**2 - target.east**2)))
        self._inputs.append(Input(now, target.north, target.east, target.heading, thrust))

    def _wait_until_ready(self) -> None:
        until = monotonic() + _LONGEST_START
        while self._solver.alive and not self._solver.ready and monotonic() < until:
            sleep(0.01)

    def _report(self, trouble: Trouble, words: str) -> None:
        self.record.troubles[trouble] += 1
        if self.record.troubles[trouble] == 1:
            self._note(f"predictive control: {words}; linear guidance flies on")


def _command_of(answer: Answer) -> tuple[Target, float]:
    """The target, and the vertical acceleration of its thrust at the answer's own tilt.

    The present tilt differs, and the thrust map corrects for it to hold the height.
    """
    cosine = sqrt(max(0.0, 1.0 - answer.north**2 - answer.east**2))
    target = Target(answer.north, answer.east, answer.heading)
    return target, GRAVITY - answer.thrust * cosine
