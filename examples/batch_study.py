"""Compare planners without memory at all headings at once: how straight does a step run?

72 vehicles, each at another heading, fly the step of the paper's figure 2. A linear response
moves the acceleration coefficients on a straight line. The program prints the largest distance from
this line, at the best and at the worst heading. numba (extra `study`) compiles large batches.

Run: python examples/batch_study.py
"""

from math import pi, radians

import numpy as np

from companion import batch
from companion.attitude import LAW_NAMES, Coefficients, Limits, attitude, make_planner

START, END = Coefficients(-0.4, -0.5), Coefficients(0.4, -0.5)
HEADINGS = [k * pi / 36.0 for k in range(72)]
limits = Limits(max_tilt=radians(45.0), max_tilt_rate=radians(400.0))

starts = np.array([attitude(START, heading) for heading in HEADINGS]).T  # (4, 72)
targets = np.array([(*END, heading, 0.0) for heading in HEADINGS]).T  # (4, 72)
for name in LAW_NAMES:
    planner = make_planner(name, gain=5.0, limits=limits)
    history = batch.simulate(planner, starts, targets, dt=0.004, steps=400)
    c = batch.coefficients(history.q)  # (401, 2, 72)
    # The line runs from south to north, so the distance from it is in the east coefficient.
    distance = np.abs(c[:, 1] - END.east).max(axis=0)
    print(f"{name:<12} {distance.min():.4f} to {distance.max():.4f}")
