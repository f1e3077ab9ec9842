"""The laws of the paper again, written from its text on SciPy rotations: the judge of the planners.

Stacks of N attitudes (body → world), coefficients (N, 2) and body rates (N, 3) in rad/s; nothing of
`companion` is used.
"""

import numpy as np
from scipy.spatial.transform import Rotation


def coefficients_of(r):
    """North and east of the thrust direction, −body z in the world (equation 10)."""
    return -r.as_matrix()[..., :2, 2]


def path_of(seen):
    """Coefficients (S, N, 2) of S stacks of N attitudes."""
    whole = Rotation.from_quat(np.concatenate([r.as_quat() for r in seen]))
    return coefficients_of(whole).reshape(len(seen), -1, 2)


def headings_of(r):
    """Tilt-yaw heading: the twist about body z, 2·atan2(z, w)."""
    q = r.as_quat()
    return wrapped(2.0 * np.arctan2(q[..., 2], q[..., 3]))


def wrapped(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def attitudes(c, headings):
    """The upright attitudes with coefficients (2,) or (N, 2) and tilt-yaw headings (N,)."""
    headings = np.atleast_1d(headings)
    north, east = np.broadcast_to(np.asarray(c, dtype=float), (len(headings), 2)).T
    sine = np.hypot(north, east)
    tilt = np.where(sine > 0.0, np.arcsin(sine) / np.where(sine > 0.0, sine, 1.0), 1.0)
    level = np.zeros(len(headings))
    return Rotation.from_rotvec(
        np.column_stack([tilt * east, -tilt * north, level])
    ) * Rotation.from_rotvec(np.column_stack([level, level, headings]))


def multiplied(p, q):
    """p ⊗ q of quaternions (..., 4) in the order x, y, z, w, as SciPy has them."""
    (a, b, c, d), (x, y, z, w) = ([each[..., k] for k in range(4)] for each in (p, q))
    product = np.empty_like(p)
    product[..., 0] = d * x + a * w + b * z - c * y
    product[..., 1] = d * y - a * z + b * w + c * x
    product[..., 2] = d * z + a * y - b * x + c * w
    product[..., 3] = d * w - a * x - b * y - c * z
    return product


def quaternion(r, goal, gain, tilt_rate=np.inf, yaw_rate=np.inf):
    """2p·vec(q⁻¹ ⊗ q_d), the short way round."""
    error = (r.inv() * goal).as_quat(canonical=True)
    return limited(2.0 * gain * error[:, :3], tilt_rate, yaw_rate)


def so3(r, goal, gain, tilt_rate=np.inf, yaw_rate=np.inf):
    """p·Log(q⁻¹ ⊗ q_d)."""
    return limited(gain * (r.inv() * goal).as_rotvec(), tilt_rate, yaw_rate)


def euler(r, goal, gain, tilt_rate=np.inf, yaw_rate=np.inf):
    """p times the errors of yaw, pitch and roll, each about the axis that its own turn has."""
    angles = r.as_euler("ZYX")
    yaw, pitch, roll = (gain * wrapped(goal.as_euler("ZYX") - angles)).T
    rolled_back = Rotation.from_euler("X", angles[:, 2:]).inv()
    pitched_back = Rotation.from_euler("Y", angles[:, 1:2]).inv()
    rates = np.outer(roll, [1.0, 0.0, 0.0])
    rates += rolled_back.apply(np.outer(pitch, [0.0, 1.0, 0.0]))
    rates += (rolled_back * pitched_back).apply(np.outer(yaw, [0.0, 0.0, 1.0]))
    return limited(rates, tilt_rate, yaw_rate)


def limited(rates, tilt_rate, yaw_rate):
    """Roll and pitch scaled together to `tilt_rate`, yaw clipped."""
    scale = np.maximum(1.0, np.hypot(rates[:, 0], rates[:, 1]) / tilt_rate)
    return np.column_stack(
        [rates[:, :2] / scale[:, None], np.clip(rates[:, 2], -yaw_rate, yaw_rate)]
    )


def first_order(r, goal, gain, tilt_rate=np.inf, yaw_rate=np.inf, max_speed=np.inf, yaw_gain=2.0):
    """The body rates under which ċ = p·(c_d − c), within the limits: the kinematics, solved.

    With m the rotation matrix, c = −m·(0, 0, 1) gives ċ = ω_x·m₁ − ω_y·m₀, and the heading turns by
    ω_z + [(zx − wy)·ω_x + (wx + zy)·ω_y]/(w² + z²), from q̇ = q ⊗ (0, ω)/2.
    """
    m = r.as_matrix()
    x, y, z, w = r.as_quat().T
    square = w * w + z * z
    system = np.zeros((len(m), 3, 3))
    system[:, :2, 0] = m[:, :2, 1]
    system[:, :2, 1] = -m[:, :2, 0]
    system[:, 2, 0] = (z * x - w * y) / square
    system[:, 2, 1] = (w * x + z * y) / square
    system[:, 2, 2] = 1.0
    speed = gain * (coefficients_of(goal) - coefficients_of(r))
    turn = yaw_gain * wrapped(headings_of(goal) - headings_of(r))
    wish = np.linalg.solve(system, np.column_stack([speed, turn])[..., None])[:, :2, 0]
    excess = np.maximum(np.hypot(*wish.T) / tilt_rate, np.hypot(*speed.T) / max_speed)
    speed /= np.maximum(1.0, excess)[:, None]
    rates = np.linalg.solve(system, np.column_stack([speed, turn])[..., None])[..., 0]
    return np.column_stack([rates[:, :2], np.clip(rates[:, 2], -yaw_rate, yaw_rate)])


LAWS = {"first-order": first_order, "quaternion": quaternion, "so3": so3, "euler": euler}


def exact(r, goal, gain, dt, yaw_gain=2.0):
    """The rate that, held for `dt`, leads to c_d + (c − c_d)·e^(−p·dt) and to the heading asked."""
    c, c_d = coefficients_of(r), coefficients_of(goal)
    psi = headings_of(r)
    turn = (1.0 - np.exp(-yaw_gain * dt)) * wrapped(headings_of(goal) - psi)
    return rate_between(r, attitudes(c_d + (c - c_d) * np.exp(-gain * dt), psi + turn), dt)


def rate_between(r, then, dt):
    """The one body rate that leads from `r` to `then` in `dt` seconds."""
    return (r.inv() * then).as_rotvec() / dt


def held(r, rates, dt):
    """The attitudes after body rates were held for `dt` seconds."""
    return r * Rotation.from_rotvec(np.asarray(rates) * dt)


def sampled(law, start, seconds, dt):
    """Discrete time, rates held over each sample: coefficients (S + 1, N, 2), rates (S, N, 3)."""
    seen, rates = [start], []
    for _ in range(round(seconds / dt)):
        rates.append(law(seen[-1]))
        seen.append(held(seen[-1], rates[-1], dt))
    return path_of(seen), np.array(rates)


def continuous(law, start, seconds, step):
    """Continuous time, q̇ = q ⊗ (0, ω(q))/2 by the classic fourth order method: coefficients."""

    def slope(q):
        r = Rotation.from_quat(q)
        (x, y, z, w), (i, j, k) = r.as_quat().T, law(r).T
        return 0.5 * np.column_stack(
            [
                w * i + y * k - z * j,
                w * j + z * i - x * k,
                w * k + x * j - y * i,
                -x * i - y * j - z * k,
            ]
        )

    q, path = start.as_quat(), [start]
    for _ in range(round(seconds / step)):
        first = slope(q)
        second = slope(q + 0.5 * step * first)
        third = slope(q + 0.5 * step * second)
        fourth = slope(q + step * third)
        q = q + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        path.append(Rotation.from_quat(q))
    return path_of(path)
