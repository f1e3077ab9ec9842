"""Make a path in NumPy, write it as a CSV file, and fly it on the mock vehicle.

Columns t, x, y, z in s and m. By default x is east, y north and z up (ENU); docs/trajectories.md
says how to change that. The path begins wherever the vehicle is. On the command line the same is
`companion demo --trajectory heart.csv --slow-down`.

Run: python examples/fly_csv.py   (writes heart.csv)
"""

import numpy as np

from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly

DURATION = 20.0  # s
t = np.linspace(0.0, DURATION, 401)
share = t / DURATION
phase = 2.0 * np.pi * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))  # from rest to rest
east = 4.0 * np.sin(phase) ** 3
north = 0.25 * (13 * np.cos(phase) - 5 * np.cos(2 * phase) - 2 * np.cos(3 * phase))
table = np.column_stack([t, east, north, np.zeros_like(t)])
np.savetxt("heart.csv", table, delimiter=",", header="t,x,y,z", comments="", fmt="%.6f")

path = {"maneuvers": ["trajectory"], "trajectory": "heart.csv", "slow_down": True}
config = changed(load(shipped("mock-px4.yaml")), {"flight": path}, "the heart")
summary = fly(config, MockVehicle("px4"))
off = summary.tracking()["position_rms_m"]
print(f"result: {summary.result}, {off:.3f} m off the path (RMS)")
