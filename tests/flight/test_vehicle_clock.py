"""Whole flights with a clock that jumps, restarts or wraps, and with telemetry that is late."""

import json

import pytest

from tests.flight.clock_relay import ClockRelay
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}
WRAP_MS = 2**32


def flown(autopilot, begin):
    """A flight in whose maneuver the vehicle's stamps change; its summary and the true state."""
    with mock_vehicle(autopilot=autopilot, in_lockstep=True) as mock:
        relay = ClockRelay(mock)
        observer = When("maneuvers", lambda: begin(relay), after=1.0)
        summary = fly(mock, None, observer)
        return summary, mock.state()


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("shift_ms", "words"),
    [
        (3_600_000, "the vehicle's clock jumped ahead by 3600.00 s"),
        (120, "the vehicle's clock jumped ahead by 0.12 s"),
    ],
)
def test_a_clock_that_jumps_in_flight_is_handed_back(autopilot, shift_ms, words):
    def begin(relay):
        relay.shift_ms = shift_ms

    summary, truth = flown(autopilot, begin)
    assert summary.result == words
    assert (truth["mode"], truth["crashed"]) == (HELD[autopilot], False)


def wrapping(autopilot, seconds, **changes):
    """A flight whose time since boot wraps so long after its begin."""
    with mock_vehicle(autopilot=autopilot, in_lockstep=True) as mock:
        ClockRelay(mock).shift_ms = WRAP_MS - round(1000 * seconds)
        return fly(mock, **changes), mock.state()


WRAPPED = "the vehicle's time since boot wrapped around after 49.7 days"


@pytest.mark.parametrize(("autopilot", "seconds"), [("px4", 8.0), ("ardupilot", 11.0)])
def test_time_that_wraps_in_flight_is_named_and_handed_back(autopilot, seconds):
    summary, truth = wrapping(autopilot, seconds)
    assert summary.result == WRAPPED, summary.events
    assert (truth["mode"], truth["crashed"]) == (HELD[autopilot], False)


def test_time_that_wraps_before_control_is_named_and_flown_on():
    summary, _ = wrapping("px4", 3.0, hover={"duration_s": 0.5})
    assert summary.result == "ok", summary.events
    assert WRAPPED in [text for _, text in summary.events]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_one_sample_stamped_far_ahead_is_dropped_named_and_flown_on(autopilot):
    def begin(relay):
        relay.outlier_ms = 3_600_000

    summary, _ = flown(autopilot, begin)
    assert summary.result == "ok", summary.events
    counted = json.loads(summary.as_json())["unanswered"]
    assert (counted["stamped_ahead"], sum(counted.values())) == (1, 1)
    assert any("3600.0 s ahead of the vehicle's clock was dropped" in t for _, t in summary.events)


def test_telemetry_that_is_late_from_the_start_is_refused_where_timesync_tells_it():
    with mock_vehicle() as mock:
        ClockRelay(mock).late_ms = 400
        summary = fly(mock)
    assert "old when it arrives, more than deadman.telemetry_stale_ms" in summary.result
    assert summary.counts.setpoints == 0
