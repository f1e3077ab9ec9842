"""Plot what a flight recorded: the position beside its reference, and the tracking error.

`companion plot FOLDER` draws more. For your own figure, start from this program: `read_flight`
returns each channel of a flight as a NumPy array with named columns. Needs the extra `plot`.

Run: python examples/plot_flight.py [FOLDER]   (writes flight.png)
"""

import matplotlib as mpl
import numpy as np
from recorded import flight_folder

from companion.recording.flight_record import read_flight

mpl.use("Agg")
from matplotlib import pyplot as plt

folder = flight_folder()
rows = read_flight(folder).rows("guidance")
rows = rows[rows["offboard_active"] == 1]
time = rows["vehicle_time_s"] - rows["vehicle_time_s"][0]
figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
errors = []
for axis, colour in zip(("north", "east", "down"), ("#0072b2", "#d55e00", "#009e73"), strict=True):
    reference, measured = rows[f"reference_{axis}_m"], rows[f"estimated_{axis}_m"]
    above.plot(time, reference, "--", color=colour, linewidth=1)
    above.plot(time, measured, color=colour, label=axis)
    held = rows["holds_height" if axis == "down" else "holds_position"] == 1
    errors.append(np.where(held, measured - reference, np.nan))  # open-loop steps have none
error = np.linalg.norm(errors, axis=0)
below.plot(time, error, color="black")
above.set(ylabel="position, m (dashed: reference)", title=folder.name)
below.set(ylabel="error, m", xlabel="time, s")
above.legend()
figure.savefig("flight.png", dpi=120)
print(f"flight.png: {folder}, largest error {np.nanmax(error):.3f} m")
