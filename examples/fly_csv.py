"""Make a path in NumPy, write it as a CSV file, and fly it on the mock vehicle.

Columns t, x, y, z in s and m. By default x is east, y north and z up (ENU); a YAML file with the
shape `csv` says otherwise (docs/trajectories.md). The path begins wherever the vehicle is.

Run: python examples/fly_csv.py   (writes heart.csv and a folder under `flights`)
"""

import json
import subprocess
import sys

import numpy as np

DURATION = 20.0  # s
t = np.linspace(0.0, DURATION, 401)
share = t / DURATION
phase = 2.0 * np.pi * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))  # from rest to rest
east = 0.25 * 16.0 * np.sin(phase) ** 3
north = 0.25 * (
    13.0 * np.cos(phase) - 5.0 * np.cos(2 * phase) - 2.0 * np.cos(3 * phase) - np.cos(4 * phase)
)
table = np.column_stack([t, east, north, np.zeros_like(t)])
np.savetxt("heart.csv", table, delimiter=",", header="t,x,y,z", comments="", fmt="%.6f")

command = [sys.executable, "-m", "companion", "demo", "--lockstep", "--json"]
flown = subprocess.run(
    [*command, "--trajectory", "heart.csv", "--slow-down"],
    stdout=subprocess.PIPE,  # the last line is JSON; what happens is told on standard error
    text=True,
    check=True,
)
summary = json.loads(flown.stdout.splitlines()[-1])
print(f"result: {summary['result']}, recorded in {summary['log']}")
print(f"tracking: {summary['tracking']['position_rms_m']:.3f} m RMS")
