"""The optimal control problem in the form that solvers take: multiple shooting, least squares."""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from companion.nmpc.model import Given, Model, integrator
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

Floats = NDArray[np.float64]


class Program(NamedTuple):
    """min ½·|r(w, p)|² with bounds on w and on g(w, p); n states, m controls, N steps.

    Attributes:
        unknown: w, (x_0, u_0, x_1, u_1, …, x_N).
        parameters: p; `parameters_of` fills it.
        residual: r.
        constraints: g, for each step the gap to the next state and then the model's own bounds,
            which is the order HPIPM wants.
        lower, upper: bounds on w; the caller sets the first n to the state at the start.
        g_lower, g_upper: bounds on g.
    """

    unknown: ca.SX
    parameters: ca.SX
    residual: ca.SX
    constraints: ca.SX
    lower: Floats
    upper: Floats
    g_lower: Floats
    g_upper: Floats


def transcribe(model: Model, settings: Settings) -> Program:
    """Write the problem of this model out over the horizon."""
    given, node = model.given, node_symbols(model)
    advance = integrator(model)
    running = ca.Function(
        "r", [model.state, model.control, node], [running_residual(model, node, settings)]
    )
    bounded = ca.Function("b", [model.state, model.control, given], [model.bounded])
    everywhere = ca.SX.sym("given", given.numel())
    nodes = [ca.SX.sym(f"node_{k}", node.numel()) for k in range(settings.steps + 1)]
    x = ca.SX.sym("x_0", model.state.numel())
    unknown, residual, constraints = [x], [], []
    for k in range(settings.steps):
        u = ca.SX.sym(f"u_{k}", model.control.numel())
        after = ca.SX.sym(f"x_{k + 1}", model.state.numel())
        unknown += [u, after]
        residual.append(running(x, u, nodes[k]))
        constraints.append(advance(x, u, everywhere, settings.step) - after)
        constraints.append(bounded(x, u, everywhere))
        x = after
    residual.append(final_residual(x, nodes[-1], settings))
    return Program(
        ca.vertcat(*unknown),
        ca.vertcat(everywhere, *nodes),
        ca.vertcat(*residual),
        ca.vertcat(*constraints),
        *_bounds_of_unknown(model, settings),
        *_bounds_of_constraints(model, settings),
    )


def parameters_of(given: Given, nodes: Sequence[Node], aims: Sequence[Sequence[float]]) -> Floats:
    """The numbers for `Program.parameters`: what is given, then node by node with its aim."""
    values = [*given]
    for node, aim in zip(nodes, aims, strict=True):
        values += [*node.position, *node.velocity, node.thrust, *aim]
    return np.array(values)


def node_symbols(model: Model) -> ca.SX:
    """(7 + k,), the reference of one node as `parameters_of` writes it: p, v, thrust, aim."""
    return ca.vertcat(ca.SX.sym("p", 3), ca.SX.sym("v", 3), ca.SX.sym("T"), model.aim)


def running_residual(model: Model, node: ca.SX, settings: Settings) -> ca.SX:
    """What one step adds to the residual r, at the symbols of the model and of `node`."""
    weights = settings.weights
    scaled = (
        (weights.position, model.state[0:3] - node[0:3]),
        (weights.velocity, model.state[3:6] - node[3:6]),
        (weights.heading, model.heading_error),
        (weights.turning, model.turning_error),
        (weights.thrust, model.control[-1] - node[6]),
    )
    residual: ca.SX = ca.vertcat(
        *(sqrt(settings.step * weight) * error for weight, error in scaled)
    )
    return residual


def final_residual(x: ca.SX, node: ca.SX, settings: Settings) -> ca.SX:
    """What the end of the horizon adds to it, in the state x."""
    weights = settings.weights
    residual: ca.SX = ca.vertcat(
        sqrt(weights.final * weights.position) * (x[0:3] - node[0:3]),
        sqrt(weights.final * weights.velocity) * (x[3:6] - node[3:6]),
    )
    return residual


def _bounds_of_unknown(model: Model, settings: Settings) -> tuple[Floats, Floats]:
    free_state = np.full(model.state.numel(), np.inf)
    control = np.full(model.control.numel(), np.inf)
    lowest, highest = -control, control.copy()
    lowest[-1], highest[-1] = settings.min_thrust, settings.max_thrust
    lower = np.concatenate([-free_state, *[lowest, -free_state] * settings.steps])
    upper = np.concatenate([free_state, *[highest, free_state] * settings.steps])
    return lower, upper


def _bounds_of_constraints(model: Model, settings: Settings) -> tuple[Floats, Floats]:
    gap, bounded = np.zeros(model.state.numel()), np.ones(model.bounded.numel())
    upper = np.concatenate([gap, bounded] * settings.steps)
    return -upper, upper
