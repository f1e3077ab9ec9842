"""Receding horizon: each solve starts from the previous plan, shifted in time."""

from collections.abc import Callable, Sequence
from math import floor
from time import thread_time
from typing import NamedTuple

import casadi as ca
import numpy as np

from companion.nmpc.model import Conditions, Model, Motion
from companion.nmpc.problem import Floats, SqpSolver, parameters_of
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings


class FirstControl(NamedTuple):
    """First control of a new plan, as a target for the planner, and the solver's statistics."""

    iterations: int
    """Number of SQP iterations."""
    solver_seconds: float
    """Processor time of the solver alone, s."""
    north: float
    east: float
    heading: float
    """Target for the planner: acceleration coefficients `north` and `east`; `heading`, rad."""
    thrust: float
    """Specific thrust, m/s²."""


class RecedingHorizon:
    """Solves the optimal control problem at each request, starting from the previous plan.

    For all models the cost penalises the same errors: of position, velocity, heading, attitude rate
    and thrust, each relative to the reference; see `Weights`.
    """

    def __init__(self, settings: Settings, make_model: Callable[[Settings], Model]) -> None:
        self._settings = settings
        self._model = make_model(settings)
        self._solver = SqpSolver(self._model, settings)
        inputs = [self._model.state, self._model.control, self._model.constants]
        self._target_function = ca.Function("target", inputs, [self._model.target])
        self._previous_plan: Floats | None = None
        self._previous_time = 0.0

    def forget(self) -> None:
        """Start the next solve from the reference instead of the previous plan."""
        self._previous_plan = None

    def solve(
        self, time: float, motion: Motion, nodes: Sequence[Node], conditions: Conditions
    ) -> FirstControl | None:
        """Compute a plan that begins at `motion`; return its first control, or None without a plan.

        Args:
            time: time of `motion`, s. The solve starts from the previous plan, shifted to this
                time, or from the reference if the previous plan begins later.
            motion: motion at the start of the horizon.
            nodes: the reference at the `Settings.steps` + 1 nodes of the horizon.
            conditions: wind and drag.
        """
        model = self._model
        start = np.array(model.state_of(motion))
        constants = list(model.constants_of(conditions, motion))
        guess = self._guess(time, nodes)
        guess[: len(start)] = start
        parameters = parameters_of(
            constants, nodes, [model.attitude_reference_of(node) for node in nodes]
        )
        if not (np.isfinite(start).all() and np.isfinite(parameters).all()):
            self.forget()
            return None
        began = thread_time()
        solution = self._solver.solve(guess, parameters)
        solver_seconds = thread_time() - began
        if not (solution.solved and np.isfinite(solution.unknowns).all()):
            self.forget()
            return None
        self._previous_plan, self._previous_time = solution.unknowns, time
        control = solution.unknowns[len(start) : len(start) + model.control.numel()]
        target = np.asarray(
            self._target_function(start, control, constants), dtype=np.float64
        ).ravel()
        return FirstControl(solution.iterations, solver_seconds, *(float(v) for v in target))

    def _guess(self, time: float, nodes: Sequence[Node]) -> Floats:
        """The solver's initial guess: the previous plan shifted to `time`, or the reference."""
        if self._previous_plan is None or not time >= self._previous_time:
            return plan_on_reference(self._model, nodes, self._settings)
        steps = (time - self._previous_time) / self._settings.step_duration
        return shifted_plan(self._model, self._previous_plan, steps)


def shifted_plan(model: Model, plan: Floats, steps: float) -> Floats:
    """A plan shifted to a time `steps` steps later; beyond its end the last values repeat.

    `plan`: (x_0, u_0, …, x_N). `steps`: number of steps, not negative; the plan is interpolated
    between nodes.
    """
    n = model.state.numel()
    stages = plan[:-n].reshape(-1, n + model.control.numel())
    states = np.vstack([stages[:, :n], plan[-n:]])
    return _interleave(_shift_rows(states, steps), _shift_rows(stages[:, n:], steps))


def plan_on_reference(model: Model, nodes: Sequence[Node], settings: Settings) -> Floats:
    """The plan that follows the reference from the start, with its thrust within the limits."""
    states = [model.state_of(_motion_of(node)) for node in nodes]
    controls = np.array([model.control_of(node) for node in nodes[:-1]])
    controls[:, -1] = controls[:, -1].clip(settings.min_thrust, settings.max_thrust)
    return _interleave(np.array(states), controls)


def _shift_rows(rows: Floats, steps: float) -> Floats:
    """Rows, one for each node, shifted to a time `steps` steps later; the last row repeats."""
    whole_steps = floor(steps)
    last_index = len(rows) - 1
    lower_index = np.minimum(np.arange(len(rows)) + whole_steps, last_index)
    upper_index = np.minimum(lower_index + 1, last_index)
    return np.asarray(
        rows[lower_index] + (steps - whole_steps) * (rows[upper_index] - rows[lower_index])
    )


def _interleave(states: Floats, controls: Floats) -> Floats:
    """The plan (x_0, u_0, …, x_N) of N + 1 states and N controls."""
    return np.concatenate([np.hstack([states[:-1], controls]).ravel(), states[-1]])


def _motion_of(node: Node) -> Motion:
    return Motion(
        *node.position,
        *node.velocity,
        node.north,
        node.east,
        node.heading,
        node.speed_north,
        node.speed_east,
    )
