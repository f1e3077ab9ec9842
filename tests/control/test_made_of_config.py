"""The loops get the values of the configuration, in SI units, each in its place."""

from math import acos, cos, radians, sin
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates, Limits, Target
from companion.attitude.limits import make_constants
from companion.config import Config
from companion.control.estimator_resets import EstimatorResets
from companion.control.hold_settings import hold_weights
from companion.control.hover_learning import HoverLearning
from companion.control.inner_loop import (
    hover_thrust,
    planner,
    planner_constants,
    plugin,
    thrust_limits,
)
from companion.control.loop_record import Deadlines
from companion.control.loops import make_loops
from companion.control.motion_estimate import MotionEstimate
from companion.control.outer_loop import linear_settings, make_guidance, predictive_settings
from companion.control.planner_runner import PlannerRunner
from companion.control.retuning import (
    Retuning,
    Slew,
    interpolated_config,
    loop_settings,
    reason_against_changes,
)
from companion.control.telemetry import GuidedVehicle
from companion.drag import AxisDrag, Drag
from companion.files.yaml_file import ConfigError
from companion.guidance import GRAVITY, GuidanceInput, LinearGuidance, ThrustSettings, VehicleMotion
from companion.recording.trace import FlightTrace
from companion.vehicle.records import AttitudeSample, LocalPosition

CONFIG = Config.model_validate(
    {
        "deadman": {
            "telemetry_stale_ms": 90.0,
            "target_stale_ms": 140.0,
            "position_stale_ms": 250.0,
            "deadline_ms": 3.0,
        },
        "limits": {
            "max_tilt_deg": 30.0,
            "max_tilt_rate_deg_s": 80.0,
            "max_yaw_rate_deg_s": 50.0,
            "recovery_angle_deg": 70.0,
            "min_thrust": 0.15,
            "max_thrust": 0.85,
        },
        "planner": {"name": "first-order", "gain_per_s": 4.0, "yaw_gain_per_s": 1.5},
        "thrust": {
            "hover_thrust": 0.45,
            "correction_limit": 0.3,
            "correction_time_s": 1.25,
            "curve_factor": 0.2,
            "battery_exponent": 1.5,
            "lag_ms": 30.0,
            "autopilot_compensates_tilt": True,
        },
        "guidance": {"drag_per_s": 0.6, "rate_hz": 40.0},
        "vehicle": {"lag_ms": 60.0, "dead_time_ms": 35.0, "pitch_lag_ms": 50.0},
    }
)
SAMPLE = AttitudeSample(
    3000, 3.0, 10.0, 2000, (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0), 0.0, None, True
)


def retuned(values):
    """What a change of values gives to stand-ins for the loops."""
    seen = {}
    guidance = LinearGuidance(linear_settings(CONFIG))
    guidance_loop = SimpleNamespace(
        command_maker=SimpleNamespace(guidance=guidance),
        estimate=SimpleNamespace(retune=lambda *settings: seen.update(estimate=settings)),
        hold=SimpleNamespace(),
    )
    loop = SimpleNamespace(retune=lambda *law: seen.update(law=law))
    Retuning(loop, guidance_loop).apply(values)
    return {**seen, "guidance": guidance._settings, "max_tilt": guidance_loop.hold.max_tilt}


def test_a_change_of_values_reaches_both_loops():
    limits = CONFIG.limits.model_copy(update={"max_tilt_deg": 20.0})
    values = loop_settings(CONFIG.model_copy(update={"limits": limits}))
    assert retuned(values) == {
        "law": (values.constants, values.limits),
        "estimate": (values.observer, values.correction),
        "guidance": values.guidance,
        "max_tilt": pytest.approx(radians(20.0)),
    }
    assert values.limits == Limits(radians(20.0), radians(80.0), radians(50.0))
    others = SimpleNamespace(command_maker=SimpleNamespace(guidance="another package's"))
    with pytest.raises(TypeError, match="values of str cannot be changed in flight"):
        Retuning(SimpleNamespace(), others).apply(values)


def test_a_planner_of_another_package_keeps_its_gains():
    values = loop_settings(CONFIG)
    runner = PlannerRunner(SimpleNamespace(), EstimatorResets(), values.limits)
    with pytest.raises(TypeError, match="values of SimpleNamespace cannot be changed in flight"):
        runner.retune(values.constants, values.limits)


@pytest.mark.parametrize(
    ("section", "key", "name", "words"),
    [
        ("guidance", "kind", "nmpc", "guidance.kind nmpc keeps"),
        ("planner", "name", "theirs", "planner.name theirs keeps"),
    ],
)
def test_what_may_not_change_in_flight_says_why(section, key, name, words):
    assert reason_against_changes(CONFIG) is None
    changed = getattr(CONFIG, section).model_copy(update={key: name})
    assert words in reason_against_changes(CONFIG.model_copy(update={section: changed}))


def with_gains(**gains):
    return CONFIG.model_copy(update={"planner": CONFIG.planner.model_copy(update=gains)})


def test_a_value_moves_by_equal_factors_and_from_zero_by_equal_amounts():
    before, after = with_gains(yaw_gain_per_s=0.5), with_gains(yaw_gain_per_s=0.8, gain_per_s=1.0)
    middle = interpolated_config(before, after, 0.5).planner
    assert middle.gain_per_s == pytest.approx(2.0)
    assert middle.yaw_gain_per_s == pytest.approx(0.4**0.5)
    started = interpolated_config(
        with_gains(yaw_gain_per_s=0.0), with_gains(yaw_gain_per_s=0.8), 0.25
    )
    assert started.planner.yaw_gain_per_s == pytest.approx(0.2)
    ended = interpolated_config(
        with_gains(yaw_gain_per_s=0.8), with_gains(yaw_gain_per_s=0.0), 0.25
    )
    assert ended.planner.yaw_gain_per_s == pytest.approx(0.6)
    weight = hold_weights(CONFIG).velocity
    heavier = CONFIG.guidance.model_copy(update={"velocity_weight_per_s2": 4.0 * weight})
    changed = CONFIG.model_copy(update={"guidance": heavier})
    found = interpolated_config(CONFIG, changed, 0.5).guidance.velocity_weight_per_s2
    assert found == pytest.approx(2.0 * weight)


def test_a_jump_is_in_effect_at_once():
    slew, wanted = Slew(CONFIG), with_gains(gain_per_s=1.0)
    slew.jump(wanted)
    assert slew.settled_config is wanted
    assert slew.step(10.0) is None
    slew.begin(CONFIG, 11.0)
    assert slew.step(11.35).constants.gain == pytest.approx(2.0)


def test_a_change_that_is_stopped_stays_where_it_is():
    slew = Slew(CONFIG)
    assert slew.step(10.0) is None
    limits = CONFIG.limits.model_copy(update={"max_tilt_deg": 20.0})
    slew.begin(wanted := CONFIG.model_copy(update={"limits": limits}), 10.0)
    half_way = slew.step(10.35)
    assert radians(20.0) < half_way.max_tilt < radians(30.0)
    slew.stop()
    assert slew.step(11.0) is None
    assert slew.settled_config is CONFIG
    slew.begin(wanted, 12.0)
    assert slew.step(12.75).max_tilt == pytest.approx(radians(20.0))
    assert (slew.settled_config, slew.step(12.8)) == (wanted, None)


def test_both_loops_are_made_and_answer_a_sample():
    now, sent = 10.0, []
    vehicle = SimpleNamespace(
        position=LocalPosition(10.0, 3.0, (1.0, 2.0, -3.0), (0.0, 0.0, 0.0)),
        battery=None,
        attitude_target_thrust=None,
        height=3.0,
        armed=True,
        standing=False,
        may_idle=False,
        offset=-7.0,
        age=lambda vehicle_time, now: now - 7.0 - vehicle_time,
    )
    trace = FlightTrace()
    loop, guidance_loop = make_loops(
        CONFIG,
        lambda *setpoint: sent.append(setpoint) or True,
        GuidedVehicle(vehicle, vehicle, vehicle),
        trace,
        lambda: now,
        lambda: 3_005_000,
    )
    guidance_loop.note_attitude(SAMPLE)
    guidance_loop.step()
    guidance_loop.hold_here()
    guidance_loop.step()
    loop.on = loop.offboard_active = True
    loop.on_sample(SAMPLE)
    ((stamp, rates, thrust),) = sent
    assert (stamp, tuple(rates)) == (3000, pytest.approx((0.0, 0.0, 0.0), abs=1e-9))
    assert thrust == hover_thrust(CONFIG).normalised_thrust(0.0, SAMPLE.q, SAMPLE.body_rates)
    assert (loop.record.latency_ns, loop.record.missed_deadlines) == (3_003_000, 1)
    assert len(trace.rates.rows()) == 1
    assert loop._deadlines == Deadlines(telemetry_stale=0.09, target_stale=0.14, deadline=0.003)
    assert loop.planner._limits == Limits(radians(30.0), radians(80.0), radians(50.0))
    assert loop._hover_thrust is guidance_loop.learning.hover_thrust
    assert guidance_loop.hold.max_tilt == pytest.approx(radians(30.0))
    safety = CONFIG.safety
    assert guidance_loop.hold._assumed_braking == (safety.reaction_s, safety.braking_m_s2)
    assert loop.command.period == pytest.approx(0.025)
    now = 10.25
    assert guidance_loop.fresh_position() is vehicle.position
    now = 10.3
    assert guidance_loop.fresh_position() is None
    assert guidance_loop.estimate.vehicle_time(10.0, vehicle.position) == 3.0
    vehicle.offset = -6.5
    assert guidance_loop.estimate.vehicle_time(10.0, vehicle.position) == 3.5


def test_a_position_that_is_exactly_as_old_as_allowed_counts():
    state = SimpleNamespace(position=None)
    vehicle = GuidedVehicle(state, SimpleNamespace(), SimpleNamespace(age=lambda *_: 0.25))
    assert vehicle.fresh_position(10.0, 0.25) is None
    state.position = LocalPosition(9.75, 3.0, (1.0, 2.0, -3.0), (0.0, 0.0, 0.0))
    assert vehicle.fresh_position(10.0, 0.25) is state.position
    assert vehicle.fresh_position(10.25, 0.25) is None


def test_thrust_and_law():
    assert hover_thrust(CONFIG)._settings == ThrustSettings(
        hover=0.45,
        correction_limit=0.3,
        correction_time=1.25,
        min_thrust=0.15,
        max_thrust=0.85,
        curve_factor=0.2,
        battery_exponent=1.5,
        lag=0.03,
        tilt_compensated=True,
        drag=0.6,
    )
    limits = Limits(radians(30.0), radians(80.0), radians(50.0))
    assert planner_constants(CONFIG) == make_constants(4.0, 1.5, limits, radians(70.0))
    assert thrust_limits(CONFIG) == pytest.approx((GRAVITY / 3.0, 0.85 / 0.45 * GRAVITY))


def test_predictive_control():
    made = predictive_settings(CONFIG)
    assert (made.gain, made.yaw_gain, made.lag, made.dead_time) == (4.0, 1.5, 0.06, 0.035)
    assert made.max_tilt == pytest.approx(radians(30.0))
    assert made.max_tilt_rate == pytest.approx(radians(80.0))
    assert made.max_yaw_rate == pytest.approx(radians(50.0))
    assert (made.min_thrust, made.max_thrust) == thrust_limits(CONFIG)
    assert (made.lead, made.deadline) == (0.025, 0.025)
    assert predictive_settings(CONFIG, vehicle_waits=True).deadline == 1.0
    unknown = CONFIG.model_copy(update={"vehicle": Config().vehicle})
    assert predictive_settings(unknown).lag == 0.25 / 4.0  # critical damping
    slow = CONFIG.vehicle.model_copy(update={"lag_ms": 5.0, "pitch_lag_ms": 5.0})
    with pytest.raises(ConfigError, match=r"^guidance.kind: nmpc does not work .*lag must be"):
        predictive_settings(CONFIG.model_copy(update={"vehicle": slow}))


def test_a_plugin_that_is_not_installed_is_named():
    with pytest.raises(ConfigError, match="nobodys-planner"):
        plugin("planner.name", "companion.planners", "nobodys-planner")


@pytest.mark.parametrize(
    ("section", "key", "make"), [("planner", "name", planner), ("guidance", "kind", make_guidance)]
)
def test_a_plugin_that_takes_other_arguments_is_named(monkeypatch, section, key, make):
    class Theirs:
        def __init__(self, one, another):
            pass

    monkeypatch.setattr("companion.plugins.load", lambda *_: Theirs)
    changed = getattr(CONFIG, section).model_copy(update={key: "theirs"})
    with pytest.raises(ConfigError, match=f"{section}.{key}: theirs cannot be made: .*another"):
        make(CONFIG.model_copy(update={section: changed}))


def test_the_tilt_is_limited_to_what_the_thrust_can_hold():
    """The largest thrust of 20 m/s² keeps 5 % in reserve."""
    learning = HoverLearning(SimpleNamespace(largest_tilted_thrust=20.0), None)
    level, sinking = acos(GRAVITY / 19.0), acos((GRAVITY - 2.0) / 19.0)
    assert learning.largest_tilt() == pytest.approx(level)
    assert learning.largest_tilt(2.0) == pytest.approx(sinking)
    inside = Target(0.3, 0.4, 0.5)
    assert learning.limit_tilt(inside, 0.0) == inside
    found = learning.limit_tilt(Target(0.6 * 0.99, 0.8 * 0.99, 0.5), 2.0)
    assert found == pytest.approx((0.6 * sin(sinking), 0.8 * sin(sinking), 0.5, 0.0))
    assert cos(sinking) < cos(level)


class Observer:
    """Keeps what it is told."""

    disturbance = (0.5, -0.5)

    def __init__(self):
        self.turns, self.settings = [], []
        self.rotate_disturbance, self.retune = self.turns.append, self.settings.append


def estimate(observer=None, **drag):
    resets = []
    correction = SimpleNamespace(reset=lambda: resets.append(1), retune=resets.append)
    learned = SimpleNamespace(**drag)
    made = MotionEstimate(observer or Observer(), correction, learned, lambda: None)
    return made, resets


def test_only_a_new_reset_of_the_heading_turns_the_estimate():
    made, resets = estimate(observer := Observer())
    for turn in (0.0, 0.5, 0.5, 0.25):
        made.note_heading_resets(turn)
    assert (observer.turns, len(resets)) == ([0.5, -0.25], 2)
    made.retune("settings", "of the correction")
    assert (observer.settings, resets[2:]) == (["settings"], ["of the correction"])


def test_the_drag_along_the_axes_is_that_of_the_newest_heading():
    made, _ = estimate(axis_coefficient=0.02)
    made.note_attitude(SAMPLE._replace(q=(cos(0.4), 0.0, 0.0, sin(0.4))))
    assert made._axis_drag == pytest.approx(AxisDrag(0.02, 0.8))


def test_predictive_control_gets_the_newest_attitude_and_the_estimated_wind():
    made, _ = estimate(prior_drag=Drag(), drag=Drag())
    rates = BodyRates(0.1, 0.2, 0.3)
    made.note_attitude(SAMPLE._replace(q=(0.8, 0.0, 0.6, 0.0), body_rates=rates))
    motion = VehicleMotion((1.0, 2.0, -3.0), (4.0, 5.0, 6.0))
    later = VehicleMotion((9.0, 9.0, 9.0), (9.0, 9.0, 9.0))
    drag = Drag(0.25, 0.03)
    inputs = GuidanceInput(
        motion, later, (7.0, 7.0), (0.5, -0.5), drag, (2.0, 18.0), AxisDrag(0.02, 0.5)
    )
    vehicle = made.vehicle(12.0, inputs)
    assert vehicle[:5] == (12.0, (1.0, 2.0, -3.0), (4.0, 5.0, 6.0), (0.8, 0.0, 0.6, 0.0), rates)
    assert vehicle[5:] == ((0.5, -0.5, 0.0), drag, 0.02)


@pytest.mark.parametrize(
    ("learned", "certain", "told"),
    [
        (Drag(0.4, 0.03), True, "at 5.0 m/s is 0.55 1/s, but 0.25 was assumed"),
        (Drag(0.4, 0.03), False, None),
        (Drag(0.0, 0.01), True, "at 5.0 m/s is 0.05 1/s, but 0.25 was assumed"),
        (Drag(0.39, 0.0), True, None),
    ],
)
def test_a_drag_that_is_far_off_is_told_with_the_keys_to_set(learned, certain, told):
    made, _ = estimate(prior_drag=Drag(0.25, 0.0), drag=learned, top_speed=5.0, certain=certain)
    warning = made.mismatch_warning()
    assert (warning is None) is (told is None)
    if told is not None:
        assert told in warning
        assert f"guidance.drag_per_s to {learned.linear:.2f}" in warning
        assert f"guidance.quadratic_drag_per_m to {learned.quadratic:.3f}" in warning
