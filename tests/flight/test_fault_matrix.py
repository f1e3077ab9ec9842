"""The fault matrix: every fault of the mock begun in every phase, on each kind of autopilot.

`docs/safety.md` shows the same table. The cells marked * are flown always, those marked + always on
PX4, all by `make matrix`. A fault stays until the end, so one that the hand back survives is flown
into the landing, too.
"""

import re
from math import acos, degrees, hypot
from pathlib import Path

import pytest

from companion.config.limits import LimitsConfig
from companion.flight.observer import SilentObserver
from tests.flight.fly import fly, mock_vehicle

AUTOPILOTS = ("px4", "ardupilot")
PILOTED = {"px4": "POSCTL", "ardupilot": "LOITER"}
"""What the pilot's mode is called."""
PHASES = ("stream", "takeoff", "offboard", "maneuvers", "hand back", "land")
AFTER = dict(zip(PHASES, (0.0, 0.8, 1.3, 0.3, 0.0, 0.3), strict=True))
"""How long after the phase began the fault does, s; offboard begins with a judgement of 1 s."""

GROUND, OK, LANDED, HELD, PILOT = "ground", "ok", "landed", "held", "pilot"
"""ground: never left it. ok: as if nothing were. landed: we landed it, and say why. held: the
autopilot flies it, by our command or its own failsafe. pilot: it is the pilot's."""

NAN = {"kind": "nan_field", "message": "ATTITUDE_QUATERNION", "field": "q2"}
LOST = {"kind": "nan_field", "message": "LOCAL_POSITION_NED", "field": "x"}
SMALL = {"kind": "estimator_reset", "yaw_deg": 20.0, "position_ned_m": [0.4, -0.3, 0.0]}
LARGE = {"kind": "estimator_reset", "yaw_deg": 60.0, "position_ned_m": [3.0, 0.0, 0.0]}

MATRIX = {
    # fault: what it is, and how a flight ends in which it begins in each of PHASES; * + see above
    "drop": ({"kind": "drop"}, "ground held* held held held+ held"),
    "drop downlink": (
        {"kind": "drop", "direction": "to_companion"},
        "ground held held held held held",
    ),
    "drop uplink": (
        {"kind": "drop", "direction": "from_companion"},
        "ground+ held held* held held ok",
    ),
    "delay": ({"kind": "delay", "delay_ms": 400.0}, "ground landed held+ held ok ok"),
    "duplicate": ({"kind": "duplicate"}, "landed landed ok ok ok ok"),
    "reorder": ({"kind": "reorder", "probability": 0.5}, "landed landed ok ok ok ok"),
    "corrupt": ({"kind": "corrupt"}, "ground held held held held held*"),
    "stop telemetry": ({"kind": "stop_telemetry"}, "ground held held held held+ held"),
    "freeze clock": ({"kind": "freeze_clock"}, "ground landed held* held ok ok"),
    "NaN attitude": (NAN, "ground landed held+ held ok ok"),
    "NaN position": (LOST, "landed landed held ok ok ok"),
    "pilot takeover": (
        {"kind": "pilot_takeover", "mode": "POSCTL"},
        "ground pilot pilot pilot pilot* pilot+",
    ),
    "small reset": (SMALL, "ok ok+ ok ok ok ok"),
    "large reset": (LARGE, "ok ok landed* landed ok ok"),
    "refuse arming": ({"kind": "refuse_arming"}, "ground+ ok ok ok ok ok"),
    "low battery": (
        {"kind": "low_battery", "remaining": 0.15},
        "ground+ landed landed landed ok ok",
    ),
    "GPS loss": ({"kind": "gps_loss"}, "ground landed+ landed landed ok ok"),
}
ELSE = {
    # ArduPilot gets no setpoints before it is in the air. What begins as it is arming is counted
    # when the judgement before it is a second old, so before the take-over.
    ("ardupilot", "stream", "freeze clock"): LANDED,
    ("ardupilot", "stream", "NaN attitude"): LANDED,
    # Its failsafe comes after a second of stale samples, before the hold is answered.
    ("px4", "hand back", "delay"): HELD,
}
"""Where a family differs."""
SHORT = {
    "flight": {"takeoff_height_m": 4.0, "takeoff_timeout_s": 8.0, "landing_timeout_s": 15.0},
    "hover": {"duration_s": 1.0},
}
CLIMB = 3.0
"""Of the autopilot in these tests, m/s."""
DOCUMENT = Path(__file__).parents[2] / "docs" / "safety.md"


def cells():
    for autopilot in AUTOPILOTS:
        for name, (fault, ends) in MATRIX.items():
            for phase, end in zip(PHASES, ends.split(), strict=True):
                always = end.endswith("*") or (end.endswith("+") and autopilot == "px4")
                expected = ELSE.get((autopilot, phase, name), end.strip("*+"))
                label = f"{autopilot}-{name}-{phase}"
                marks = () if always else (pytest.mark.slow,)
                # Those that are flown always end alike at 100 Hz; of the others some do not.
                case = autopilot, fault, phase, expected, not always
                yield pytest.param(*case, marks=marks, id=label)


class Begin(SilentObserver):
    """Begins the fault a little after a phase did; ArduPilot has its setpoints only in the air."""

    def __init__(self, mock, fault, phase):
        self.mock, self.fault, self.after = mock, fault, AFTER[phase]
        self.released = None
        early = mock.autopilot == "ardupilot" and phase == "stream"
        self.wanted = "arm" if early else phase

    def phase(self, name, waits_for):
        if name == self.wanted:
            at = self.mock.state()["time"] + self.after
            self.mock.inject({**self.fault, "at_s": at})
            self.wanted = None
        if name == "listen":  # meanwhile the autopilot's own failsafe comes
            self.released = self.mock.state()


def ending(autopilot, state, result):
    """Which of the five it was."""
    if "took over: mode" in result and state["mode"] == PILOTED[autopilot]:
        return PILOT if state["armed"] else GROUND
    if state["armed"]:
        return HELD
    if result == "ok":
        return OK
    return GROUND if state["touchdown_speed"] is None else LANDED


def excess(state):
    """What is beyond the limits of the flight: tilt, body rates, speed, place."""
    _, x, y, _ = state["q"]
    limits = LimitsConfig()
    return {
        "tilt": degrees(acos(1.0 - 2.0 * (x * x + y * y))) > limits.max_tilt_deg,
        "rates": degrees(hypot(*state["rates"])) > limits.max_tilt_rate_deg_s,
        "speed": hypot(*state["velocity"]) > CLIMB + 0.5,
        "place": hypot(*state["position"]) > 5.0,
    }


@pytest.mark.parametrize(("autopilot", "fault", "phase", "end", "full_rate"), list(cells()))
def test_a_fault_in_a_phase_ends_as_documented(autopilot, fault, phase, end, full_rate):
    with mock_vehicle(autopilot=autopilot, full_rate=full_rate, in_lockstep=True) as mock:
        observer = Begin(mock, fault, phase)
        summary = fly(mock, None, observer, **SHORT)
        assert observer.wanted is None, summary.events
        after = observer.released or mock.state()
        # Where nobody commands a mode any more, the autopilot's own failsafe comes after a while.
        state = mock.until(lambda state: not state["armed"] or state["mode"] != "OFFBOARD")
        assert ending(autopilot, after, summary.result) == end, summary.events
        assert state["setpoints"] == after["setpoints"]
        assert (summary.result == "ok") is (end == OK)
        assert not any(excess(after).values()), excess(after)
        assert not state["crashed"]


def test_the_document_shows_this_table():
    rows = re.findall(r"^\| ([^|]+?) \|((?: \w+ \|){6})$", DOCUMENT.read_text(), re.MULTILINE)
    shown = {name: re.findall(r"\w+", ends) for name, ends in rows if name in MATRIX}
    assert shown == {name: re.findall(r"\w+", ends) for name, (_, ends) in MATRIX.items()}
