"""One step of rigid-body dynamics, as arithmetic on floats and tuples, without state.

World NED, body FRD, quaternion (w, x, y, z) body to world, SI. The functions allocate nothing but
tuples, so they can be compiled for batches.
"""

from math import sqrt
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.physics.quaternion import Vector, to_body

Motion = tuple[float, float, float, float, float, float, float, float, float, float]
"""(v_n, v_e, v_d [m/s], w, x, y, z, p, q, r [rad/s]): the state on which the derivative depends."""
Load = tuple[float, float, float, float, float, float, float]
"""(specific thrust [m/s^2], torque x, y, z [N m, FRD], wind n, e, d [m/s])."""

GRAVITY = 9.80665
"""Standard gravity, m/s^2, which autopilots assume; `RigidBody.gravity` may differ."""
NO_AXIS_DRAG = 0.0, 0.0, 0.0
"""Coefficients of a body that has no drag along its own axes."""


class RigidBody(NamedTuple):
    """Constants of the rigid body."""

    inertia_x: float  # kg m^2, about body x
    inertia_y: float  # kg m^2, about body y
    inertia_z: float  # kg m^2, about body z
    drag: float  # linear drag per mass, 1/s
    quadratic_drag: float  # per mass, 1/m
    axis_drag: Vector  # quadratic drag along each body axis, per mass, 1/m
    momentum_drag: Vector  # of the rotors at hover thrust, along each body axis, per mass, 1/s
    rotational_drag: float  # damping torque, N m per rad/s
    gravity: float  # m/s^2


def body_of(airframe: AirframeConfig) -> RigidBody:
    """Return the rigid body of an airframe."""
    return RigidBody(
        *airframe.inertia_kg_m2,
        drag=airframe.drag_n_s_per_m / airframe.mass_kg,
        quadratic_drag=airframe.quadratic_drag_n_s2_per_m2 / airframe.mass_kg,
        axis_drag=_per_mass(airframe.mass_kg, airframe.axis_drag_n_s2_per_m2),
        momentum_drag=_per_mass(airframe.mass_kg, airframe.momentum_drag_n_s_per_m),
        rotational_drag=airframe.rotational_drag_n_m_s,
        gravity=airframe.gravity_m_s2,
    )


def _per_mass(mass: float, along_axes: Vector) -> Vector:
    x, y, z = along_axes
    return x / mass, y / mass, z / mass


def derivative(motion: Motion, load: Load, body: RigidBody) -> Motion:
    """Return the time derivative of a motion (Newton, Euler, quaternion kinematics).

    v' = g - T z_body - (drag + quadratic |u|) u - f with u = v - wind, specific thrust T and drag
    per mass; f has the components (axis_drag_i |u_i| + momentum_drag_i sqrt(T / g)) u_i along the
    body axes. J w' = torque - damping w - w x J w and q' = q (0, w) / 2, with inertia J, body rates
    w and attitude q.
    """
    vn, ve, vd, w, x, y, z, p, q, r = motion
    thrust, torque_x, torque_y, torque_z, wind_n, wind_e, wind_d = load
    jx, jy, jz, drag, quadratic, axis, momentum, damping, gravity = body
    air_n, air_e, air_d = wind_n - vn, wind_e - ve, wind_d - vd
    if quadratic:
        drag += quadratic * sqrt(air_n * air_n + air_e * air_e + air_d * air_d)
    axis_drag_n = axis_drag_e = axis_drag_d = 0.0
    if axis != NO_AXIS_DRAG or momentum != NO_AXIS_DRAG:
        air_x, air_y, air_z = to_body((w, x, y, z), (air_n, air_e, air_d))
        inflow = sqrt(max(thrust, 0.0) / gravity)
        force = (
            (axis[0] * abs(air_x) + momentum[0] * inflow) * air_x,
            (axis[1] * abs(air_y) + momentum[1] * inflow) * air_y,
            (axis[2] * abs(air_z) + momentum[2] * inflow) * air_z,
        )
        axis_drag_n, axis_drag_e, axis_drag_d = to_body((w, -x, -y, -z), force)
    return (
        drag * air_n + axis_drag_n - 2.0 * thrust * (x * z + w * y),
        drag * air_e + axis_drag_e - 2.0 * thrust * (y * z - w * x),
        drag * air_d + axis_drag_d - thrust * (1.0 - 2.0 * (x * x + y * y)) + gravity,
        -0.5 * (x * p + y * q + z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
        (torque_x - damping * p - (jz - jy) * q * r) / jx,
        (torque_y - damping * q - (jx - jz) * r * p) / jy,
        (torque_z - damping * r - (jy - jx) * p * q) / jz,
    )


def _motion_after(motion: Motion, slope: Motion, dt: float) -> Motion:
    """Return the motion `dt` seconds later if its derivative were constant."""
    vn, ve, vd, w, x, y, z, p, q, r = motion
    a0, a1, a2, a3, a4, a5, a6, a7, a8, a9 = slope
    return (
        vn + dt * a0,
        ve + dt * a1,
        vd + dt * a2,
        w + dt * a3,
        x + dt * a4,
        y + dt * a5,
        z + dt * a6,
        p + dt * a7,
        q + dt * a8,
        r + dt * a9,
    )


def advance(motion: Motion, load: Load, body: RigidBody, dt: float) -> tuple[Motion, Vector]:
    """Integrate one step of `dt` seconds under a constant load (classical Runge-Kutta).

    Returns:
        The new motion with a normalised quaternion, and the displacement (NED, m). The derivative
        does not depend on the position, so the position's stages reduce to
        v dt + (k1 + k2 + k3) dt^2 / 6.
    """
    k1 = derivative(motion, load, body)
    k2 = derivative(_motion_after(motion, k1, 0.5 * dt), load, body)
    k3 = derivative(_motion_after(motion, k2, 0.5 * dt), load, body)
    k4 = derivative(_motion_after(motion, k3, dt), load, body)
    vn, ve, vd, w, x, y, z, p, q, r = motion
    a0, a1, a2, a3, a4, a5, a6, a7, a8, a9 = k1
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9 = k2
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = k3
    d0, d1, d2, d3, d4, d5, d6, d7, d8, d9 = k4
    sixth_dt = dt / 6.0
    displacement = (
        dt * (vn + sixth_dt * (a0 + b0 + c0)),
        dt * (ve + sixth_dt * (a1 + b1 + c1)),
        dt * (vd + sixth_dt * (a2 + b2 + c2)),
    )
    w += sixth_dt * (a3 + 2.0 * (b3 + c3) + d3)
    x += sixth_dt * (a4 + 2.0 * (b4 + c4) + d4)
    y += sixth_dt * (a5 + 2.0 * (b5 + c5) + d5)
    z += sixth_dt * (a6 + 2.0 * (b6 + c6) + d6)
    # The norm drifts by less than 1e-9 a step, so one Newton step of 1/sqrt is exact enough.
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    new_motion = (
        vn + sixth_dt * (a0 + 2.0 * (b0 + c0) + d0),
        ve + sixth_dt * (a1 + 2.0 * (b1 + c1) + d1),
        vd + sixth_dt * (a2 + 2.0 * (b2 + c2) + d2),
        w * scale,
        x * scale,
        y * scale,
        z * scale,
        p + sixth_dt * (a7 + 2.0 * (b7 + c7) + d7),
        q + sixth_dt * (a8 + 2.0 * (b8 + c8) + d8),
        r + sixth_dt * (a9 + 2.0 * (b9 + c9) + d9),
    )
    return new_motion, displacement
