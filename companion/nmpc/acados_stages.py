"""What goes into acados' solver and comes out of it, stage by stage, by its C functions.

acados' own `set` and `get` look every field up and convert it at every call. A solve takes 120 of
them, 0.9 ms, where the solver itself takes 0.2 to 0.8. These are the same C functions, called with
arguments that were made once.
"""

from collections.abc import Callable
from ctypes import c_char_p, c_int, c_void_p
from functools import partial
from typing import Any

import numpy as np

from companion.nmpc.warm_start import Floats


class Stages:
    """The memory of a solver with n states, m controls, N steps, and p parameters at each node.

    Args:
        solver: acados' `AcadosOcpSolver`.
        states: n.
        controls: m.
        parameters: p.

    Attributes:
        plan: (x_0, u_0, x_1, …, x_N), which `send` hands over and `fetch` overwrites.
        parameters: (N + 1, p), handed over with it.
    """

    def __init__(self, solver: Any, states: int, controls: int, parameters: int) -> None:
        steps = solver.N
        self.plan: Floats = np.zeros(steps * (states + controls) + states)
        self.parameters: Floats = np.zeros((steps + 1, parameters))
        fields = [
            (stage, field, stage * (states + controls) + offset)
            for stage in range(steps + 1)
            for field, offset in (("x", 0), ("u", states))
        ][:-1]  # there is no control at the end
        self._sends = [_field(solver, "ocp_nlp_out_set", *one, self.plan) for one in fields]
        # acados' own `reset` hands over more zeros than it has: what follows them in memory.
        duals = [(k, name) for k in range(steps + 1) for name in ("lam", "t", "pi")][:-1]
        self._zeros: Floats = np.zeros(max(len(solver.get(*one)) for one in duals))
        self._sends += [_field(solver, "ocp_nlp_out_set", *one, 0, self._zeros) for one in duals]
        self._sends += [
            _field(solver, "ocp_nlp_constraints_model_set", 0, bound, 0, self.plan)
            for bound in ("lbx", "ubx")
        ]
        self._sends += [_parameters(solver, k, row) for k, row in enumerate(self.parameters)]
        self._fetches = [_field(solver, "ocp_nlp_out_get", *one, self.plan) for one in fields]

    def send(self) -> None:
        """Begin at the plan without multipliers, hold its first state, take the parameters."""
        for call in self._sends:
            call()

    def fetch(self) -> None:
        """Read the plan."""
        for call in self._fetches:
            call()


def _field(
    solver: Any, function: str, stage: int, field: str, offset: int, values: Floats
) -> Callable[[], int]:
    """A call that moves one field of one stage from or to its place in `values`."""
    into_problem = function == "ocp_nlp_constraints_model_set"
    memory = solver.nlp_in if into_problem else solver.nlp_out
    return partial(
        getattr(solver.shared_lib, function),
        c_void_p(solver.nlp_config),
        c_void_p(solver.nlp_dims),
        c_void_p(memory),
        c_int(stage),
        c_char_p(field.encode()),
        c_void_p(values.ctypes.data + offset * values.itemsize),
    )


def _parameters(solver: Any, stage: int, row: Floats) -> Callable[[], int]:
    update = getattr(solver.shared_lib, f"{solver.model_name}_acados_update_params")
    address = c_void_p(row.ctypes.data)
    return partial(update, c_void_p(solver.capsule), c_int(stage), address, c_int(len(row)))
