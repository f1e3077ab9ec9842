"""Use the control law in your own loop: a rigid body in NumPy, no autopilot, no MAVLink.

The planner gets an attitude and a target, and returns body rates. The vehicle follows the rates
with a lag of 20 ms. The program prints the acceleration coefficients (horizontal acceleration per
specific thrust) during the step, beside the first-order model that they should follow.

Run: python examples/law_in_a_loop.py
"""

from math import exp, radians

import numpy as np

from companion.attitude import Limits, Target, coefficients, make_planner

GAIN, DT, LAG = 5.0, 0.004, 0.02  # 1/s, s, s
planner = make_planner("first-order", gain=GAIN, limits=Limits(max_tilt=radians(35.0)))
target = Target(north=0.3, east=-0.2, heading=radians(90.0))


def rotated(q: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """The attitude (w, x, y, z) after `DT` s at the body rates `omega`, rad/s (FRD)."""
    w, x, y, z = q
    matrix = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    q = q + 0.5 * DT * matrix @ omega
    return q / np.linalg.norm(q)


q, omega = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)  # level, at rest, nose to the north
for k in range(301):
    if k % 50 == 0:
        north, east = coefficients(tuple(q))
        ideal = 1.0 - exp(-GAIN * k * DT)
        print(
            f"{k * DT:.1f} s: north {north:+z.3f} (model {ideal * target.north:+z.3f}),"
            f" east {east:+z.3f} (model {ideal * target.east:+z.3f})"
        )
    wanted = np.array(planner.rates(tuple(q), target, DT))
    omega += (wanted - omega) * (1.0 - exp(-DT / LAG))
    q = rotated(q, omega)
