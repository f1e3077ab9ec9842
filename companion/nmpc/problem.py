"""The solver of one model's problem: CasADi's SQP with HPIPM for its quadratic programs."""

from collections.abc import Sequence
from time import thread_time
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from companion.nmpc.model import Given, Motion
from companion.nmpc.models import make_model
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings
from companion.nmpc.transcription import Program, parameters_of, transcribe
from companion.nmpc.warm_start import Floats, moved_on, on_reference

_LIMITED = "SOLVER_RET_LIMITED"
_SQP: dict[str, Any] = {
    "qpsol": "hpipm",
    "tol_pr": 1e-6,
    "tol_du": 1e-3,
    "error_on_fail": False,
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "print_time": False,
    "show_eval_warnings": False,  # what is not finite is refused; nobody reads our output
}


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
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._model = make_model(settings)
        self._program = transcribe(self._model, settings)
        self._solver = _solver(self._program, settings.iterations)
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
        model, program = self._model, self._program
        start = np.array(model.state_of(motion))
        guess = self._guess(time, nodes)
        for values in (guess, program.lower, program.upper):
            values[: len(start)] = start
        parameters = parameters_of(given, nodes, [model.aim_of(node) for node in nodes])
        if not (np.isfinite(start).all() and np.isfinite(parameters).all()):
            self.forget()
            return _NO_PLAN
        began = thread_time()
        found = self._solver(
            x0=guess,
            p=parameters,
            lbx=program.lower,
            ubx=program.upper,
            lbg=program.g_lower,
            ubg=program.g_upper,
        )
        seconds = thread_time() - began
        plan = np.asarray(found["x"], dtype=np.float64).ravel()
        stats = self._solver.stats()
        converged = bool(stats["success"])
        solved = converged or stats["unified_return_status"] == _LIMITED
        if not (solved and np.isfinite(plan).all()):
            self.forget()
            return _NO_PLAN
        self._plan, self._time = plan, time
        control = plan[len(start) : len(start) + model.control.numel()]
        target = np.asarray(self._target(start, control, list(given)), dtype=np.float64).ravel()
        iterations = int(stats["iter_count"])
        return Plan(True, converged, iterations, seconds, *(float(v) for v in target))

    def _guess(self, time: float, nodes: Sequence[Node]) -> Floats:
        if self._plan is None or not time >= self._time:
            return on_reference(self._model, nodes, self._settings)
        return moved_on(self._model, self._plan, (time - self._time) / self._settings.step)


def _solver(program: Program, iterations: int) -> ca.Function:
    """`sqpmethod` with the Hessian of Gauss and Newton; the step of a single iteration is whole."""
    jacobian = ca.jacobian(program.residual, program.unknown)
    factor = ca.SX.sym("lam_f")
    multipliers = ca.SX.sym("lam_g", program.constraints.numel())
    hessian = ca.Function(
        "gauss_newton",
        [program.unknown, program.parameters, factor, multipliers],
        [factor * ca.mtimes(jacobian.T, jacobian)],
        ["x", "p", "lam_f", "lam_g"],
        ["hess_gamma_x_x"],
    )
    single = iterations == 1
    options = {
        "hess_lag": hessian,
        "max_iter": iterations,
        "max_iter_ls": 0 if single else 10,  # of the search along the line, in every iteration
        "qpsol_options": {
            # What is solved once need not be solved to the last digit, which takes a fifth longer.
            "hpipm": {"mode": "speed_abs" if single else "speed"},
            # HPIPM takes no bound for infinite, so CasADi gives it large ones: with those of its
            # default, 1e8, rounding costs ten times as many iterations.
            "inf": 1e4,
            "error_on_fail": False,
        },
    }
    problem = {
        "x": program.unknown,
        "p": program.parameters,
        "f": 0.5 * ca.sumsqr(program.residual),
        "g": program.constraints,
    }
    return ca.nlpsol("nmpc", "sqpmethod", problem, _SQP | options)
