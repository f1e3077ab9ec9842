"""The solver's process: `python -m companion.nmpc.worker FD`, started by `process.Solver`.

FD is a SOCK_SEQPACKET socket, which keeps messages apart. Settings and trajectory arrive pickled on
standard input. The process ends when the socket is closed.
"""

import gc
import os
import pickle
import signal
import socket
import sys
from collections.abc import Callable
from time import monotonic, perf_counter

from companion.attitude import BodyRates, InvalidQuaternionError, wrap_angle
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc.coefficient_model import coefficient_model
from companion.nmpc.messages import (
    READY_MESSAGE,
    Answer,
    ControlInput,
    Request,
    Status,
    VehicleSnapshot,
)
from companion.nmpc.model import Model
from companion.nmpc.prediction import Predictor, TiltedTooFarError, conditions_of
from companion.nmpc.receding_horizon import FirstControl, RecedingHorizon
from companion.nmpc.reference import Node, Start, node_of
from companion.nmpc.settings import Settings

_WARM_UP_SOLVES = 5
"""Number of solves before the first request, which fill caches and allocate memory."""
_LARGEST_MESSAGE = 65536  # bytes
_NO_CONTROL = FirstControl(0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Worker:
    """Solves the optimal control problem for each request; all requests fly one trajectory.

    The dead time is not part of the problem. The motion is predicted to the time at which the
    answer takes effect, `Settings.lead` plus dead time after the state in the request. The plan
    starts at that time.

    Args:
        make_model: makes the prediction model; only studies use another than the default.
    """

    def __init__(
        self,
        settings: Settings,
        trajectory: Trajectory,
        make_model: Callable[[Settings], Model] = coefficient_model,
    ) -> None:
        self._settings = settings
        self._trajectory = trajectory
        self._predictor = Predictor(settings)
        self._horizon = RecedingHorizon(settings, make_model)
        self._effect_delay = settings.lead + settings.dead_time

    def warm_up(self) -> None:
        """Solve a few times and discard the answers."""
        level = VehicleSnapshot(
            0.0, (0.0,) * 3, (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
        )
        hover = ControlInput(0.0, 0.0, 0.0, 0.0, self._settings.gravity)
        for number in range(_WARM_UP_SOLVES):
            self.answer(Request(number, level, 0.0, Start((0.0, 0.0, 0.0)), (hover,)))
        self.forget()

    def forget(self) -> None:
        """Start the next solve from the reference instead of the previous plan."""
        self._horizon.forget()

    def answer(self, request: Request) -> Answer:
        """Solve a request; guidance uses the answer `Settings.lead` after the request's time."""
        start_time = perf_counter()
        use_time = request.vehicle.time + self._settings.lead
        try:
            control = self._solve(request)
            status = Status.SOLVED if control else Status.FAILED
        except (InvalidQuaternionError, TiltedTooFarError):
            self.forget()
            control, status = None, Status.TILTED_TOO_FAR
        control = control or _NO_CONTROL
        return Answer(
            request.number,
            status,
            monotonic(),
            use_time,
            control.north,
            control.east,
            wrap_angle(control.heading),
            control.thrust,
            perf_counter() - start_time,
            control.solver_seconds,
            control.iterations,
        )

    def _solve(self, request: Request) -> FirstControl | None:
        vehicle = request.vehicle
        effect_time = vehicle.time + self._effect_delay
        motion = self._predictor.predict(vehicle, request.inputs, effect_time)
        conditions = conditions_of(vehicle)
        nodes = self._nodes(request, motion.heading)
        return self._horizon.solve(effect_time, motion, nodes, conditions)

    def _nodes(self, request: Request, heading: float) -> list[Node]:
        """The reference over the horizon; its headings are unwrapped, beginning near `heading`."""
        settings, nodes = self._settings, list[Node]()
        for k in range(settings.steps + 1):
            node_time = request.trajectory_time + self._effect_delay + k * settings.step_duration
            sample = self._trajectory.at(node_time)
            node = node_of(
                sample,
                request.start,
                heading,
                request.vehicle.drag,
                request.vehicle.axis_drag,
                settings.gravity,
                request.vehicle.disturbance,
            )
            nodes.append(node)
            heading = node.heading
        return nodes


def main() -> None:
    """Answer the newest request, repeatedly, until the socket is closed."""
    # Ctrl-C reaches this process too, but the flight handles it and then closes the socket.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = socket.socket(fileno=int(sys.argv[1]))
    settings, trajectory = pickle.load(sys.stdin.buffer)  # trusted: the parent process wrote it
    os.nice(settings.niceness)
    worker = Worker(settings, trajectory)
    worker.warm_up()
    gc.freeze()
    gc.disable()  # a collection would delay an answer, and nothing here makes reference cycles
    try:
        connection.send(READY_MESSAGE)
        while message := _newest_request(connection):
            connection.send(pickle.dumps(worker.answer(pickle.loads(message))))
    except (BrokenPipeError, ConnectionResetError):
        pass  # the flight is over


def _newest_request(connection: socket.socket) -> bytes:
    """Wait for requests and return the newest; empty after the other end has closed."""
    message = connection.recv(_LARGEST_MESSAGE)
    while message:
        try:
            newer = connection.recv(_LARGEST_MESSAGE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            break
        message = newer
    return message


if __name__ == "__main__":
    main()
