"""The rigid body against SciPy, conservation laws and closed forms."""

from math import cosh, exp, log, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.physics.rigid_body import NO_AXIS_DRAG, RigidBody, advance, body_of, derivative
from sitl_mock.settings import MockSettings

FREE = RigidBody(
    0.02, 0.035, 0.05, 0.0, 0.0, NO_AXIS_DRAG, NO_AXIS_DRAG, rotational_drag=0.0, gravity=9.80665
)
REAL = body_of(
    AirframeConfig(
        inertia_kg_m2=(0.02, 0.03, 0.045),
        drag_n_s_per_m=0.7,
        quadratic_drag_n_s2_per_m2=0.05,
        axis_drag_n_s2_per_m2=(0.03, 0.02, 0.06),
        momentum_drag_n_s_per_m=(0.25, 0.3, 0.2),
    )
)
NO_LOAD = (0.0,) * 7
LEVEL = (1.0, 0.0, 0.0, 0.0)


def fly(motion, load, body, seconds, dt=1e-3):
    position = np.zeros(3)
    for _ in range(round(seconds / dt)):
        motion, moved = advance(motion, load, body, dt)
        position += moved
    return motion, position


def rotation(motion):
    w, x, y, z = motion[3:7]
    return Rotation.from_quat([x, y, z, w])


def reference(load, body):
    """The equations of motion in matrix form, with SciPy's rotation: (position, motion)."""
    inertia = np.diag(body[:3])
    thrust, torque, wind = load[0], np.array(load[1:4]), np.array(load[4:])

    def rate(_, state):
        velocity, q, omega = state[3:6], state[6:10], state[10:]
        matrix = Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()
        air = velocity - wind
        drag = body.drag + body.quadratic_drag * np.linalg.norm(air)
        along = matrix.T @ air
        inflow = np.sqrt(thrust / body.gravity)
        shares = np.multiply(body.axis_drag, np.abs(along)) + np.multiply(
            body.momentum_drag, inflow
        )
        push = drag * air + matrix @ (shares * along)
        acceleration = [0.0, 0.0, body.gravity] - thrust * matrix[:, 2] - push
        q_rate = 0.5 * np.concatenate(([-q[1:] @ omega], q[0] * omega + np.cross(q[1:], omega)))
        moment = torque - body.rotational_drag * omega - np.cross(omega, inertia @ omega)
        return np.concatenate((velocity, acceleration, q_rate, np.linalg.solve(inertia, moment)))

    return rate


@pytest.mark.parametrize("seed", range(3))
def test_a_second_of_everything_agrees_with_solve_ivp(seed):
    random = np.random.default_rng(seed)
    q = Rotation.random(random_state=seed).as_quat()
    motion = (*random.normal(0, 3, 3), q[3], *q[:3], *random.normal(0, 4, 3))
    load = (*random.uniform(5, 15, 1), *random.normal(0, 0.05, 3), *random.normal(0, 5, 3))
    exact = solve_ivp(reference(load, REAL), (0, 1), [0, 0, 0, *motion], rtol=1e-11, atol=1e-12).y[
        :, -1
    ]
    ours, position = fly(motion, load, REAL, 1.0)
    np.testing.assert_allclose(position, exact[:3], atol=1e-8)
    np.testing.assert_allclose(ours, exact[3:], atol=1e-8)


def test_torque_free_precession_keeps_angular_momentum_and_energy():
    start = (0.0, 0.0, 0.0, *LEVEL, 1.0, 6.0, -2.0)  # near the unstable middle axis
    inertia = np.array(FREE[:3])

    def momentum(motion):
        return rotation(motion).apply(inertia * motion[7:])

    end, _ = fly(start, NO_LOAD, FREE, 5.0)
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-9)
    energy = [0.5 * float(inertia @ np.square(m[7:])) for m in (start, end)]
    assert energy[1] == pytest.approx(energy[0], rel=1e-9)
    assert np.linalg.norm(np.subtract(end[7:], start[7:])) > 1.0  # it did tumble
    assert np.linalg.norm(end[3:7]) == pytest.approx(1.0, abs=1e-12)


def test_error_falls_with_the_fourth_power_of_the_step():
    motion = (1.0, 2.0, 3.0, *LEVEL, 5.0, -7.0, 3.0)
    load = (9.0, 0.02, -0.01, 0.01, 1.0, 2.0, 0.0)
    body = REAL._replace(axis_drag=NO_AXIS_DRAG)  # it has a kink where a component changes its sign
    exact = fly(motion, load, body, 0.4, dt=1e-3)
    errors = [
        [
            np.abs(np.subtract(ours, true)).max()
            for ours, true in zip(fly(motion, load, body, 0.4, dt), exact, strict=True)
        ]
        for dt in (0.02, 0.01)
    ]
    for coarse, fine in zip(*errors, strict=True):  # of the motion, of the position
        assert 3.5 < log(coarse / fine, 2) < 4.6


def test_free_fall_is_the_parabola():
    motion, position = fly((2.0, 0.0, 0.0, *LEVEL, 0.0, 0.0, 0.0), NO_LOAD, FREE, 1.5)
    assert position == pytest.approx([3.0, 0.0, 0.5 * FREE.gravity * 1.5**2])
    assert motion[:3] == pytest.approx((2.0, 0.0, FREE.gravity * 1.5))


def test_fall_with_linear_drag_nears_the_terminal_speed():
    body = REAL._replace(quadratic_drag=0.0, axis_drag=NO_AXIS_DRAG, momentum_drag=NO_AXIS_DRAG)
    motion, _ = fly((0.0, 0.0, 0.0, *LEVEL, 0.0, 0.0, 0.0), NO_LOAD, body, 3.0)
    terminal = body.gravity / body.drag
    assert motion[2] == pytest.approx(terminal * (1.0 - exp(-3.0 * body.drag)), rel=1e-9)


def test_ardupilots_drag_is_that_measured():
    """0.31 per second at 2 m/s, 0.41 at 5 m/s."""
    body = body_of(MockSettings.model_validate({"autopilot": "ardupilot"}).airframe)
    for speed, share in ((2.0, 0.31), (5.0, 0.41)):
        motion = (speed, 0.0, 0.0, *LEVEL, 0.0, 0.0, 0.0)
        slowing = -derivative(motion, (body.gravity, *NO_LOAD[1:]), body)[0]
        assert slowing / speed == pytest.approx(share, abs=0.015)


def test_the_momentum_drag_grows_with_the_root_of_the_thrust():
    body = FREE._replace(momentum_drag=(0.25, 0.3, 0.2))
    for share in (0.0, 1.0, 4.0):
        motion = (1.0, 2.0, 0.0, *LEVEL, 0.0, 0.0, 0.0)
        rate = derivative(motion, (share * 9.80665, *NO_LOAD[1:]), body)
        assert rate[:2] == pytest.approx((-0.25 * sqrt(share), -0.6 * sqrt(share)))


def test_the_wind_carries_a_body_along():
    load = (REAL.gravity, 0.0, 0.0, 0.0, 4.0, -3.0, 0.0)
    motion, _ = fly((0.0, 0.0, 0.0, *LEVEL, 0.0, 0.0, 0.0), load, REAL, 12.0)
    assert motion[:3] == pytest.approx((4.0, -3.0, 0.0), abs=1e-2)


def test_thrust_pushes_against_the_bodys_down_axis():
    """Nose up flies backwards, right side down flies to the right."""
    for x, y, direction in ((0.0, 0.1, (-1.0, 0.0)), (0.1, 0.0, (0.0, 1.0))):
        q = (sqrt(0.99), x, y, 0.0)
        motion = (0.0, 0.0, 0.0, *q, 0.0, 0.0, 0.0)
        rate = derivative(motion, (10.0, *NO_LOAD[1:]), FREE)
        size = 10.0 * 2.0 * 0.1 * sqrt(0.99)  # 10 m/s^2 times the sine of the tilt
        assert rate[:2] == pytest.approx((size * direction[0], size * direction[1]), abs=1e-12)


def test_spin_decays_by_the_damping_torque():
    body = FREE._replace(rotational_drag=0.025)
    motion, _ = fly((0.0, 0.0, 0.0, *LEVEL, 0.0, 0.0, 3.0), NO_LOAD, body, 1.0)
    assert motion[9] == pytest.approx(3.0 * exp(-0.025 / body.inertia_z), rel=1e-9)


def test_gyroscopic_torque_is_that_of_an_asymmetric_top():
    """Near the middle axis a small error grows as cosh(k t) (linearised Euler equations)."""
    jx, jy, jz = FREE[:3]
    spin, tiny = 6.0, 1e-6
    growth = spin * sqrt((jy - jx) * (jz - jy) / (jx * jz))
    motion, _ = fly((0.0, 0.0, 0.0, *LEVEL, tiny, spin, 0.0), NO_LOAD, FREE, 0.8)
    assert motion[7] == pytest.approx(tiny * cosh(growth * 0.8), rel=1e-6)
