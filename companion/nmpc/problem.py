"""One model's problem, planned again and again from the plan before."""

from collections.abc import Sequence
from time import thread_time
from typing import NamedTuple

import casadi as ca
import numpy as np

from companion.nmpc.backend import Backend
from companion.nmpc.casadi_backend import CasadiBackend
from companion.nmpc.model import Given, Model, Motion
from companion.nmpc.models import make_model
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings
from companion.nmpc.transcription import parameters_of
from companion.nmpc.warm_start import Floats, moved_on, on_reference


class Plan(NamedTuple):
    """What one solve came to.

    Attributes:
        solved: whether the plan may be flown; the rest is meaningless where it may not.
        converged: whether the iterations reached the tolerance; a real-time iteration seldom does.
        iterations: of the SQP.
        seconds: of processor time that the solver itself took.
        north, east, heading: the first target for the planner: coefficients, rad.
        thrust: specific, m/s².
    """

    solved: bool
    converged: bool
    iterations: int
    seconds: float
    north: float
    east: float
    heading: float
    thrust: float


_NO_PLAN = Plan(False, False, 0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Problem:
    """Plans again and again, each time from the plan before.

    The cost is the same for all models: errors of position, velocity and heading, the turning and
    the thrust against what the reference takes; see `Weights`.

    Args:
        settings: vehicle, horizon and solver.

    Raises:
        ValueError: there is no model of that name.
        BuildError: acados' solver cannot be compiled.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._model = make_model(settings)
        self._backend = _backend(self._model, settings)
        inputs = [self._model.state, self._model.control, self._model.given]
        self._target = ca.Function("target", inputs, [self._model.target])
        self._plan: Floats | None = None
        self._time = 0.0

    def forget(self) -> None:
        """Begin the next solve from its reference."""
        self._plan = None

    def solve(self, time: float, motion: Motion, nodes: Sequence[Node], given: Given) -> Plan:
        """Plan from `motion` on.

        Args:
            time: of `motion`, s; it says how far the last plan has to be moved on.
            motion: at the beginning of the horizon.
            nodes: the reference at the ends of the steps: one more than these.
            given: what is the same over the horizon.
        """
        model = self._model
        start = np.array(model.state_of(motion))
        guess = self._guess(time, nodes)
        guess[: len(start)] = start
        parameters = parameters_of(given, nodes, [model.aim_of(node) for node in nodes])
        if not (np.isfinite(start).all() and np.isfinite(parameters).all()):
            self.forget()
            return _NO_PLAN
        began = thread_time()
        found = self._backend.solve(guess, parameters)
        seconds = thread_time() - began
        if not (found.solved and np.isfinite(found.plan).all()):
            self.forget()
            return _NO_PLAN
        plan = self._plan = found.plan
        self._time = time
        control = plan[len(start) : len(start) + model.control.numel()]
        target = np.asarray(self._target(start, control, list(given)), dtype=np.float64).ravel()
        return Plan(True, found.converged, found.iterations, seconds, *(float(v) for v in target))

    def _guess(self, time: float, nodes: Sequence[Node]) -> Floats:
        if self._plan is None or not time >= self._time:
            return on_reference(self._model, nodes, self._settings)
        return moved_on(self._model, self._plan, (time - self._time) / self._settings.step)


def _backend(model: Model, settings: Settings) -> Backend:
    """The one that the settings name."""
    if settings.solver == "acados":
        from companion.nmpc.acados_backend import AcadosBackend  # noqa: PLC0415  seldom installed

        return AcadosBackend(model, settings)
    return CasadiBackend(model, settings)
