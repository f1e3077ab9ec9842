"""The optimal control problem: multiple shooting, least squares, solved by CasADi's SQP method."""

from collections.abc import Sequence
from math import sqrt
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from companion.nmpc.model import Model, integrator
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

Floats = NDArray[np.float64]

_ITERATION_LIMIT = "SOLVER_RET_LIMITED"
_SQP_OPTIONS: dict[str, Any] = {
    "qpsol": "hpipm",
    "tol_pr": 1e-6,
    "tol_du": 1e-3,
    "error_on_fail": False,
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "print_time": False,
    "show_eval_warnings": False,  # a plan that is not finite is refused anyway
}


class Program(NamedTuple):
    """A nonlinear program: minimise ½·|r(w, p)|² with bounds on w and on g(w, p).

    The horizon has N steps. Each state x_k has n components, each control u_k m components.
    """

    unknowns: ca.SX
    """Unknowns w: (x_0, u_0, x_1, u_1, …, x_N)."""
    parameters: ca.SX
    """Parameters p, whose numbers `parameters_of` computes."""
    residual: ca.SX
    """Residual r: weighted errors of all nodes."""
    constraints: ca.SX
    """Constraints g: for each step the gap to the next state, then `Model.bounded_terms`. HPIPM
    requires this order."""
    lower: Floats
    upper: Floats
    """`lower` and `upper`: bounds on w; the caller sets the first n of each to the start state."""
    g_lower: Floats
    g_upper: Floats
    """`g_lower` and `g_upper`: bounds on g."""


def transcribe(model: Model, settings: Settings) -> Program:
    """Formulate the optimal control problem of this model over the horizon."""
    node = ca.vertcat(
        ca.SX.sym("p", 3), ca.SX.sym("v", 3), ca.SX.sym("T"), model.attitude_reference
    )
    advance = integrator(model)
    running_residual = ca.Function(
        "r", [model.state, model.control, node], [_running_residual(model, node, settings)]
    )
    bounded = ca.Function("b", [model.state, model.control, model.constants], [model.bounded_terms])
    constants = ca.SX.sym("constants", model.constants.numel())
    nodes = [ca.SX.sym(f"node_{k}", node.numel()) for k in range(settings.steps + 1)]
    x = ca.SX.sym("x_0", model.state.numel())
    unknowns, residual, constraints = [x], [], []
    for k in range(settings.steps):
        u = ca.SX.sym(f"u_{k}", model.control.numel())
        next_x = ca.SX.sym(f"x_{k + 1}", model.state.numel())
        unknowns += [u, next_x]
        residual.append(running_residual(x, u, nodes[k]))
        constraints.append(advance(x, u, constants, settings.step_duration) - next_x)
        constraints.append(bounded(x, u, constants))
        x = next_x
    residual.append(_final_residual(x, nodes[-1], settings))
    return Program(
        ca.vertcat(*unknowns),
        ca.vertcat(constants, *nodes),
        ca.vertcat(*residual),
        ca.vertcat(*constraints),
        *_bounds_of_unknowns(model, settings),
        *_bounds_of_constraints(model, settings),
    )


def parameters_of(
    constants: Sequence[float],
    nodes: Sequence[Node],
    attitude_references: Sequence[Sequence[float]],
) -> Floats:
    """The numbers for `Program.parameters`: the constants, then the values of each node.

    The values of a node are position, velocity, thrust, and `Model.attitude_reference`.
    """
    values = [*constants]
    for node, attitude_reference in zip(nodes, attitude_references, strict=True):
        values += [*node.position, *node.velocity, node.thrust, *attitude_reference]
    return np.array(values)


def _running_residual(model: Model, node: ca.SX, settings: Settings) -> ca.SX:
    """Contribution of one step to the residual r."""
    weights = settings.weights
    weighted_errors = (
        (weights.position, model.state[0:3] - node[0:3]),
        (weights.velocity, model.state[3:6] - node[3:6]),
        (weights.heading, model.heading_error),
        (weights.attitude_rate, model.attitude_rate_error),
        (weights.thrust, model.control[-1] - node[6]),
    )
    residual: ca.SX = ca.vertcat(
        *(sqrt(settings.step_duration * weight) * error for weight, error in weighted_errors)
    )
    return residual


def _final_residual(x: ca.SX, node: ca.SX, settings: Settings) -> ca.SX:
    """Contribution of the state x at the end of the horizon to the residual r."""
    weights = settings.weights
    residual: ca.SX = ca.vertcat(
        sqrt(weights.final * weights.position) * (x[0:3] - node[0:3]),
        sqrt(weights.final * weights.velocity) * (x[3:6] - node[3:6]),
    )
    return residual


def _bounds_of_unknowns(model: Model, settings: Settings) -> tuple[Floats, Floats]:
    free_state = np.full(model.state.numel(), np.inf)
    free_control = np.full(model.control.numel(), np.inf)
    lowest, highest = -free_control, free_control.copy()
    lowest[-1], highest[-1] = settings.min_thrust, settings.max_thrust
    lower = np.concatenate([-free_state, *[lowest, -free_state] * settings.steps])
    upper = np.concatenate([free_state, *[highest, free_state] * settings.steps])
    return lower, upper


def _bounds_of_constraints(model: Model, settings: Settings) -> tuple[Floats, Floats]:
    gap, bounded = np.zeros(model.state.numel()), np.ones(model.bounded_terms.numel())
    upper = np.concatenate([gap, bounded] * settings.steps)
    return -upper, upper


class SolverResult(NamedTuple):
    """Result of one solve."""

    unknowns: Floats
    """The plan (x_0, u_0, x_1, …, x_N), in the order of `Program.unknowns`."""
    solved: bool
    """Whether the solver succeeded, or stopped at its largest number of iterations."""
    iterations: int
    """Number of SQP iterations."""


class SqpSolver:
    """CasADi's SQP method with HPIPM for the quadratic programs; no code is generated."""

    def __init__(self, model: Model, settings: Settings) -> None:
        self._state_size = model.state.numel()
        self._program = transcribe(model, settings)
        self._solver = _sqp_function(self._program, settings.iterations)

    def solve(self, guess: Floats, parameters: Floats) -> SolverResult:
        """Solve from a guess, whose first state is the fixed start of the plan.

        Args:
            guess: first guess, in the order of `Program.unknowns`.
            parameters: numbers from `parameters_of`.
        """
        program, state_size = self._program, self._state_size
        program.lower[:state_size] = program.upper[:state_size] = guess[:state_size]
        result = self._solver(
            x0=guess,
            p=parameters,
            lbx=program.lower,
            ubx=program.upper,
            lbg=program.g_lower,
            ubg=program.g_upper,
        )
        stats = self._solver.stats()
        return SolverResult(
            np.asarray(result["x"], dtype=np.float64).ravel(),
            bool(stats["success"]) or stats["unified_return_status"] == _ITERATION_LIMIT,
            int(stats["iter_count"]),
        )


def _sqp_function(program: Program, iterations: int) -> ca.Function:
    """CasADi's `sqpmethod` with Gauss–Newton Hessian; a single iteration takes the full step."""
    jacobian = ca.jacobian(program.residual, program.unknowns)
    objective_factor = ca.SX.sym("lam_f")
    multipliers = ca.SX.sym("lam_g", program.constraints.numel())
    hessian = ca.Function(
        "gauss_newton",
        [program.unknowns, program.parameters, objective_factor, multipliers],
        [objective_factor * ca.mtimes(jacobian.T, jacobian)],
        ["x", "p", "lam_f", "lam_g"],
        ["hess_gamma_x_x"],
    )
    is_single = iterations == 1
    options = {
        "hess_lag": hessian,
        "max_iter": iterations,
        "max_iter_ls": 0 if is_single else 10,  # line search in every iteration
        "qpsol_options": {
            # In a single iteration the full accuracy, which takes a fifth longer, is of no use.
            "hpipm": {"mode": "speed_abs" if is_single else "speed"},
            # HPIPM has no infinite bounds, so CasADi passes large numbers. Its default, 1e8, loses
            # so many digits that ten times as many iterations are needed.
            "inf": 1e4,
            "error_on_fail": False,
        },
    }
    problem = {
        "x": program.unknowns,
        "p": program.parameters,
        "f": 0.5 * ca.sumsqr(program.residual),
        "g": program.constraints,
    }
    return ca.nlpsol("nmpc", "sqpmethod", problem, _SQP_OPTIONS | options)
