"""What is planned: on the reference, within the limits, from the plan before."""

from math import hypot, nan, sin

import casadi as ca
import numpy as np
import pytest

from companion.drag import Drag
from companion.guidance.trajectory.figures import Laps, circle
from companion.nmpc import Settings, Start, Weights
from companion.nmpc.coefficient_model import coefficient_model
from companion.nmpc.model import Conditions, Motion
from companion.nmpc.problem import parameters_of, transcribe
from companion.nmpc.receding_horizon import RecedingHorizon, plan_on_reference, shifted_plan
from companion.nmpc.reference import node_of
from tests.attitude.independent import attitudes

CIRCLE = circle(5.0, Laps(5.0, laps=4.0))
STEADY = 6.0
"""On it, s: long after its beginning, long before its end."""
DRAG = Drag(0.75, 0.05)
CONDITIONS = Conditions(0.0, 0.0, 0.0, *DRAG, 0.0)
SETTINGS = Settings(iterations=30)


def nodes(settings, time):
    start = Start((0.0, 0.0, 0.0))
    return [
        node_of(
            CIRCLE.at(time + k * settings.step_duration),
            start,
            0.0,
            DRAG,
            0.0,
            settings.gravity,
            (0,) * 3,
        )
        for k in range(settings.steps + 1)
    ]


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


def horizon_of(settings):
    return RecedingHorizon(settings, coefficient_model)


def assert_plans_what_the_reference_takes(make_model, heading_within):
    settings = Settings(iterations=30, max_tilt_rate=4.0)
    horizon, ahead = RecedingHorizon(settings, make_model), nodes(settings, STEADY)
    node = ahead[0]
    plan = horizon.solve(0.0, on_circle(STEADY), ahead, CONDITIONS)
    assert plan.iterations < settings.iterations
    # Controls are held for 50 ms, in which the reference moves on by 0.03.
    wanted = node.north + node.speed_north / 5.0, node.east + node.speed_east / 5.0
    assert (plan.north, plan.east) == pytest.approx(wanted, abs=0.03)
    assert plan.thrust == pytest.approx(node.thrust, abs=0.1)
    assert plan.heading == pytest.approx(0.0, abs=heading_within)


def test_on_the_reference_the_plan_is_what_the_reference_takes():
    assert_plans_what_the_reference_takes(coefficient_model, heading_within=0.05)


def test_the_cost_is_the_weighted_square_of_the_error_over_the_horizon_and_at_its_end():
    weights = Weights(
        position=3.0, velocity=0.7, heading=1.1, attitude_rate=0.2, thrust=0.3, final=0.4
    )
    settings = Settings(weights=weights, horizon=0.8, steps=16, max_thrust=50.0)
    model, ahead = coefficient_model(settings), nodes(settings, STEADY)
    program = transcribe(model, settings)
    residual = ca.Function("r", [program.unknowns, program.parameters], [program.residual])
    constants = model.constants_of(CONDITIONS, on_circle(STEADY))
    parameters = parameters_of(
        constants, ahead, [model.attitude_reference_of(node) for node in ahead]
    )

    def cost(plan):
        return np.sum(
            np.square(np.array(residual(plan_on_reference(model, plan, settings), parameters)))
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
    horizon, random = horizon_of(settings), np.random.default_rng(3)
    ahead, reached = nodes(settings, STEADY), []
    for _ in range(40):
        c = random.uniform(0.0, 0.5) * np.array([np.cos(a := random.uniform(0.0, 6.3)), np.sin(a)])
        speed, heading = random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0)
        position = random.uniform(-8.0, 8.0, 3)
        motion = Motion(*position, *random.uniform(-6.0, 6.0, 3), *c, heading, *speed)
        horizon.forget()
        plan = horizon.solve(0.0, motion, ahead, CONDITIONS)
        assert plan is not None
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
    plan = horizon_of(settings).solve(0.0, motion, nodes(settings, 0.0), CONDITIONS)
    assert plan is not None
    assert hypot(plan.north, plan.east) < hypot(*c)


def test_a_shifted_plan_needs_fewer_iterations():
    horizon = horizon_of(SETTINGS)
    cold = horizon.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), CONDITIONS)
    again = horizon.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), CONDITIONS)
    assert 5 <= cold.iterations < SETTINGS.iterations
    assert again.iterations <= 2
    assert again[4:] == pytest.approx(cold[4:], abs=1e-3)
    horizon.forget()
    assert (
        horizon.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), CONDITIONS).iterations
        == cold.iterations
    )


def test_a_plan_is_shifted_by_parts_of_a_step():
    model = coefficient_model(Settings())
    n, m = 11, 4
    ramp = np.array([k + j / 100.0 for k in range(4) for j in range(n + m)][:-m])
    moved = shifted_plan(model, ramp, 1.4)
    rows = np.append(moved, np.zeros(m)).reshape(4, n + m)
    assert rows[:, 0] == pytest.approx([1.4, 2.4, 3.0, 3.0])
    assert rows[:3, n] == pytest.approx([1.51, 2.11, 2.11])


def test_a_real_time_iteration_is_one():
    horizon = horizon_of(Settings())
    plan = horizon.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), CONDITIONS)
    assert plan.iterations == 1


def test_a_number_that_is_none_gives_no_plan_and_is_forgotten():
    horizon = horizon_of(SETTINGS)
    broken = at_rest(STEADY)._replace(p_n=nan)
    ahead = nodes(SETTINGS, STEADY)
    assert horizon.solve(0.0, broken, ahead, CONDITIONS) is None
    plan = horizon.solve(0.02, at_rest(STEADY), ahead, CONDITIONS)
    assert plan.iterations < SETTINGS.iterations
