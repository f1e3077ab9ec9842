"""The prediction models of the study against a rigid body on SciPy rotations."""

from math import hypot

import casadi as ca
import numpy as np
import pytest

from companion.attitude import Target, make_planner
from companion.nmpc import Settings
from companion.nmpc.model import Motion, integrator
from companion.nmpc.receding_horizon import RecedingHorizon
from companion.study.nmpc.models import MODEL_MAKERS
from tests.nmpc import rigid
from tests.nmpc.rigid import POSITION, VELOCITY, H
from tests.nmpc.test_receding_horizon import (
    CONDITIONS,
    SETTINGS,
    STEADY,
    assert_plans_what_the_reference_takes,
    at_rest,
    nodes,
)

ATTITUDE_MODELS = ("euler", "quaternion")
NOT_FLOWN = [name for name in MODEL_MAKERS if name != "limited"]


def make_model(name, **changes):
    return MODEL_MAKERS[name](Settings(gravity=rigid.GRAVITY, **changes))


@pytest.mark.parametrize("name", ATTITUDE_MODELS)
def test_an_attitude_model_turns_and_falls_as_a_rigid_body(name):
    model, rates, thrust = make_model(name), (0.7, -0.4, 0.5), 12.0
    for r in rigid.attitudes():
        state = np.array(model.state_of(rigid.motion(POSITION, VELOCITY, r)))
        found = rigid.derivative(model, state, (*rates, thrust))
        before, after = (
            np.array(
                model.state_of(rigid.motion(POSITION, VELOCITY, rigid.turned(r, rates, seconds)))
            )
            for seconds in (-H, H)
        )
        turning = (after - before)[6:] / (2.0 * H)
        assert found[:3] == pytest.approx(VELOCITY)
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))
        assert found[6:] == pytest.approx(turning, abs=1e-7)


def test_the_reduced_euler_model_turns_its_angles_and_keeps_its_yaw():
    model, thrust = make_model("euler-reduced"), 12.0
    for r in rigid.attitudes():
        state = np.array(model.state_of(rigid.motion(POSITION, VELOCITY, r)))
        _, pitch, roll = r.as_euler("ZYX")
        assert state[6:] == pytest.approx([roll, pitch])
        found = rigid.derivative(model, state, (0.3, -0.2, thrust), r)
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))
        assert found[6:] == pytest.approx([0.3, -0.2])


def test_the_proposed_model_falls_as_a_rigid_body():
    model, thrust = make_model("proposed"), 12.0
    for r in rigid.attitudes():
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        found = rigid.derivative(model, state, (0.1, 0.2, 0.3, thrust))
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))


def test_the_proposed_model_is_first_order_in_coefficients_and_heading():
    model = make_model("proposed", gain=4.0, yaw_gain=1.5)
    advance, target = integrator(model), np.array([0.3, -0.2, 0.8])
    state = np.array([*POSITION, *VELOCITY, -0.2, 0.4, 0.1])
    after = state
    for _ in range(10):
        after = np.array(advance(after, [*target, 9.0], list(rigid.CONDITIONS), 0.02)).ravel()
    kept = np.exp(-0.2 * np.array([4.0, 4.0, 1.5]))
    assert after[6:] == pytest.approx(target + kept * (state[6:] - target), abs=1e-6)


@pytest.mark.parametrize("name", ATTITUDE_MODELS)
def test_the_target_of_body_rates_makes_the_planner_ask_for_them(name):
    model, rates = make_model(name), np.array([0.5, -0.3, 0.2])
    target_of = ca.Function("t", [model.state, model.control, model.constants], [model.target])
    planner = make_planner("first-order", 5.0, 2.0)
    for r in rigid.attitudes():
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        found = target_of(state, [*rates, 11.0], list(rigid.CONDITIONS))
        *target, thrust = np.array(found).ravel()
        asked = planner.rates(rigid.quaternion(r), Target(*map(float, target)), 0.001)
        assert asked == pytest.approx(rates, abs=1e-9)
        assert thrust == 11.0


@pytest.mark.parametrize("time", [0.7, 3.0, 7.9])
@pytest.mark.parametrize("name", ["proposed", "euler", "quaternion"])
def test_a_model_on_its_reference_stays_there(name, time):
    model = make_model(name)
    settings = Settings(gravity=rigid.GRAVITY)
    rigid.assert_stays_on_its_reference(model, settings, time, states=model.state.numel())


def test_the_reduced_euler_model_aims_at_the_rates_of_its_angles():
    model = make_model("euler-reduced")
    before, here, after = rigid.nodes_about(3.0)
    angles = [
        np.array(
            model.state_of(Motion(*n.position, *n.velocity, n.north, n.east, n.heading, 0.0, 0.0))
        )[6:]
        for n in (before, after)
    ]
    assert model.attitude_reference_of(here) == pytest.approx(
        (angles[1] - angles[0]) / (2.0 * H), abs=1e-5
    )
    assert model.control_of(here) == (*model.attitude_reference_of(here), here.thrust)
    left = ca.Function("e", [model.control, model.attitude_reference], [model.attitude_rate_error])
    assert np.array(
        left(model.control_of(here), model.attitude_reference_of(here))
    ).ravel().tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", ["proposed", "euler", "quaternion"])
def test_the_heading_error_is_the_heading_left(name):
    assert rigid.heading_error(make_model(name)) == pytest.approx(0.1, abs=1e-4)


@pytest.mark.parametrize("name", NOT_FLOWN)
def test_on_the_reference_the_plan_is_what_the_reference_takes(name):
    # Held Euler yaw is not held heading, where the tilt turns.
    within = 0.1 if name == "euler-reduced" else 0.05
    assert_plans_what_the_reference_takes(MODEL_MAKERS[name], heading_within=within)


def test_the_proposed_model_knows_no_limit():
    horizon = RecedingHorizon(Settings(), MODEL_MAKERS["proposed"])
    plan = horizon.solve(0.0, at_rest(STEADY), nodes(SETTINGS, STEADY), CONDITIONS)
    assert hypot(plan.north, plan.east) > 1.0
