"""What is kept of a flight, and what of it becomes a file."""

import numpy as np

from companion.attitude import BodyRates
from companion.recording.trace import FlightTrace

ROWS = [
    (1.0, 8.0, 0.1, 0.2, 0.3, 0.5, -0.1, -0.2, -0.3, 0.003),
    (1.1, 8.2, 1.0, 2.0, 3.0, 0.6, 4, 5, 6, 0.004),
]


def noted(rows=ROWS):
    trace = FlightTrace()
    for time, received, *commanded, thrust, roll, pitch, yaw, age in rows:
        measured = BodyRates(roll, pitch, yaw)
        trace.add_rates(time, received, BodyRates(*commanded), thrust, measured, age)
    return trace


def test_rates_are_saved_with_their_names(tmp_path):
    noted().save(tmp_path)
    saved = np.genfromtxt(tmp_path / "rates.csv", delimiter=",", names=True)
    assert saved["vehicle_time_s"].tolist() == [1.0, 1.1]
    assert saved["received_s"].tolist() == [8.0, 8.2]
    assert saved["commanded_pitch_rad_s"].tolist() == [0.2, 2.0]
    assert saved["thrust"].tolist() == [0.5, 0.6]
    assert saved["measured_yaw_rad_s"].tolist() == [-0.3, 6.0]
    assert saved["age_s"].tolist() == [0.003, 0.004]
    assert [path.name for path in tmp_path.iterdir()] == ["rates.csv"]


def test_rows_can_be_had_from_one_on():
    assert noted().rates_rows().tolist() == [list(map(float, row)) for row in ROWS]
    assert noted().rates_rows(1).tolist() == [list(map(float, ROWS[1]))]
    assert noted().rates_rows(2).shape == (0, 10)
