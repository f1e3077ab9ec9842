"""A point mass with drag under a turning thrust, written on SciPy rotations: the judge."""

import casadi as ca
import numpy as np
from scipy.spatial.transform import Rotation

from companion.drag import Drag
from companion.guidance.trajectory.figures import Laps, helix
from companion.nmpc.model import Conditions, Motion
from companion.nmpc.receding_horizon import plan_on_reference
from companion.nmpc.reference import Start, node_of

GRAVITY, DRAG, AXIS_DRAG = 9.80665, Drag(0.8, 0.1), 0.05
WIND = np.array([0.4, -0.3, 0.2])
CONDITIONS = Conditions(*WIND, *DRAG, AXIS_DRAG)
POSITION, VELOCITY = (1.0, -2.0, 3.0), (2.0, -1.0, 0.5)
H = 1e-5
"""Step of the finite differences, s."""
HELIX = helix(4.0, 3.0, Laps(4.0, laps=3.0, face_path=True))


def acceleration(r, thrust, velocity):
    """NED, of an attitude (body → world); thrust pushes along −body z."""
    share = DRAG.linear + DRAG.quadratic * np.linalg.norm(velocity)
    lift = thrust * r.apply([0.0, 0.0, 1.0])
    level = Rotation.from_euler("Z", heading(r))
    forward, right, _ = level.inv().apply([*velocity[:2], 0.0])
    usual = 8.0 / (3.0 * np.pi) * np.hypot(forward, right)
    bluff = [forward * (abs(forward) - usual), right * (abs(right) - usual), 0.0]
    slowed = share * np.asarray(velocity) + AXIS_DRAG * level.apply(bluff)
    return [0.0, 0.0, GRAVITY] - lift - slowed + WIND


def turned(r, body_rates, seconds):
    return r * Rotation.from_rotvec(np.asarray(body_rates) * seconds)


def coefficients(r):
    return -r.as_matrix()[:2, 2]


def heading(r):
    _, _, z, w = r.as_quat()
    return 2.0 * np.arctan2(z, w)


def quaternion(r):
    """(w, x, y, z)."""
    x, y, z, w = r.as_quat()
    return w, x, y, z


def motion(position, velocity, r, speed=(0.0, 0.0)):
    return Motion(*position, *velocity, *coefficients(r), heading(r), *speed)


def attitudes():
    random = np.random.default_rng(7)
    for _ in range(6):
        yield Rotation.from_euler("ZYX", random.uniform([-3.0, -0.7, -0.7], [3.0, 0.7, 0.7]))


def derivative(model, state, control, r=None):
    """By the model, whose horizon begins at the attitude r, or level."""
    start = motion(POSITION, VELOCITY, Rotation.identity() if r is None else r)
    function = ca.Function("f", [model.state, model.control, model.constants], [model.derivative])
    return np.array(function(state, control, list(model.constants_of(CONDITIONS, start)))).ravel()


def nodes_about(time, step=H):
    """The reference on the helix at three times, the middle one given."""
    start, nodes, near = Start((1.0, 2.0, -3.0)), [], 3.0
    for k in range(-1, 2):
        sample = HELIX.at(time + k * step)
        nodes.append(node_of(sample, start, near, DRAG, AXIS_DRAG, GRAVITY, tuple(WIND)))
        near = nodes[-1].heading
    return nodes


def assert_stays_on_its_reference(model, settings, time, states):
    """Flatness, control and reference of a turning, climbing path: nothing is left to correct.

    The first `states` of the derivative are compared.
    """
    nodes = nodes_about(time)
    plan = plan_on_reference(model, nodes, settings)
    n, m = model.state.numel(), model.control.numel()
    before, here, after = (plan[k * (n + m) :][:n] for k in range(3))
    control = plan[n + m + n :][:m]
    moved = derivative(model, here, control)
    assert np.allclose(moved[:states], (after - before)[:states] / (2.0 * H), rtol=0.0, atol=1e-5)
    errors = ca.Function(
        "e",
        [model.state, model.control, model.attitude_reference],
        [ca.vertcat(model.heading_error, model.attitude_rate_error)],
    )
    left = np.array(errors(here, control, model.attitude_reference_of(nodes[1]))).ravel()
    assert np.allclose(left, np.zeros(4), rtol=0.0, atol=1e-9)


def heading_error(model):
    """Of a level vehicle at 0.5 rad whose reference is level at 0.4 rad."""
    node = nodes_about(3.0)[1]._replace(heading=0.4, north=0.0, east=0.0)
    error = ca.Function("e", [model.state, model.attitude_reference], [model.heading_error])
    state = model.state_of(motion(POSITION, VELOCITY, Rotation.from_euler("Z", 0.5)))
    return float(error(state, model.attitude_reference_of(node)))
