"""Predictive control: what each prediction model costs to solve, and what it is worth in flight.

`contest` flies the models side by side on the `vehicle`, `cold_start` counts the iterations from
states far off the trajectory, `exchange` times the solver in its own process.
"""

from companion.study.nmpc.study import PARTS, run

__all__ = ["PARTS", "run"]
