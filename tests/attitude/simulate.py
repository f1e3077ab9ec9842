"""Ideal kinematics for the planners: SciPy rotations driven by their body rates."""

import numpy as np
from scipy.spatial.transform import Rotation

from companion.attitude import Coefficients, Quaternion, Target
from companion.attitude.planner import Planner
from tests.attitude.independent import attitudes, coefficients_of, held, sampled


def rotation(q: Quaternion) -> Rotation:
    return Rotation.from_quat([q[1], q[2], q[3], q[0]])


def quaternion(r: Rotation) -> Quaternion:
    x, y, z, w = r.as_quat()
    return (float(w), float(x), float(y), float(z))


def tilt_of(r: Rotation) -> float:
    return float(np.arccos(np.clip(r.as_matrix()[2, 2], -1.0, 1.0)))


def upright(c: Coefficients, heading: float) -> Rotation:
    """The attitude with these coefficients and tilt-yaw heading."""
    return attitudes(c, heading)[0]


def answers(planner: Planner, r: Rotation, targets: list[Target], dt: float) -> np.ndarray:
    """The planner's rates (N, 3) for a stack of N attitudes, each with its own target."""
    q = r.as_quat(scalar_first=True).tolist()
    return np.array([planner.rates(q_i, t, dt) for q_i, t in zip(q, targets, strict=True)])


def fly_all(
    planner: Planner, start: Rotation, targets: list[Target], seconds: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """N flights, rates held over each sample: coefficients (S + 1, N, 2), rates (S, N, 3)."""
    return sampled(lambda r: answers(planner, r, targets, dt), start, seconds, dt)


def fly(
    planner: Planner, start: Rotation, target: Target, seconds: float, dt: float
) -> tuple[np.ndarray, np.ndarray, Rotation]:
    """One flight: (coefficients, rates, last attitude)."""
    seen, rates = [start], []
    for _ in range(round(seconds / dt)):
        rates.append(planner.rates(quaternion(seen[-1]), target, dt))
        seen.append(held(seen[-1], rates[-1], dt))
    path = coefficients_of(Rotation.from_quat([r.as_quat() for r in seen]))
    return path, np.array(rates), seen[-1]
