"""Many vehicles at once: the laws of `companion.attitude`, mapped over arrays.

There is no control law here. Where numba is installed it compiles the very functions that a flight
calls; where it is not, the same functions are called one vehicle after the other. Arrays are
float64, component first: quaternions (4, n), targets (4, n), body rates (3, n), so that vehicles
lie side by side and a processor works on several of them in one instruction.
"""

from companion.batch.batch import COMPILE_FROM, History, advance, can_compile, rates, simulate

__all__ = ["COMPILE_FROM", "History", "advance", "can_compile", "rates", "simulate"]
