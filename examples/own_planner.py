"""Write a control law of your own, and compare it with the paper's.

This law rotates the thrust axis the shortest way to the target, and does not control the heading.
A law is arithmetic on plain floats, so the same function flies one vehicle or a batch.
docs/extending.md says how a law gets a name and flies a vehicle.

Run: python examples/own_planner.py
"""

from math import sqrt

import numpy as np

from companion import attitude, batch
from companion.attitude import Constants, Quaternion, Target, limit_rates, make_planner

START, END = attitude.Coefficients(-0.4, -0.5), attitude.Coefficients(0.4, -0.5)
q = np.reshape(attitude.attitude(START, heading=0.0), (4, 1))  # one vehicle
targets = np.reshape((*END, 0.0, 0.0), (4, 1))


def thrust_axis(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates (rad/s, FRD) in proportion to the error of the thrust axis, seen from the body."""
    (w, x, y, z), (n, e, _, _) = q, target
    d = -sqrt(1.0 - n * n - e * e)  # (n, e, d) is the wanted axis in NED, a unit vector
    forward = (1 - 2 * (y * y + z * z)) * n + 2 * (x * y + w * z) * e + 2 * (x * z - w * y) * d
    right = 2 * (x * y - w * z) * n + (1 - 2 * (x * x + z * z)) * e + 2 * (y * z + w * x) * d
    roll, pitch = constants.gain * right, -constants.gain * forward
    return limit_rates(roll, pitch, 0.0, constants.max_tilt_rate, constants.max_yaw_rate)


for name, law in {"first-order": "first-order", "thrust-axis": thrust_axis}.items():
    history = batch.simulate(make_planner(law, gain=5.0), q, targets, dt=0.002, steps=500)
    c = batch.coefficients(history.q)[:, :, 0]  # (501, 2)
    off, left = np.abs(c[:, 1] - END.east).max(), np.hypot(*(c[-1] - END))
    print(f"{name}: leaves the straight line by {off:.4f}; {left:.4f} remain after 1 s")
