"""Where a solve begins: the plan before it moved on, or the reference itself."""

from collections.abc import Sequence
from math import floor

import numpy as np
from numpy.typing import NDArray

from companion.nmpc.model import Model, Motion
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

Floats = NDArray[np.float64]


def moved_on(model: Model, plan: Floats, steps: float) -> Floats:
    """A plan as it looks `steps` of its horizon later; what it did not plan stays as at its end.

    Args:
        model: whose plan it is.
        plan: (x_0, u_0, …, x_N).
        steps: not negative; need not be whole: between two nodes it is interpolated.
    """
    n = model.state.numel()
    stages = plan[:-n].reshape(-1, n + model.control.numel())
    states = np.vstack([stages[:, :n], plan[-n:]])
    return _interleaved(_later(states, steps), _later(stages[:, n:], steps))


def on_reference(model: Model, nodes: Sequence[Node], settings: Settings) -> Floats:
    """A plan that is on its reference from the beginning."""
    states = [model.state_of(_motion_of(node)) for node in nodes]
    controls = np.array([model.control_of(node) for node in nodes[:-1]])
    controls[:, -1] = controls[:, -1].clip(settings.min_thrust, settings.max_thrust)
    return _interleaved(np.array(states), controls)


def _later(rows: Floats, steps: float) -> Floats:
    whole = floor(steps)
    last = len(rows) - 1
    before = np.minimum(np.arange(len(rows)) + whole, last)
    after = np.minimum(before + 1, last)
    return np.asarray(rows[before] + (steps - whole) * (rows[after] - rows[before]))


def _interleaved(states: Floats, controls: Floats) -> Floats:
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
