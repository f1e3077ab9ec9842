"""The prediction models against a rigid body on SciPy rotations, by finite differences."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import Target, make_planner
from companion.guidance.trajectory.figures import Laps, helix
from companion.nmpc.model import Given, integrator
from companion.nmpc.models import MODEL_NAMES, make_model
from companion.nmpc.reference import Start, node_of
from companion.nmpc.settings import Settings
from companion.nmpc.warm_start import on_reference
from tests.nmpc import rigid

H = 1e-5
ATTITUDE_MODELS = ("euler", "quaternion")
POSITION, VELOCITY = (1.0, -2.0, 3.0), (2.0, -1.0, 0.5)
HELIX = helix(4.0, 3.0, Laps(4.0, laps=3.0, along=True))


def settings(model, **changes):
    return Settings(model=model, gravity=rigid.GRAVITY, **changes)


def attitudes():
    random = np.random.default_rng(7)
    for _ in range(6):
        yield Rotation.from_euler("ZYX", random.uniform([-3.0, -0.7, -0.7], [3.0, 0.7, 0.7]))


def given(r=None):
    yaw = 0.0 if r is None else r.as_euler("ZYX")[0]
    return Given(*rigid.WIND, yaw, 0.7, *rigid.DRAG)


def derivative(model, state, control, of):
    function = ca.Function("f", [model.state, model.control, model.given], [model.derivative])
    return np.array(function(state, control, list(of))).ravel()


@pytest.mark.parametrize("name", ATTITUDE_MODELS)
def test_an_attitude_model_turns_and_falls_as_a_rigid_body(name):
    model, rates, thrust = make_model(settings(name)), (0.7, -0.4, 0.5), 12.0
    for r in attitudes():
        state = np.array(model.state_of(rigid.motion(POSITION, VELOCITY, r)))
        found = derivative(model, state, (*rates, thrust), given())
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
    model, thrust = make_model(settings("euler-reduced")), 12.0
    for r in attitudes():
        state = np.array(model.state_of(rigid.motion(POSITION, VELOCITY, r)))
        _, pitch, roll = r.as_euler("ZYX")
        assert state[6:] == pytest.approx([roll, pitch])
        found = derivative(model, state, (0.3, -0.2, thrust), given(r))
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))
        assert found[6:] == pytest.approx([0.3, -0.2])


@pytest.mark.parametrize("name", ["proposed", "limited"])
def test_a_coefficient_model_falls_as_a_rigid_body(name):
    model, thrust = make_model(settings(name)), 12.0
    for r in attitudes():
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        found = derivative(model, state, (0.1, 0.2, 0.3, thrust), given())
        assert found[3:6] == pytest.approx(rigid.acceleration(r, thrust, VELOCITY))


def test_the_proposed_model_is_first_order_in_coefficients_and_heading():
    model = make_model(settings("proposed", gain=4.0, yaw_gain=1.5))
    advance, target = integrator(model), np.array([0.3, -0.2, 0.8])
    state = np.array([*POSITION, *VELOCITY, -0.2, 0.4, 0.1])
    after = state
    for _ in range(10):
        after = np.array(advance(after, [*target, 9.0], list(given()), 0.02)).ravel()
    kept = np.exp(-0.2 * np.array([4.0, 4.0, 1.5]))
    assert after[6:] == pytest.approx(target + kept * (state[6:] - target), abs=1e-6)


def test_our_model_is_second_order_in_the_coefficients():
    model = make_model(settings("limited", gain=4.0, lag=0.1))
    advance, target = integrator(model), np.array([0.3, -0.2])
    state = np.array([*POSITION, *VELOCITY, -0.2, 0.4, 0.1, 0.5, -0.6])
    after = state
    for _ in range(40):
        after = np.array(advance(after, [*target, 0.1, 9.0], list(given()), 0.005)).ravel()
    roots = np.roots([0.1, 1.0, 4.0])  # of τ·s² + s + p
    for axis in (0, 1):
        distance, speed = state[6 + axis] - target[axis], state[9 + axis]
        shares = np.linalg.solve([[1.0, 1.0], roots], [distance, speed])
        wanted = np.real(shares @ np.exp(0.2 * roots))
        assert after[6 + axis] == pytest.approx(target[axis] + wanted, abs=1e-6)


@pytest.mark.parametrize("name", ATTITUDE_MODELS)
def test_the_target_of_body_rates_makes_the_planner_ask_for_them(name):
    model, rates = make_model(settings(name)), np.array([0.5, -0.3, 0.2])
    target_of = ca.Function("t", [model.state, model.control, model.given], [model.target])
    planner = make_planner("first-order", 5.0, 2.0)
    for r in attitudes():
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        *target, thrust = np.array(target_of(state, [*rates, 11.0], list(given()))).ravel()
        asked = planner.rates(rigid.quaternion(r), Target(*map(float, target)), 0.001)
        assert asked == pytest.approx(rates, abs=1e-9)
        assert thrust == 11.0


def nodes_about(time, step):
    start, nodes, near = Start((1.0, 2.0, -3.0)), [], 3.0
    for k in range(-1, 2):
        sample = HELIX.at(time + k * step)
        nodes.append(node_of(sample, start, near, rigid.DRAG, rigid.GRAVITY, tuple(rigid.WIND)))
        near = nodes[-1].heading
    return nodes


@pytest.mark.parametrize("time", [0.7, 3.0, 7.9])
@pytest.mark.parametrize("name", [name for name in MODEL_NAMES if name != "euler-reduced"])
def test_a_model_on_its_reference_stays_there(name, time):
    """Flatness, control and aim of a turning, climbing path: nothing is left to correct."""
    model = make_model(settings(name))
    nodes = nodes_about(time, H)
    plan = on_reference(model, nodes, settings(name))
    n, m = model.state.numel(), model.control.numel()
    before, here, after = (plan[k * (n + m) :][:n] for k in range(3))
    control = plan[n + m + n :][:m]
    moved = derivative(model, here, control, given())
    told = 9 if name == "limited" else n  # its lag is not led: the first order of it is
    assert moved[:told] == pytest.approx((after - before)[:told] / (2.0 * H), abs=1e-5)
    errors = ca.Function(
        "e",
        [model.state, model.control, model.aim],
        [ca.vertcat(model.heading_error, model.turning_error)],
    )
    left = np.array(errors(here, control, model.aim_of(nodes[1]))).ravel()
    assert left == pytest.approx(np.zeros(4), abs=1e-9)


def test_the_reduced_euler_model_aims_at_the_rates_of_its_angles():
    model = make_model(settings("euler-reduced"))
    before, here, after = nodes_about(3.0, H)
    angles = [
        np.array(
            model.state_of(
                rigid.Motion(*n.position, *n.velocity, n.north, n.east, n.heading, 0.0, 0.0)
            )
        )[6:]
        for n in (before, after)
    ]
    assert model.aim_of(here) == pytest.approx((angles[1] - angles[0]) / (2.0 * H), abs=1e-5)
    assert model.control_of(here) == (*model.aim_of(here), here.thrust)
    left = ca.Function("e", [model.control, model.aim], [model.turning_error])
    assert np.array(left(model.control_of(here), model.aim_of(here))).ravel().tolist() == [0.0, 0.0]


def test_the_heading_error_is_the_heading_left():
    r = rigid.Rotation.from_euler("Z", 0.5)
    node = nodes_about(3.0, H)[1]._replace(heading=0.4, north=0.0, east=0.0)
    for name in ("proposed", "limited", "euler", "quaternion"):
        model = make_model(settings(name))
        error = ca.Function("e", [model.state, model.aim], [model.heading_error])
        state = model.state_of(rigid.motion(POSITION, VELOCITY, r))
        assert float(error(state, model.aim_of(node))) == pytest.approx(0.1, abs=1e-4)


def test_an_unknown_model_is_refused():
    with pytest.raises(ValueError, match="unknown model 'cubic'; known: proposed"):
        make_model(settings("cubic"))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lag": 0.01}, "half a step of the horizon"),
        ({"gain": 0.0}, "gain must be positive"),
        ({"dead_time": -0.1}, "dead_time must be finite and not negative"),
        ({"max_tilt": 1.6}, "between 0 and 90°"),
        ({"max_thrust": 9.0}, "gravity must lie between"),
        ({"deadline": float("nan")}, "deadline must be positive"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Settings(**changes)
