"""Positions that come late, twice or standing are not flown as if they were of now."""

import numpy as np
import pytest

from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When
from tests.flight.position_relay import PositionRelay

CIRCLE = {"flight": {"maneuvers": ["circle"]}, "circle": {"radius_m": 1.5}}


def flown(folder, way, delay_ms=0, *, from_the_start=False, **changes):
    """Summary and truth of a flight in whose maneuver positions begin to come so."""
    with mock_vehicle() as mock:
        relay = PositionRelay(mock)

        def begin():
            relay.way, relay.delay_ms = way, delay_ms

        if from_the_start:
            begin()
        summary = fly(mock, folder, When("maneuvers", begin, after=1.0), **changes)
        return summary, mock.state()


def test_positions_that_come_late_end_control():
    summary, truth = flown(None, "late", 400)
    assert summary.result == "positions arrive, but older than deadman.position_stale_ms"
    assert (truth["mode"], truth["crashed"]) == ("LOITER", False)


def test_a_standing_position_is_silence():
    summary, truth = flown(None, "standing")
    assert summary.result == "no position from the vehicle"
    assert summary.link["outdated"] > 10
    assert (truth["mode"], truth["crashed"]) == ("LOITER", False)


@pytest.mark.parametrize(
    "delay_ms", [100, *(pytest.param(delay, marks=pytest.mark.slow) for delay in (2000, 8000))]
)
def test_late_copies_of_positions_change_nothing(delay_ms):
    way = {"from_the_start": True, **CIRCLE}
    plain, _ = flown(None, "at once", **way)
    copied, _ = flown(None, "twice", delay_ms, **way)
    assert copied.result == "ok", copied.events
    assert copied.link["outdated"] > 100
    assert plain.link["outdated"] == 0
    tracked = [s.trace.tracking.rows() for s in (plain, copied)]
    np.testing.assert_array_equal(*tracked)


def test_positions_a_little_late_are_carried_on_to_now(tmp_path):
    summary, _ = flown(tmp_path, "late", 200, **CIRCLE)
    assert summary.result == "ok", summary.events
    time, north, east = summary.trace.tracking.rows()[:, :3].T
    told = tlog.messages(summary, "LOCAL_POSITION_NED")
    stamps, x, y = np.array([(m.time_boot_ms / 1e3, m.x, m.y) for m in told]).T
    off = np.hypot(np.interp(time, stamps, x) - north, np.interp(time, stamps, y) - east)
    assert off.max() < 0.1  # the circle's speed is 1 m/s and more
