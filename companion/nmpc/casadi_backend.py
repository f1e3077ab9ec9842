"""CasADi's SQP with HPIPM for its quadratic programs: nothing has to be compiled."""

from typing import Any

import casadi as ca
import numpy as np

from companion.nmpc.backend import Found
from companion.nmpc.model import Model
from companion.nmpc.settings import Settings
from companion.nmpc.transcription import Program, transcribe
from companion.nmpc.warm_start import Floats

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


class CasadiBackend:
    """Solves one model's problem written out over the horizon.

    Args:
        model: what is predicted.
        settings: horizon, cost and iterations.
    """

    def __init__(self, model: Model, settings: Settings) -> None:
        self._start = model.state.numel()
        self._program = transcribe(model, settings)
        self._solver = _solver(self._program, settings.iterations)

    def solve(self, guess: Floats, parameters: Floats) -> Found:
        """See `Backend`."""
        program, start = self._program, self._start
        program.lower[:start] = program.upper[:start] = guess[:start]
        found = self._solver(
            x0=guess,
            p=parameters,
            lbx=program.lower,
            ubx=program.upper,
            lbg=program.g_lower,
            ubg=program.g_upper,
        )
        stats = self._solver.stats()
        converged = bool(stats["success"])
        return Found(
            np.asarray(found["x"], dtype=np.float64).ravel(),
            converged or stats["unified_return_status"] == _LIMITED,
            converged,
            int(stats["iter_count"]),
        )


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
