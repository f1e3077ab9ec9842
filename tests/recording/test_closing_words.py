"""The words at the end of a flight, over a grid of what can come of one."""

import copy
import itertools

import pytest

from companion.config import Config
from companion.config.flight import FlightConfig
from companion.flight.phases import EXIT_PHASES, flight_phases, ground_phases
from companion.recording.closing_words import Invocation, closing_words
from companion.recording.measurements.verdict import LOST_ROWS, checks, is_good
from companion.recording.what_to_do import ADVICE_BY_MONITOR, ADVICE_BY_PHASE
from companion.safety.table import monitors
from companion.vehicle.registry import AUTOPILOTS

DEMO = Invocation("companion", ["demo", "--lockstep"], None)
MINE = Invocation(".venv/bin/companion", ["fly", "--config", "my own.yaml"], "my own.yaml")

HOVER = {
    "name": "hover",
    "level_rms_m": 0.03,
    "level_max_m": 0.06,
    "height_rms_m": 0.02,
    "height_mean_m": 0.13,  # of the RMS of 0.16 that BEYOND puts in its place
    "reference_speed_max_m_s": 0.0,
    "open_loop": False,
}
STEPS = {**HOVER, "name": "steps", "level_rms_m": None, "level_max_m": None, "open_loop": True}
CIRCLE = {**HOVER, "name": "circle", "reference_speed_max_m_s": 5.0, "level_rms_m": 0.2}
GOOD = {
    "result": "ok",
    "phase": "disarm",
    "planner": "model-following",
    "maneuvers": [HOVER, STEPS, CIRCLE],
    "response": {
        "step_size": 0.25,
        "cross_axis_max": 0.002,
        "second_order": {"deviation_max": 0.03},
    },
    "samples": 10_000,
    "unanswered": {"late": 3, "not_newer": 1},
    "link": {"frames": 30_000, "lost": 12},
    "latency_us": {"p50": 110.0, "p99": 260.0, "max": 900.0},
    "deadline_ms": 4.0,
    "lockstep": False,
    "battery": {"takeoff": 0.9, "end": 0.8, "min": 0.2},
    "advice": [],
    "settings": {},
    "early_end": None,
    "at_the_end": {"armed": False, "mode": "AUTO.LOITER"},
    "extent": {
        "height_max_m": 5.04,
        "speed_max_m_s": 6.5,
        "tilt_max_deg": 31.0,
        "maneuver_speed_max_m_s": 5.1,
        "maneuver_tilt_max_deg": 24.6,
        "under_control_s": 38.2,
    },
    "log": "flights/one",
}
END = {
    "time_s": 33.9,
    "since_takeoff_s": 21.3,
    "phase": "maneuvers",
    "maneuver": "circle",
    "into_maneuver_s": 7.2,
    "monitor": "fence",
}
ENDED = {"result": "the vehicle is 9.1 m away", "phase": "maneuvers", "early_end": END}


def changed(path, value, base=GOOD):
    """A copy of the figures with the value at `path` (keys and numbers) replaced."""
    figures = copy.deepcopy(base)
    *way, last = path
    inner = figures
    for key in way:
        inner = inner[key]
    inner[last] = value
    return figures


def words(figures, called=DEMO):
    told = closing_words(figures, called)
    return told, "\n".join((told.headline, *told.lines))


def test_a_good_flight_is_called_good_with_its_figures_and_limits():
    told, text = words(GOOD)
    assert (told.was_good, told.completed) == (True, True)
    alone = words({**GOOD, "maneuvers": [CIRCLE]})[0]
    assert alone.headline == "The flight was good: circle, every figure within its limit."
    assert told.headline == (
        "The flight was good: hover, steps and circle, every figure within its limit."
    )
    assert "  circle: 0.20 m RMS from its path (limit 0.25 m), at most 0.06 m; 0.02 m" in text
    assert "  latency: 0.26 ms in 99 % of the answers (deadline 4 ms)" in text
    assert "  38 s under our control by planner model-following, up to 5.0 m high, 5.1" in text
    assert told.next_command == "companion plot flights/one"


BEYOND = {
    "circle": (["maneuvers", 2, "level_rms_m"], 0.26, "fly it slower"),
    "hover": (["maneuvers", 0, "level_rms_m"], 0.16, "fly in less wind"),
    "steps": (["maneuvers", 1, "height_rms_m"], 0.16, "set thrust.hover_thrust"),
    "straightness of the steps": (["response", "cross_axis_max"], 0.01, "companion identify"),
    "linearity of the steps": (
        ["response", "second_order", "deviation_max"],
        0.06,
        "limits.max_tilt_rate_deg_s",
    ),
    "attitude samples": (["unanswered", "late"], 150, "`unanswered samples`"),
    "link": (["link", "lost"], 900, "baud"),
    "latency": (["latency_us", "p99"], 4100.0, "realtime.scheduler"),
    "battery": (["battery", "end"], 0.29, "charge"),
}


@pytest.mark.parametrize("what", BEYOND)
def test_each_figure_beyond_its_limit_is_told_first_with_what_to_do(what):
    path, value, remedy = BEYOND[what]
    told, _ = words(changed(path, value))
    assert (told.was_good, told.completed) == (False, True)
    assert "not good" in told.headline
    assert "1 of 11 figures beyond their limits" in told.headline
    assert told.lines[0].startswith(f"! {what}: ")
    assert remedy in told.lines[0]


@pytest.mark.parametrize("what", BEYOND)
def test_a_figure_that_was_not_measured_is_no_fault(what):
    path, _, _ = BEYOND[what]
    nothing = 0 if what in ("attitude samples", "link") else None
    figures = changed(path, nothing)
    assert is_good(figures)


def test_a_height_error_that_changes_in_flight_does_not_come_from_the_hover_thrust():
    climbing = {**CIRCLE, "height_rms_m": 0.16}
    told, _ = words(changed(["maneuvers", 2], {**climbing, "height_mean_m": -0.12}))
    assert "set thrust.hover_thrust" in told.lines[0]
    for mean in (0.1, -0.1, None):
        told, _ = words(changed(["maneuvers", 2], {**climbing, "height_mean_m": mean}))
        assert "thrust.hover_thrust" not in told.lines[0]
        assert "guidance.drag_per_s" in told.lines[0]


SWING = {"swing_rms_deg": 11.9, "swing_period_s": 0.43, "swing_regularity": 0.92}


def test_a_hover_that_swings_is_not_good_and_wind_is_no_swing():
    told, _ = words(changed(["maneuvers", 0], {**HOVER, **SWING}))
    assert (told.was_good, told.lines[0][:56]) == (
        False,
        "! hover: swings by 11.9° RMS every 0.43 s (limit 3°); lo",
    )
    assert "planner.gain_per_s or the weights guidance.position_weight_per_s4" in told.lines[0]
    assert is_good(changed(["maneuvers", 0], {**HOVER, **SWING, "swing_regularity": 0.5}))
    assert is_good(changed(["maneuvers", 0], {**HOVER, **SWING, "swing_rms_deg": 2.9}))
    unknown = {**SWING, "swing_period_s": None, "swing_regularity": None}
    assert is_good(changed(["maneuvers", 0], {**HOVER, **unknown}))


def test_a_gain_above_the_sensible_one_is_told_after_good_and_bad_flights():
    figures = {**GOOD, "gain_warning": "planner.gain_per_s is 10, and 5.2 is …"}
    told, _ = words(figures)
    assert (told.was_good, told.lines[0]) == (True, "! planner.gain_per_s is 10, and 5.2 is …")
    assert words({**figures, **ENDED})[0].lines[-1] == told.lines[0]


def test_a_drag_that_the_next_flight_begins_with_makes_no_flight_bad_and_is_flown_again():
    figures = {**GOOD, "drag_learned": "the vehicle's drag at 5.1 m/s is 1.00 1/s; …"}
    told, text = words(figures)
    assert (told.was_good, told.next_command) == (True, "companion plot flights/one")
    assert "  the vehicle's drag at 5.1 m/s is 1.00 1/s; …" in text
    off_course = changed(["maneuvers", 2, "level_rms_m"], 0.26, figures)
    told, text = words(off_course)
    assert (told.was_good, told.next_command) == (False, "companion demo --lockstep")
    assert (
        "fly again: the next flight begins with the drag that this flight learned" in told.lines[0]
    )
    other_fault = changed(["battery", "end"], 0.29, figures)
    assert words(other_fault)[0].next_command == "companion plot flights/one"


def test_a_step_that_the_tilt_limit_cut_is_told_with_the_tilt_it_asked_for():
    cut = changed(["response", "asked_tilt_deg"], 42.46, {**GOOD, "max_tilt_deg": 35.0})
    told, text = words(cut)
    assert (told.was_good, text.count("tilt limit")) == (False, 1)
    assert told.lines[0] == (
        "! tilt of the steps: the tilt limit cut a step, which asked for 42.5° "
        "(limits.max_tilt_deg: 35); lower steps.coefficient or the corners' coefficients, fly in "
        "less wind, or raise limits.max_tilt_deg"
    )
    early = closing_words({**cut, **ENDED}, None)
    assert early.lines[-1] == told.lines[0]
    bent = changed(["response", "cross_axis_max"], 0.1, cut)
    assert "identify" not in words(bent)[1]  # the cut bends the step, not the planner
    within = changed(["response", "asked_tilt_deg"], 35.2, cut)  # cut by less than 3 % of a step
    assert "tilt of the steps" not in words(within)[1]


def test_a_bent_step_is_not_blamed_on_the_planner_that_follows_the_model():
    bent = changed(["response", "cross_axis_max"], 0.01)
    assert "planner.name" not in words(bent)[0].lines[0]
    assert "measure vehicle.lag_ms and vehicle.dead_time_ms anew" in words(bent)[0].lines[0]
    told, _ = words({**bent, "planner": "first-order"})
    assert "fly planner.name: model-following" in told.lines[0]


def test_in_lockstep_the_latency_is_not_judged():
    slow = changed(["latency_us", "p99"], 99_000.0)
    assert not is_good(slow)
    _, text = words({**slow, "lockstep": True})
    assert is_good({**slow, "lockstep": True})
    assert "latency" not in text
    assert "ms" not in text


def test_a_setting_that_does_not_fit_is_told_and_tried_next():
    sentence = "the vehicle hovers at 0.49, but thrust.hover_thrust is 0.30; set it to 0.49"
    figures = {**GOOD, "advice": [sentence], "settings": {"thrust.hover_thrust": "0.49"}}
    told, _ = words(figures)
    assert "the configuration does not fit the vehicle" in told.headline
    assert told.lines[0] == f"! {sentence}"
    assert told.next_command == "companion demo --lockstep --set thrust.hover_thrust=0.49"
    again = words(figures, MINE)[0].next_command
    assert again == (
        ".venv/bin/companion fly --config 'my own.yaml' --set thrust.hover_thrust=0.49"
    )


def test_a_full_disk_is_not_blamed_on_the_configuration():
    sentence = f"7168 {LOST_ROWS}: No space left on device"
    told, _ = words({**GOOD, "advice": [sentence]})
    assert told.headline == (
        "The flight was good, as far as it could be recorded: hover, steps and circle."
    )
    assert (told.was_good, told.lines[0]) == (False, f"! {sentence}")
    assert told.lines[-1].startswith("  at least 38 s under our control"), "the rest was lost"
    assert words(GOOD)[0].lines[-1].startswith("  38 s under our control")


def test_a_flight_that_ended_early_says_when_why_and_what_to_do():
    told, text = words({**GOOD, **ENDED})
    assert (told.was_good, told.completed) == (False, False)
    assert told.headline == "The flight ended early: the vehicle is 9.1 m away."
    assert "when: at 33.9 s, in phase `maneuvers`, 7.2 s into circle" in text
    assert "vehicle now: disarmed, in mode AUTO.LOITER" in text
    assert "what to do: make the maneuver smaller" in text
    assert told.next_command == "companion plot flights/one"


@pytest.mark.parametrize("monitor", ["deadlines", "starvation", "answer gaps", "answer rate"])
def test_a_demo_that_the_computer_was_too_slow_for_is_flown_in_lockstep_next(monitor):
    """On a busy computer the first `make demo` failed, and the words led to realtime.scheduler."""
    demo = Invocation(".venv/bin/companion", ["demo", "--maneuvers", "steps"], None)
    slow = {**GOOD, **ENDED, "early_end": {**END, "monitor": monitor}}
    late = changed(("latency_us", "p99"), 9000.0)
    for figures in (slow, late):
        told = words(figures, demo)[0]
        assert told.next_command == ".venv/bin/companion demo --maneuvers steps --lockstep"
        assert words({**figures, "lockstep": True}, DEMO)[0].next_command == (
            "companion plot flights/one"
        )
        assert "--lockstep" not in str(words(figures, MINE)[0].next_command)
    assert "--lockstep" not in str(words({**GOOD, **ENDED}, demo)[0].next_command)
    late = changed(["latency_us", "p99"], 128_000.0, {**GOOD, **ENDED})
    unmonitored = changed(["early_end", "monitor"], None, late)  # such as samples that came late
    assert words(unmonitored, demo)[0].next_command.endswith("demo --maneuvers steps --lockstep")


def test_a_vehicle_that_is_left_armed_in_the_air_comes_before_all_else():
    armed = {**GOOD, **ENDED, "at_the_end": {"armed": True, "mode": "AUTO.LOITER"}}
    _, text = words(armed)
    assert "vehicle now: ARMED, in mode AUTO.LOITER" in text
    assert "what to do: the vehicle is armed: take it over or land it; then: make" in text


def test_a_vehicle_that_lies_on_its_side_is_not_told_as_merely_disarmed():
    """Refused at the takeover in strong wind, a vehicle tipped over in PX4's own landing."""
    lying, standing = (
        {**GOOD, **ENDED, "at_the_end": {"armed": False, "mode": "M", "tilt_deg": tilt}}
        for tilt in (45.3, 20.0)
    )
    assert "disarmed, in mode M, tilted by 45°: it tipped over or crashed; pull " in words(lying)[1]
    assert words(standing)[0].lines[1] == "  vehicle now: disarmed, in mode M"


def test_a_vehicle_that_fell_silent_is_not_told_as_it_is_now():
    lost = {**GOOD, **ENDED, "at_the_end": {"armed": True, "mode": "OFFBOARD", "unheard_s": 0.42}}
    _, text = words(lost)
    assert "vehicle when last heard, 0.4 s before the end: ARMED, in mode OFFBOARD" in text
    assert "vehicle now" not in text
    assert "what to do: the vehicle was armed when last heard: take it over or land it" in text


def test_a_vehicle_that_was_lost_while_it_took_off_may_fly():
    end = {**END, "since_takeoff_s": None, "phase": "takeoff", "maneuver": None, "monitor": None}
    armed = {"armed": True, "mode": "AUTO.TAKEOFF"}
    _, text = words({**GOOD, "result": "no heartbeat", "early_end": end, "at_the_end": armed})
    assert "the vehicle is armed: disarm it, or take it over if it flies; then: " in text
    assert "in phase `takeoff`, before any report of lift-off" in text


@pytest.mark.parametrize("phase", ["connect", "checks", "stream", "arm"])
def test_before_take_off_the_doctor_is_next(phase):
    end = {**END, "since_takeoff_s": None, "phase": phase, "maneuver": None, "monitor": None}
    figures = {**GOOD, "result": "no heartbeat", "early_end": end, "maneuvers": []}
    told, text = words(figures, MINE)
    assert f"when: at 33.9 s, in phase `{phase}`, before take-off" in text
    assert ADVICE_BY_PHASE[phase] in text
    assert told.next_command == ".venv/bin/companion doctor --config 'my own.yaml'"
    assert words(figures)[0].next_command is None  # the bundled vehicle has no doctor
    elsewhere = ["--arm", "--endpoint", "tcp://10.0.0.1:5760", "--set=link.target_system=2"]
    called = MINE._replace(arguments=[*MINE.arguments, *elsewhere])
    assert words(figures, called)[0].next_command == (
        f"{told.next_command} --endpoint tcp://10.0.0.1:5760 --set=link.target_system=2"
    )


def test_a_question_keeps_its_mark():
    figures = {**GOOD, **ENDED, "result": "no heartbeat; is the vehicle running?"}
    assert (
        words(figures)[0].headline
        == "The flight ended early: no heartbeat; is the vehicle running?"
    )


def test_a_flight_that_the_user_interrupted_has_nothing_to_mend():
    figures = {**GOOD, **ENDED, "result": "interrupted by the user (Ctrl-C)"}
    told, text = words(figures, MINE)
    assert "nothing needs fixing" in text
    armed = {**figures, "at_the_end": {"armed": True, "mode": None}}
    assert words(armed)[0].lines[2].endswith("the vehicle is armed: take it over or land it")
    assert told.next_command == ".venv/bin/companion fly --config 'my own.yaml'"


def test_after_first_order_on_an_own_vehicle_identify_is_next():
    figures = {**GOOD, "planner": "first-order"}
    command = words(figures, MINE)[0].next_command
    assert command == ".venv/bin/companion identify --config 'my own.yaml'"
    assert words(figures)[0].next_command == "companion plot flights/one"
    assert closing_words(figures, None).next_command is None


def test_every_combination_has_words_without_gaps():
    """A grid of results, ends, measurements and callers: a sentence each, nothing raised."""
    nothing = {
        "maneuvers": [],
        "samples": 0,
        "unanswered": {},
        "link": {},
        "response": {"step_size": None, "cross_axis_max": None, "second_order": {}},
        "latency_us": {"p50": None, "p99": None, "max": None},
        "battery": {"takeoff": None, "end": None, "min": 0.2},
        "extent": {**dict.fromkeys(GOOD["extent"]), "under_control_s": 0.0},
        "log": None,
    }
    ends = [
        {},
        *(
            {"result": "broken", "early_end": {**END, "phase": phase, "monitor": monitor}}
            for phase in (*ADVICE_BY_PHASE, "go to")
            for monitor in (None, "fence", "unknown")
        ),
    ]
    states = [
        {"armed": armed, "mode": mode} for armed in (True, False, None) for mode in ("M", None)
    ]
    for measured, end, state, called in itertools.product(
        ({}, nothing), ends, states, (DEMO, MINE, None)
    ):
        told, text = words({**GOOD, **measured, **end, "at_the_end": state}, called)
        assert told.headline.endswith(".")
        assert all(line.startswith(("  ", "! ")) for line in told.lines)
        assert "None" not in text
        assert " nan" not in text
        assert (called is None) <= (told.next_command is None)


def test_every_monitor_and_every_phase_has_its_advice():
    assert {monitor.name for monitor in monitors(Config())} == set(ADVICE_BY_MONITOR)
    config = FlightConfig()
    phases = [*ground_phases(config)]
    for autopilot in AUTOPILOTS:
        phases += flight_phases(config, 1.0, autopilot)
    for ending in EXIT_PHASES.values():
        phases += ending
    assert {phase.name for phase in phases} <= set(ADVICE_BY_PHASE)


def test_the_checks_are_those_of_the_json():
    assert {check.what for check in checks(GOOD)} == set(BEYOND)
