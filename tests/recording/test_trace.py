"""What is kept of a flight."""

import pytest

from companion.recording.measurements.verdict import LOST_ROWS
from companion.recording.trace import FlightTrace


@pytest.mark.parametrize("name", ["response", "tracking", "rates", "latencies_ns", "motion"])
def test_lost_rows_of_each_kind_are_told(name):
    trace = FlightTrace()
    assert trace.lost_rows_warning() is None
    getattr(trace, name).lost_count = 8
    assert trace.lost_rows_warning() == f"8 {LOST_ROWS}: the disk was too slow"
