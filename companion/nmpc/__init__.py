"""Nonlinear model predictive control of the outer loop, in a process of its own.

`Solver` is what a flight needs, and imports no CasADi: that lives in the process (`worker`). There,
`Planning` works a request off: `prediction` carries the motion on to when the answer acts,
`reference` says what the trajectory takes, and `Problem` solves for one of the `models` by one of
two backends: CasADi's SQP (extra `nmpc`) or acados' (extra `acados`). `solvers` says which of them
can be had.
"""

from companion.nmpc.messages import Answer, Input, Request, Status, Vehicle
from companion.nmpc.process import Solver, Trouble
from companion.nmpc.reference import Start
from companion.nmpc.settings import ModelName, Settings, SolverName, Weights

__all__ = [
    "Answer",
    "Input",
    "ModelName",
    "Request",
    "Settings",
    "Solver",
    "SolverName",
    "Start",
    "Status",
    "Trouble",
    "Vehicle",
    "Weights",
]
