"""Nonlinear model predictive control (NMPC) of the outer loop, in a process of its own.

A flight uses `Solver`, which starts that process and does not import CasADi (extra `nmpc`). In the
process, `Worker` answers each request:

1. `prediction` integrates the motion to the time at which the answer takes effect.
2. `reference` computes the attitude and thrust that the trajectory needs.
3. `RecedingHorizon` solves the optimal control `problem` of the `coefficient_model`.
"""

from companion.nmpc.messages import Answer, ControlInput, Request, Status, VehicleSnapshot
from companion.nmpc.process import Solver, Trouble
from companion.nmpc.reference import Start
from companion.nmpc.settings import Settings, Weights

__all__ = [
    "Answer",
    "ControlInput",
    "Request",
    "Settings",
    "Solver",
    "Start",
    "Status",
    "Trouble",
    "VehicleSnapshot",
    "Weights",
]
