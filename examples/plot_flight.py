"""Plot what a flight recorded: the position beside its reference, and the tracking error.

`companion plot FOLDER` draws more. Begin here for a figure of your own: each CSV file of a flight
names its columns and is in vehicle time. Needs the extra `plot`.

Run: python examples/plot_flight.py [FOLDER]   (writes flight.png)
"""

import matplotlib as mpl
import numpy as np
from recorded import flight

mpl.use("Agg")
from matplotlib import pyplot as plt

folder = flight()
rows = np.genfromtxt(folder / "tracking.csv", delimiter=",", names=True)
time = rows["vehicle_time_s"] - rows["vehicle_time_s"][0]
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
errors = []
for axis, colour in zip(("north", "east", "down"), ("#0072b2", "#d55e00", "#009e73"), strict=True):
    reference, measured = rows[f"reference_{axis}_m"], rows[f"measured_{axis}_m"]
    above.plot(time, reference, "--", color=colour, linewidth=1)
    above.plot(time, measured, color=colour, label=axis)
    errors.append(measured - reference)  # NaN where open-loop steps have no reference
error = np.linalg.norm(errors, axis=0)
below.plot(time, error, color="black")
above.set(ylabel="position, m (dashed: reference)", title=folder.name)
below.set(ylabel="error, m", xlabel="time, s")
above.legend()
figure.savefig("flight.png", dpi=120)
print(f"flight.png: {folder}, largest error {np.nanmax(error):.3f} m")
