"""What is kept of a flight."""

import pytest

from companion.recording.measurements.verdict import LOST_ROWS
from companion.recording.trace import FlightTrace

ROWS = [
    (1.0, 8.0, 0.1, 0.2, 0.3, 0.5, -0.1, -0.2, -0.3, 0.003),
    (1.1, 8.2, 1.0, 2.0, 3.0, 0.6, 4, 5, 6, 0.004),
]


def noted(rows=ROWS):
    trace = FlightTrace()
    for row in rows:
        trace.rates.add(list(row))
    return trace


def test_rows_can_be_had_from_one_on():
    assert noted().rates.rows().tolist() == [list(map(float, row)) for row in ROWS]
    assert noted().rates.rows(1).tolist() == [list(map(float, ROWS[1]))]
    assert noted().rates.rows(2).shape == (0, 10)


@pytest.mark.parametrize("name", ["response", "tracking", "rates", "latencies_ns", "motion"])
def test_lost_rows_of_each_kind_are_told(name):
    trace = FlightTrace()
    assert trace.lost_rows_warning() is None
    getattr(trace, name).lost_count = 8
    assert trace.lost_rows_warning() == f"8 {LOST_ROWS}: the disk was too slow"
