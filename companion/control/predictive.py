"""Predictive control; linear guidance flies each step for which the solver has no answer."""

from array import array
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import sqrt
from time import monotonic, sleep
from typing import NamedTuple

from companion.attitude import Target
from companion.control.heading_frame import HeadingFrame
from companion.guidance import GRAVITY, LinearCommand, Pose
from companion.guidance.follow import Follow
from companion.nmpc import Answer, ControlInput, Request, Solver, Start, Trouble, VehicleSnapshot

_LONGEST_SOLVER_START = 30.0
"""Longest wait for the solver to start, s of wall time; used if the vehicle waits for it."""
_LONGEST_ANSWER_WAIT = 1.0
"""Longest wait for an answer, s of wall time; used if the vehicle waits for the solver."""


class FollowedTrajectory(NamedTuple):
    """The trajectory maneuver that is flown at present."""

    maneuver: Follow
    time: float
    """Time since the maneuver began, s."""
    pose: Pose
    """Pose at which the maneuver began."""


@dataclass
class PredictiveRecord:
    """Counters of predictive control in one flight."""

    flown_answers: int = 0
    """Number of answers that were flown."""
    troubles: Counter[Trouble] = field(default_factory=Counter)
    """Number of answers that were not flown, by cause."""
    computing_seconds: "array[float]" = field(default_factory=lambda: array("d"))
    """Computation time of each flown answer in the solver's process."""


class PredictiveControl:
    """Requests the solver's answer for the next step, at each step of guidance.

    Linear guidance also makes a command at every step. This command is flown at once if an answer
    is late, failed or implausible. The first trouble of each kind is reported.

    Args:
        solver: starts the solver's process; its argument is called with each trouble.
        period: period of guidance, s.
        vehicle_waits: whether the vehicle waits for the solver's answers: in lockstep or on a
            virtual clock.
        note: called with messages for the user.

    Attributes:
        record: counters of this flight.
    """

    def __init__(
        self,
        solver: Callable[[Callable[[Trouble, str], None]], Solver],
        *,
        period: float,
        vehicle_waits: bool,
        note: Callable[[str], None],
    ) -> None:
        self.record = PredictiveRecord()
        self._note = note
        self._period = period
        self._vehicle_waits = vehicle_waits
        self._request_number = 0
        self._control_inputs: deque[ControlInput] = deque(maxlen=50)
        self._solver = solver(self._report)

    def close(self) -> None:
        """End the solver's process."""
        self._solver.close()

    def replacement_for(
        self,
        linear_command: LinearCommand,
        frame: HeadingFrame,
        vehicle: VehicleSnapshot,
        followed_trajectory: FollowedTrajectory | None,
    ) -> LinearCommand:
        """The solver's answer for this step, or `linear_command`; requests the next answer.

        The solver works in the estimator's frame, whose heading jumps at each reset. The solver's
        target is constant for a period, which its model takes into account.

        `frame`: the frame that heading resets do not turn.
        """
        target, acceleration_down = linear_command.target, linear_command.acceleration_down
        target = target._replace(heading=frame.estimated_heading(target.heading))
        answer = None if followed_trajectory is None else self._answer(vehicle.time)
        if answer is not None:
            self.record.flown_answers += 1
            self.record.computing_seconds.append(answer.computing_seconds)
            target, acceleration_down = _command_of(answer)
        self._record_input(vehicle.time, target, acceleration_down)
        if followed_trajectory is not None:
            self._request(vehicle, followed_trajectory, frame)
        if answer is None:
            return linear_command
        target = target._replace(heading=frame.heading(target.heading))
        return LinearCommand(target, target, acceleration_down)

    def _answer(self, now: float) -> Answer | None:
        if self._vehicle_waits:
            self._wait_until_ready()
        answer = self._solver.take_answer(_LONGEST_ANSWER_WAIT if self._vehicle_waits else 0.0)
        # The answer may be for an earlier step, if guidance has missed steps.
        if answer is None or abs(answer.time - now) > self._period:
            return None
        return answer

    def _request(
        self, vehicle: VehicleSnapshot, followed_trajectory: FollowedTrajectory, frame: HeadingFrame
    ) -> None:
        maneuver, pose = followed_trajectory.maneuver, followed_trajectory.pose
        trajectory_time = followed_trajectory.time - maneuver.turn_duration
        if trajectory_time < 0.0:
            return
        self._request_number += 1
        heading = pose.heading if maneuver.trajectory.holds_heading else 0.0
        control_inputs = tuple(self._control_inputs)
        start = Start(pose.position_ned, frame.estimated_heading(heading))
        self._solver.request(
            Request(self._request_number, vehicle, trajectory_time, start, control_inputs)
        )

    def _record_input(self, now: float, target: Target, acceleration_down: float) -> None:
        vertical_thrust = GRAVITY - acceleration_down
        thrust = vertical_thrust / max(0.2, sqrt(max(0.0, 1.0 - target.north**2 - target.east**2)))
        self._control_inputs.append(
            ControlInput(now, target.north, target.east, target.heading, thrust)
        )

    def _wait_until_ready(self) -> None:
        deadline = monotonic() + _LONGEST_SOLVER_START
        while self._solver.alive and not self._solver.ready and monotonic() < deadline:
            sleep(0.01)

    def _report(self, trouble: Trouble, message: str) -> None:
        self.record.troubles[trouble] += 1
        if self.record.troubles[trouble] == 1:
            self._note(f"predictive control: {message}; linear guidance continues the flight")


def _command_of(answer: Answer) -> tuple[Target, float]:
    """The solver's target, and the acceleration by thrust and gravity, positive down, m/s².

    The acceleration is that at the target's tilt; `HoverThrust` converts it to the thrust at the
    present tilt.
    """
    cosine = sqrt(max(0.0, 1.0 - answer.north**2 - answer.east**2))
    target = Target(answer.north, answer.east, answer.heading)
    return target, GRAVITY - answer.thrust * cosine
