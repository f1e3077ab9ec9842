"""One request worked off: prediction, reference, problem, answer."""

from math import hypot, sin
from time import monotonic, perf_counter

from companion.attitude import BodyRates, InvalidQuaternionError, wrap_angle
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc.attitude_models import euler_near
from companion.nmpc.messages import Answer, Input, Request, Status, Vehicle
from companion.nmpc.model import Given
from companion.nmpc.prediction import Predictor, ToppledError
from companion.nmpc.problem import Plan, Problem
from companion.nmpc.reference import Node, Start, node_of
from companion.nmpc.settings import Settings

_WARM_UP = 5
"""Solves before the first that counts: caches fill, memory is taken."""


class Planning:
    """Answers requests about one trajectory.

    The dead time is outside the problem: the motion is predicted past it, with what is still under
    way, and planned from there. So every model can be told of it.

    Args:
        settings: vehicle, horizon and solver.
        trajectory: what is followed.

    Raises:
        ValueError: there is no model of that name.
    """

    def __init__(self, settings: Settings, trajectory: Trajectory) -> None:
        self._settings = settings
        self._trajectory = trajectory
        self._predictor = Predictor(settings)
        self._problem = Problem(settings)
        self._ahead = settings.lead + settings.dead_time

    def warm_up(self) -> None:
        """Solve a few times for nobody."""
        level = Vehicle(0.0, (0.0,) * 3, (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0))
        hover = Input(0.0, 0.0, 0.0, 0.0, self._settings.gravity)
        for number in range(_WARM_UP):
            self.answer(Request(number, level, 0.0, Start((0.0, 0.0, 0.0)), (hover,)))
        self.forget()

    def forget(self) -> None:
        """Begin the next solve from its reference instead of the plan before."""
        self._problem.forget()

    def answer(self, request: Request) -> Answer:
        """Solve for the time when the answer is used."""
        began = perf_counter()
        use = request.vehicle.time + self._settings.lead
        try:
            plan = self._plan(request)
        except (InvalidQuaternionError, ToppledError):
            self.forget()
            return _nothing(request, Status.TOPPLED, use, perf_counter() - began)
        if not plan.solved:
            return _nothing(request, Status.FAILED, use, perf_counter() - began)
        return Answer(
            request.number,
            Status.SOLVED,
            monotonic(),
            use,
            plan.north,
            plan.east,
            wrap_angle(plan.heading),
            plan.thrust,
            perf_counter() - began,
            plan.seconds,
            plan.iterations,
        )

    def _plan(self, request: Request) -> Plan:
        vehicle = request.vehicle
        until = vehicle.time + self._ahead
        motion = self._predictor.ahead(vehicle, request.inputs, until)
        _, _, yaw = euler_near(motion.north, motion.east, motion.heading)
        longest = max(sin(self._settings.max_tilt), hypot(motion.north, motion.east))
        given = Given(*vehicle.disturbance, yaw, longest, *vehicle.drag)
        nodes = self._nodes(request, motion.heading)
        return self._problem.solve(until, motion, nodes, given)

    def _nodes(self, request: Request, heading: float) -> list[Node]:
        """The reference over the horizon, its heading near that of the vehicle."""
        settings, nodes = self._settings, list[Node]()
        for k in range(settings.steps + 1):
            sample = self._trajectory.at(request.at + self._ahead + k * settings.step)
            node = node_of(
                sample,
                request.start,
                heading,
                request.vehicle.drag,
                settings.gravity,
                request.vehicle.disturbance,
            )
            nodes.append(node)
            heading = node.heading
        return nodes


def _nothing(request: Request, status: Status, use: float, seconds: float) -> Answer:
    return Answer(request.number, status, monotonic(), use, 0.0, 0.0, 0.0, 0.0, seconds, 0.0, 0)
