"""A point mass with drag under a turning thrust, written on SciPy rotations: the judge."""

import numpy as np
from scipy.spatial.transform import Rotation

from companion.drag import Drag
from companion.nmpc.model import Motion

GRAVITY, DRAG = 9.80665, Drag(0.8, 0.1)
WIND = np.array([0.4, -0.3, 0.2])


def acceleration(r, thrust, velocity):
    """NED, of an attitude (body → world); thrust pushes along −body z."""
    share = DRAG.linear + DRAG.quadratic * np.linalg.norm(velocity)
    lift = thrust * r.apply([0.0, 0.0, 1.0])
    return [0.0, 0.0, GRAVITY] - lift - share * np.asarray(velocity) + WIND


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
