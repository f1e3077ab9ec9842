"""An independent judge of the planners: SciPy rotations driven by body rates, no shared maths."""

import numpy as np
from scipy.spatial.transform import Rotation

from companion.attitude import Coefficients, Quaternion, Target
from companion.attitude.planner import Planner


def rotation(q: Quaternion) -> Rotation:
    return Rotation.from_quat([q[1], q[2], q[3], q[0]])


def quaternion(r: Rotation) -> Quaternion:
    x, y, z, w = r.as_quat()
    return (float(w), float(x), float(y), float(z))


def coefficients_of(r: Rotation) -> np.ndarray:
    """Horizontal part of the thrust direction (−body z seen from the world)."""
    return -r.as_matrix()[:2, 2]


def tilt_of(r: Rotation) -> float:
    return float(np.arccos(np.clip(r.as_matrix()[2, 2], -1.0, 1.0)))


def upright(c: Coefficients, heading: float) -> Rotation:
    """The attitude with these coefficients and tilt-yaw heading, built from a rotation vector."""
    sine = float(np.hypot(*c))
    axis = np.array([c.east, -c.north, 0.0]) / sine if sine > 0 else np.zeros(3)
    tilt = Rotation.from_rotvec(np.arcsin(sine) * axis)
    return tilt * Rotation.from_rotvec([0.0, 0.0, heading])


def fly(
    planner: Planner, start: Rotation, target: Target, seconds: float, dt: float
) -> tuple[np.ndarray, np.ndarray, Rotation]:
    """Ideal kinematics, rates held over each sample: (coefficients, rates, last attitude)."""
    r = start
    path, rates = [coefficients_of(r)], []
    for _ in range(round(seconds / dt)):
        w = planner.rates(quaternion(r), target, dt)
        r = r * Rotation.from_rotvec(np.array(w) * dt)
        path.append(coefficients_of(r))
        rates.append(w)
    return np.array(path), np.array(rates), r
