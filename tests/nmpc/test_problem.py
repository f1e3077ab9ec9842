"""What is planned: on the reference, within the limits, from the plan before."""

from math import hypot, nan, sin

import casadi as ca
import numpy as np
import pytest

from companion.drag import Drag
from companion.guidance.trajectory.figures import Laps, circle
from companion.nmpc import Settings, Start, Weights
from companion.nmpc.model import Given, Motion
from companion.nmpc.models import MODEL_NAMES, make_model
from companion.nmpc.problem import Problem
from companion.nmpc.reference import node_of
from companion.nmpc.transcription import parameters_of, transcribe
from companion.nmpc.warm_start import moved_on, on_reference
from tests.attitude.independent import attitudes

CIRCLE = circle(5.0, Laps(5.0, laps=4.0))
STEADY = 6.0
"""On it, s: long after its beginning, long before its end."""
DRAG = Drag(0.75, 0.05)
SETTINGS = Settings(iterations=30)


def nodes(settings, time):
    start = Start((0.0, 0.0, 0.0))
    return [
        node_of(
            CIRCLE.at(time + k * settings.step),
            start,
            0.0,
            DRAG,
            settings.gravity,
            (0,) * 3,
        )
        for k in range(settings.steps + 1)
    ]


def given(settings, c=(0.0, 0.0)):
    yaw = attitudes(c, [0.0])[0].as_euler("ZYX")[0]
    return Given(0.0, 0.0, 0.0, yaw, max(sin(settings.max_tilt), hypot(*c)), *DRAG)


def on_circle(time):
    node = nodes(SETTINGS, time)[0]
    return Motion(
        *node.position,
        *node.velocity,
        node.north,
        node.east,
        node.heading,
        node.speed_north,
        node.speed_east,
    )


def at_rest(time):
    return Motion(*CIRCLE.at(time).position, *[0.0] * 8)


@pytest.mark.parametrize("model", MODEL_NAMES)
def test_on_the_reference_the_plan_is_what_the_reference_takes(model):
    settings = Settings(model=model, iterations=30, max_tilt_rate=4.0)
    node = nodes(settings, STEADY)[0]
    known = given(settings, (node.north, node.east))
    plan = Problem(settings).solve(0.0, on_circle(STEADY), nodes(settings, STEADY), known)
    assert plan.solved
    assert plan.converged
    # Controls are held for 50 ms, in which the reference moves on by 0.03.
    wanted = node.north + node.speed_north / 5.0, node.east + node.speed_east / 5.0
    assert (plan.north, plan.east) == pytest.approx(wanted, abs=0.03)
    assert plan.thrust == pytest.approx(node.thrust, abs=0.1)
    # Held Euler yaw is not held heading, where the tilt turns.
    assert plan.heading == pytest.approx(0.0, abs=0.1 if model == "euler-reduced" else 0.05)


def test_the_cost_is_the_weighted_square_of_the_error_over_the_horizon_and_at_its_end():
    weights = Weights(position=3.0, velocity=0.7, heading=1.1, turning=0.2, thrust=0.3, final=0.4)
    settings = Settings(model="proposed", weights=weights, horizon=0.8, steps=16, max_thrust=50.0)
    model, ahead = make_model(settings), nodes(settings, STEADY)
    program = transcribe(model, settings)
    residual = ca.Function("r", [program.unknown, program.parameters], [program.residual])
    parameters = parameters_of(given(settings), ahead, [model.aim_of(node) for node in ahead])

    def cost(plan):
        return np.sum(
            np.square(np.array(residual(on_reference(model, plan, settings), parameters)))
        )

    def off(name, by):
        return [node._replace(**{name: getattr(node, name) + by}) for node in ahead]

    def away(name, by):
        return [node._replace(**{name: tuple(np.add(getattr(node, name), by))}) for node in ahead]

    assert cost(ahead) == pytest.approx(0.0, abs=1e-12)
    assert cost(away("position", (1.0, 2.0, 2.0))) == pytest.approx(9.0 * 3.0 * (0.8 + 0.4))
    assert cost(away("velocity", (2.0, -1.0, 2.0))) == pytest.approx(9.0 * 0.7 * (0.8 + 0.4))
    assert cost(off("heading", 0.5)) == pytest.approx(0.25 * 1.1 * 0.8)
    assert cost(off("heading_rate", 0.5)) == pytest.approx(0.25 * 0.2 * 0.8)
    assert cost(off("speed_north", 0.5)) == pytest.approx(0.25 * 0.2 * 0.8)
    assert cost(off("thrust", 2.0)) == pytest.approx(4.0 * 0.3 * 0.8)


def tilt_rate(c, speed):
    """Of the thrust axis, by finite differences of SciPy rotations."""
    h = 1e-6
    ends = [attitudes(np.add(c, sign * h * np.array(speed)), [0.0])[0] for sign in (-1, 1)]
    axes = [end.apply([0.0, 0.0, 1.0]) for end in ends]
    return np.linalg.norm(axes[1] - axes[0]) / (2.0 * h)


def test_a_single_iteration_from_anywhere_keeps_the_limits():
    settings = Settings(max_tilt=0.6, max_tilt_rate=1.5, max_yaw_rate=0.5)
    problem, random = Problem(settings), np.random.default_rng(3)
    ahead, reached = nodes(settings, STEADY), []
    for _ in range(40):
        c = random.uniform(0.0, 0.5) * np.array([np.cos(a := random.uniform(0.0, 6.3)), np.sin(a)])
        speed, heading = random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0)
        position = random.uniform(-8.0, 8.0, 3)
        motion = Motion(*position, *random.uniform(-6.0, 6.0, 3), *c, heading, *speed)
        problem.forget()
        plan = problem.solve(0.0, motion, ahead, given(settings, c))
        assert plan.solved
        asked = 5.0 * np.array([plan.north - c[0], plan.east - c[1]])
        assert hypot(plan.north, plan.east) <= sin(0.6) + 1e-6
        assert tilt_rate(c, asked) <= 1.5 + 1e-3
        assert abs(2.0 * (plan.heading - heading)) <= 0.5 + 1e-6
        assert settings.min_thrust - 1e-6 <= plan.thrust <= settings.max_thrust + 1e-6
        reached.append((tilt_rate(c, asked), abs(2.0 * (plan.heading - heading)), plan.thrust))
    rates, yaw_rates, thrusts = np.array(reached).T
    assert rates.max() > 0.95 * 1.5  # the limits are felt
    assert yaw_rates.max() > 0.49
    assert thrusts.max() > 17.9


def test_tilted_beyond_the_limit_it_comes_back_instead_of_failing():
    settings = Settings(max_tilt=0.5)
    c = (0.6, -0.3)
    motion = Motion(*[0.0] * 6, *c, 0.0, 0.0, 0.0)
    plan = Problem(settings).solve(0.0, motion, nodes(settings, 0.0), given(settings, c))
    assert plan.solved
    assert hypot(plan.north, plan.east) < hypot(*c)


def test_the_proposed_model_knows_no_limit():
    settings = Settings(model="proposed")
    plan = Problem(settings).solve(0.0, at_rest(STEADY), nodes(settings, STEADY), given(settings))
    assert hypot(plan.north, plan.east) > 1.0


def test_a_plan_that_was_moved_on_needs_fewer_iterations():
    problem = Problem(SETTINGS)
    cold = problem.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), given(SETTINGS))
    again = problem.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), given(SETTINGS))
    assert cold.converged
    assert cold.iterations >= 5
    assert again.iterations <= 2
    assert again[4:] == pytest.approx(cold[4:], abs=1e-3)
    problem.forget()
    assert (
        problem.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), given(SETTINGS)).iterations
        == cold.iterations
    )


def test_a_plan_is_moved_on_by_parts_of_a_step():
    model = make_model(Settings(model="proposed"))
    n, m = 9, 4
    ramp = np.array([k + j / 100.0 for k in range(4) for j in range(n + m)][:-m])
    moved = moved_on(model, ramp, 1.4)
    rows = np.append(moved, np.zeros(m)).reshape(4, n + m)
    assert rows[:, 0] == pytest.approx([1.4, 2.4, 3.0, 3.0])
    assert rows[:3, n] == pytest.approx([1.49 - 0.0, 2.09, 2.09])


def test_a_real_time_iteration_is_one():
    problem = Problem(Settings())
    plan = problem.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), given(SETTINGS))
    assert (plan.iterations, plan.converged, plan.solved) == (1, False, True)


def test_a_number_that_is_none_gives_no_plan_and_is_forgotten():
    problem = Problem(SETTINGS)
    broken = at_rest(STEADY)._replace(p_n=nan)
    ahead = nodes(SETTINGS, STEADY)
    assert not problem.solve(0.0, broken, ahead, given(SETTINGS)).solved
    assert problem.solve(0.02, at_rest(STEADY), ahead, given(SETTINGS)).converged
