"""acados' SQP with HPIPM: the same problem, stage by stage, as C code compiled for it."""

import acados
import casadi as ca
import numpy as np
from acados.acados_template import AcadosOcp

from companion.nmpc.acados_build import load
from companion.nmpc.acados_stages import Stages
from companion.nmpc.backend import Found
from companion.nmpc.model import Given, Model, integrator
from companion.nmpc.settings import Settings
from companion.nmpc.transcription import final_residual, node_symbols, running_residual
from companion.nmpc.warm_start import Floats

_SUCCESS, _LIMITED = 0, 2
"""Of acados' return codes (its `types.h`): converged (or iterated once), iterated too often."""


class AcadosBackend:
    """Solves one model's problem with a solver that is compiled for it at the first time.

    Args:
        model: what is predicted.
        settings: horizon, cost, iterations and bounds of the thrust.

    Raises:
        BuildError: it cannot be compiled.
    """

    def __init__(self, model: Model, settings: Settings) -> None:
        self._single = settings.iterations == 1
        ocp = _described(model, settings)
        self._solver = load(ocp)
        self._stages = Stages(
            self._solver, model.state.numel(), model.control.numel(), ocp.model.p.numel()
        )

    def solve(self, guess: Floats, parameters: Floats) -> Found:
        """See `Backend`."""
        stages, everywhere = self._stages, len(Given._fields)
        stages.plan[:] = guess
        stages.parameters[:, :everywhere] = parameters[:everywhere]
        stages.parameters[:, everywhere:] = parameters[everywhere:].reshape(
            len(stages.parameters), -1
        )
        stages.send()
        status = self._solver.solve()
        stages.fetch()
        iterations = 1 if self._single else int(self._solver.get_stats("sqp_iter")[0])
        # A single iteration is not told how far it came.
        converged = status == _SUCCESS and not self._single
        return Found(stages.plan.copy(), status in (_SUCCESS, _LIMITED), converged, iterations)


def _described(model: Model, settings: Settings) -> AcadosOcp:
    """The problem of `transcription.transcribe` in acados' terms; without files, so far."""
    ocp = AcadosOcp(acados_path=acados.DIR)
    ocp.model.name = "nmpc"
    ocp.model.x, ocp.model.u = model.state, model.control
    node = node_symbols(model)
    ocp.model.p = ca.vertcat(model.given, node)
    ocp.parameter_values = np.zeros(ocp.model.p.numel())
    ocp.model.disc_dyn_expr = integrator(model)(
        model.state, model.control, model.given, settings.step
    )
    _set_cost(ocp, model, node, settings)
    _set_constraints(ocp, model, settings)
    _set_options(ocp, settings)
    return ocp


def _set_cost(ocp: AcadosOcp, model: Model, node: ca.SX, settings: Settings) -> None:
    ocp.cost.cost_type = ocp.cost.cost_type_e = "NONLINEAR_LS"
    ocp.model.cost_y_expr = running_residual(model, node, settings)
    ocp.model.cost_y_expr_e = final_residual(model.state, node, settings)
    running, final = ocp.model.cost_y_expr.numel(), ocp.model.cost_y_expr_e.numel()
    # acados multiplies by the length of the step, which is in the residual already.
    ocp.cost.W, ocp.cost.W_e = np.eye(running) / settings.step, np.eye(final)
    ocp.cost.yref, ocp.cost.yref_e = np.zeros(running), np.zeros(final)


def _set_constraints(ocp: AcadosOcp, model: Model, settings: Settings) -> None:
    constraints, bounded = ocp.constraints, model.bounded.numel()
    constraints.x0 = np.zeros(model.state.numel())  # each solve sets its own
    constraints.idxbu = np.array([model.control.numel() - 1])
    constraints.lbu = np.array([settings.min_thrust])
    constraints.ubu = np.array([settings.max_thrust])
    if bounded:
        ocp.model.con_h_expr = model.bounded
        constraints.lh, constraints.uh = -np.ones(bounded), np.ones(bounded)


def _set_options(ocp: AcadosOcp, settings: Settings) -> None:
    options, single = ocp.solver_options, settings.iterations == 1
    ocp.dims.N = settings.steps
    options.tf = settings.horizon
    options.integrator_type = "DISCRETE"
    options.hessian_approx = "GAUSS_NEWTON"
    options.qp_solver = "PARTIAL_CONDENSING_HPIPM"
    options.hpipm_mode = "SPEED"
    options.nlp_solver_type = "SQP_RTI" if single else "SQP"
    options.nlp_solver_max_iter = settings.iterations
    options.nlp_solver_tol_stat = 1e-3  # tolerances as in `casadi_backend`
    # Its search along the line stops short of the tolerance where whole steps reach it.
    options.globalization = "FIXED_STEP"
