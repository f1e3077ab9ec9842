"""Many vehicles at once: the laws of `companion.attitude`, mapped over arrays.

There is no control law here. With numba the same functions that a flight calls are compiled;
without it they are called for one vehicle after the other. Arrays are float64, component first:
quaternions (4, n), targets (4, n), body rates (3, n). So the processor works on several vehicles in
one instruction.
"""

from companion.batch.batch import COMPILE_FROM, History, advance, can_compile, rates, simulate

__all__ = ["COMPILE_FROM", "History", "advance", "can_compile", "rates", "simulate"]
