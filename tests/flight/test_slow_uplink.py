"""The way to the vehicle becomes slow or lossy in flight, while all telemetry comes in time."""

from math import acos, degrees, hypot

import pytest

from companion.vehicle.link import Link
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}
WIND = {"speed_m_s": 3.0, "gust_m_s": 1.0}
HOVER = {"flight": {"takeoff_height_m": 4.0}, "hover": {"duration_s": 12.0}}


class Extent:
    """Largest tilt, deg, and lowest height, m, from `begin` on."""

    def __init__(self, mock):
        self.mock, self.tilt, self.lowest = mock, 0.0, 100.0

    def begin(self):
        self.mock.after_step.append(self.take)

    def take(self):
        state = self.mock.state()
        _, x, y, _ = state["q"]
        self.tilt = max(self.tilt, degrees(acos(1.0 - 2.0 * (x * x + y * y))))
        self.lowest = min(self.lowest, -state["position"][2])


def flown(autopilot, kind, hover_s=12.0, **fault):
    """A hover in wind whose uplink has the fault from its first second on."""
    hover = {"hover": {"duration_s": hover_s}}
    with mock_vehicle(autopilot=autopilot, wind=WIND) as mock:
        extent = Extent(mock)

        def begin():
            extent.begin()
            mock.inject({"kind": kind, "direction": "from_companion", **fault})

        summary = fly(mock, None, When("maneuvers", begin, after=1.0), **HOVER | hover)
        return summary, mock.state(), extent


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(("delay_ms", "most_deg"), [(200.0, 55.0), (300.0, 55.0), (700.0, 65.0)])
def test_setpoints_that_become_late_end_control_before_the_vehicle_swings_far(
    autopilot, delay_ms, most_deg
):
    summary, truth, extent = flown(autopilot, "delay", delay_ms=delay_ms)
    assert "setpoints reach the vehicle too late" in summary.result, summary.events
    assert (truth["mode"], truth["crashed"]) == (HELD[autopilot], False)
    assert extent.tilt < most_deg
    assert extent.lowest > 3.0


def test_a_hiccup_of_the_uplink_is_flown_on():
    summary, _, _ = flown("px4", "delay", 5.0, delay_ms=300.0, duration_s=0.4)
    assert summary.result == "ok", summary.events


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    "fault",
    [
        {"kind": "delay", "delay_ms": 1500.0},
        {"kind": "delay", "delay_ms": 3000.0},
        {"kind": "drop", "probability": 0.9},
        {"kind": "drop", "probability": 0.95},
    ],
    ids=["late by 1.5 s", "late by 3 s", "nine of ten lost", "95 % lost"],
)
def test_setpoints_that_do_not_reach_the_vehicle_end_control(autopilot, fault):
    summary, truth, extent = flown(autopilot, **fault)
    assert "setpoints do not reach the vehicle" in summary.result, summary.events
    assert not truth["crashed"]
    assert extent.lowest > 2.0
    assert truth["mode"] in (HELD[autopilot], "RTL")  # RTL is PX4's answer to lost setpoints


def test_a_way_that_loses_three_of_ten_setpoints_is_flown_on():
    summary, _, _ = flown("ardupilot", "drop", probability=0.3)
    assert summary.result == "ok", summary.events


def test_an_autopilot_that_answers_no_timesync_in_flight_is_flown_on(monkeypatch):
    asked = []
    link_of = Link.__init__

    def deaf(link, *arguments, **options):
        link_of(link, *arguments, **options)
        link.timesync.probe = lambda: asked.append(link)

    monkeypatch.setattr(Link, "__init__", deaf)
    with mock_vehicle() as mock:
        summary = fly(mock)
    assert summary.result == "ok", summary.events
    assert len(asked) > 50


def test_one_setpoint_without_turning_is_the_last():
    with mock_vehicle(wind=WIND) as mock:
        late = {"kind": "delay", "direction": "from_companion", "delay_ms": 300.0}
        observer = When("maneuvers", lambda: mock.inject(late), after=1.0)
        summary = fly(mock, None, observer, **HOVER)
    assert "too late" in summary.result
    assert hypot(*mock.setpoints[-1].rates) == 0.0
    assert hypot(*mock.setpoints[-2].rates) > 0.0
