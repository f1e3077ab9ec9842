"""Height has priority: no more tilt is asked for than the thrust holds the height at."""

from math import cos, radians
from types import SimpleNamespace

import numpy as np
import pytest

from companion.config import Config
from companion.files.yaml_file import ConfigError, parse
from companion.flight.control_phases import _TiltMargin
from companion.guidance import GRAVITY
from companion.guidance.thrust import TILT_THRUST_SHARE, largest_tilt
from tests.flight.fly import fly, merged, mock_vehicle

HEAVY = {"thrust_slope_m_s2": 12.95, "thrust_offset_m_s2": 0.22}
"""The mock's specific thrust over its signal for a load that makes it hover at 0.74."""

STEPS = {
    "flight": {"maneuvers": ["steps"], "takeoff_height_m": 4.0},
    "steps": {"coefficient": 0.69, "duration_s": 1.0, "settle_s": 1.2},
    "limits": {"max_tilt_deg": 45},
}
"""Acceleration steps at 44° of tilt."""


def loaded(text):
    return parse(text, "test", Config)


@pytest.mark.parametrize("share", [0.3, 0.7, 0.9])
def test_at_the_largest_tilt_the_thrust_for_it_gives_the_lift(share):
    tilt = largest_tilt(GRAVITY, GRAVITY / share)
    assert TILT_THRUST_SHARE * GRAVITY / share * cos(tilt) == pytest.approx(GRAVITY)


def test_without_thrust_to_spare_there_is_no_tilt():
    assert largest_tilt(GRAVITY, 1.05 * GRAVITY) == 0.0
    assert largest_tilt(GRAVITY, 0.5 * GRAVITY) == 0.0


def test_limits_that_do_not_fit_the_thrust_are_refused_with_values_that_do():
    """The demonstrated one was flown and sank by 2 m."""
    text = "limits: {{max_tilt_deg: {}, max_thrust: {}}}"
    with pytest.raises(ConfigError) as refused:
        loaded(text.format(50, 0.55))
    told = str(refused.value)
    assert "limits.max_tilt_deg 50 does not fit limits.max_thrust 0.55" in told
    assert "with thrust.hover_thrust 0.5 the vehicle holds its height only up to 17°" in told
    assert "lower limits.max_tilt_deg to 16 or raise limits.max_thrust to 0.82" in told
    loaded(text.format(16, 0.55))
    loaded(text.format(50, 0.82))
    with pytest.raises(ConfigError, match=r"up to 0°; lower limits\.max_tilt_deg to 1 or raise"):
        loaded(text.format(50, 0.52))


@pytest.mark.parametrize(
    ("thrust", "fits"),
    [
        ("hover_thrust: 0.7", False),
        # A parabola: 0.7 of the signal is 0.49 of the thrust.
        ("hover_thrust: 0.7, curve_factor: 1.0", True),
        ("hover_thrust: 0.6, autopilot_compensates_tilt: true", True),
        ("hover_thrust: 0.6", False),
    ],
)
def test_the_curve_and_the_autopilots_own_compensation_count(thrust, fits):
    text = f"limits: {{max_tilt_deg: 48}}\nthrust: {{{thrust}}}"
    if fits:
        loaded(text)
    else:
        with pytest.raises(ConfigError, match=r"limits\.max_tilt_deg 48 does not fit"):
            loaded(text)


@pytest.mark.parametrize(
    ("autopilot", "airframe", "expected", "max_thrust", "hovers"),
    [
        ("px4", HEAVY, 0.5, 0.9, ("0.73", "0.74")),
        # The mock's ArduPilot gives what was measured whatever the load: less is expected instead.
        ("ardupilot", {}, 0.25, 0.45, ("0.36",)),
    ],
)
def test_a_vehicle_heavier_than_configured_keeps_its_height(
    autopilot, airframe, expected, max_thrust, hovers
):
    """Its hover thrust is learned in the climb; steps at 44° of tilt are flown with less."""
    heavy = {"airframe": airframe, "lockstep": {"period_ms": 8}}
    flight = merged(STEPS, {"limits": {"max_thrust": max_thrust}})
    with mock_vehicle(autopilot=autopilot, **heavy) as mock:
        summary = fly(mock, thrust={"hover_thrust": expected}, **flight)
    assert summary.result == "ok", summary.events
    rows = summary.trace.tracking.rows()
    assert np.abs(rows[:, 6] - rows[:, 3]).max() < 0.15, np.abs(rows[:, 6] - rows[:, 3]).max()
    (told,) = [
        text for _, text in summary.events if "of tilt; the flight is limited to this tilt" in text
    ]
    assert any(f"the vehicle hovers at a thrust of {hover}" in told for hover in hovers), told
    assert told.endswith("although limits.max_tilt_deg is 45")
    assert not [text for _, text in summary.events if text.startswith("safety: thrust")]


def test_a_vehicle_that_only_just_hovers_is_not_flown():
    with mock_vehicle(airframe=HEAVY, lockstep={"period_ms": 8}) as mock:
        summary = fly(
            mock,
            None,
            limits={"max_thrust": 0.75, "max_tilt_deg": 30},
            flight={"takeoff_height_m": 3.0},
        )
        state = mock.state()
    assert "limits.max_thrust 0.75 leaves no thrust to steer with" in summary.result
    assert "disarmed" in [text for _, text in summary.events]
    assert (state["on_ground"], state["crashed"]) == (True, False)


def test_setpoints_that_are_lost_for_a_moment_make_no_vehicle_too_heavy():
    """It holds the last rates and thrust and falls, so more thrust is sent than it gives."""
    steps = {"coefficient": 0.5, "duration_s": 0.4, "settle_s": 2.0}
    with mock_vehicle() as mock:
        mock.inject(
            {
                "kind": "drop",
                "direction": "from_companion",
                "after_offboard_s": 2.2,
                "duration_s": 0.6,
            }
        )
        flight = {"maneuvers": ["steps"], "takeoff_height_m": 8.0}
        summary = fly(mock, flight=flight, steps=steps)
    assert summary.result == "ok", summary.events
    assert not [text for _, text in summary.events if "hovers at a thrust" in text]


@pytest.mark.parametrize(("tilt", "told"), [(34.6, 0), (34.4, 1)])
async def test_a_reduction_by_less_than_the_told_degrees_is_not_told(tilt, told):
    """It said that the tilt is limited to 35°, although limits.max_tilt_deg is 35."""
    notes = []
    hover = SimpleNamespace(present_hover=0.7)
    learning = SimpleNamespace(largest_tilt=lambda: radians(tilt), hover_thrust=hover)
    limits = SimpleNamespace(max_tilt_deg=35.0, max_thrust=0.9)
    context = SimpleNamespace(
        config=SimpleNamespace(limits=limits),
        guidance_loop=SimpleNamespace(learning=learning),
        note=notes.append,
    )

    _TiltMargin(context).check()
    assert len(notes) == told, notes
