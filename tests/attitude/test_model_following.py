"""`model-following` behind a rate loop with lag and dead time: straight, stable, within limits."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from companion.attitude import (
    BodyRates,
    InvalidQuaternionError,
    InvalidTargetError,
    Limits,
    Target,
    make_planner,
)
from tests.attitude.independent import attitudes, coefficients_of, headings_of, held, wrapped
from tests.attitude.lag_plant import LagPlant, SecondOrderPlant, fly
from tests.attitude.simulate import quaternion

START, GOAL = np.array([-0.4, -0.5]), np.array([0.4, -0.5])
HEADINGS = np.array([-2.6, -1.0, 0.0, 0.7, 3.0])
GAIN, LAG, DEAD_TIME = 5.0, 0.025, 0.045
SLOW_YAW = {"yaw_lag": 0.075, "yaw_dead_time": 0.17}
W_M = np.pi / 2


def following(lag=LAG, dead_time=DEAD_TIME, gain=GAIN, **options):
    return make_planner("model-following", gain, lag=lag, dead_time=dead_time, **options)


def per_axis(tilt, yaw):
    return [tilt, tilt, yaw]


def stepped(make, hz, turn=0.0, seconds=1.5, yaw_lag=LAG, yaw_dead_time=DEAD_TIME):
    """The step of figure 2 at every heading, which may have to turn by `turn` meanwhile."""
    targets = [Target(*GOAL, psi + turn) for psi in HEADINGS]
    plant = LagPlant(
        attitudes(START, HEADINGS), per_axis(LAG, yaw_lag), per_axis(DEAD_TIME, yaw_dead_time)
    )
    planners = [make() for _ in HEADINGS]
    return fly(planners, plant, lambda _: targets, round(seconds * hz), 1.0 / hz)


def cross_track(flight):
    return np.abs(flight.c[..., 1] + 0.5).max()


@pytest.mark.parametrize(("name", "measured"), [("first-order", 0.032), ("quaternion", 0.024)])
def test_the_plant_bends_the_other_planners_lines_as_known(name, measured):
    flight = stepped(lambda: make_planner(name, GAIN), 100)
    assert cross_track(flight) == pytest.approx(measured, rel=0.1)


@pytest.mark.parametrize(("hz", "most"), [(100, 0.0012), (250, 0.0006)])
def test_a_step_is_straight_at_every_heading(hz, most):
    flight = stepped(following, hz)
    assert cross_track(flight) <= most
    assert flight.c[-1] == pytest.approx(np.tile(GOAL, (len(HEADINGS), 1)), abs=5e-3)


def test_a_step_is_straight_with_lag_and_dead_time_wrongly_known():
    flight = stepped(lambda: following(1.5 * LAG, 0.7 * DEAD_TIME), 100)
    assert cross_track(flight) <= 0.002


@pytest.mark.parametrize("hz", [100, 250])
def test_a_step_is_straight_within_the_rate_limit(hz):
    flight = stepped(lambda: following(limits=Limits(max_tilt_rate=W_M)), hz)
    assert cross_track(flight) <= 0.001
    assert 0.99 * W_M <= flight.tilt_commands.max() <= 1.03 * W_M
    assert np.abs(wrapped(flight.heading - HEADINGS)).max() <= 1e-3


@pytest.mark.parametrize("acceleration", [5.0, 10.0])
def test_what_it_asks_changes_no_faster_than_the_autopilot_lets_it(acceleration):
    """So the autopilot's limit is never felt, and the line stays straight."""
    changes = []
    for most in (acceleration, np.inf):
        flight = stepped(
            lambda most=most: following(
                limits=Limits(max_tilt_rate=W_M),
                acceleration=most,
                frame_lead=0.0,  # the plant takes the rates along its own axes
            ),
            100,
        )
        asked = np.diff(flight.commands[..., :2], axis=0, prepend=0.0)
        changes.append(np.hypot(*np.moveaxis(asked, 2, 0)).max() * 100)
        assert cross_track(flight) <= 0.001
    assert 0.8 * acceleration <= changes[0] <= 1.1 * acceleration
    assert changes[1] >= 2.0 * acceleration  # the limit was felt


@pytest.mark.parametrize("yaw", [{}, SLOW_YAW], ids=["as-tilt", "slow-yaw"])
@pytest.mark.parametrize("turn", [0.0, 1.5, -3.0])
def test_a_step_is_straight_while_the_heading_moves(turn, yaw):
    flight = stepped(lambda: following(**yaw), 100, turn, **yaw)
    assert cross_track(flight) <= 0.0012


@pytest.mark.parametrize(("hz", "most"), [(100, 1e-3), (250, 3e-4)])
def test_the_response_is_the_model_one_dead_time_later(hz, most):
    flight = stepped(following, hz)
    lag = max(0.25 / GAIN, LAG)
    solved = solve_ivp(
        lambda _, s: [s[1], (GAIN * (GOAL[0] - s[0]) - s[1]) / lag],
        (0.0, 1.5),
        [START[0], 0.0],
        dense_output=True,
        rtol=1e-9,
    )
    model = solved.sol(np.maximum(flight.t - DEAD_TIME, 0.0))[0]
    assert np.abs(flight.c[..., 0] - model[:, None]).max() <= most


UNLIKE = {
    "quicker-pitch": ((0.073, 0.054), (0.057, 0.046)),
    "quicker-roll": ((0.03, 0.02), (0.045, 0.05)),
    "later-but-quicker": ((0.06, 0.015), (0.02, 0.06)),
}


@pytest.mark.parametrize("axes", UNLIKE.values(), ids=UNLIKE)
@pytest.mark.parametrize("turn", [0.0, 1.5])
def test_a_step_is_straight_where_roll_and_pitch_are_unlike(axes, turn):
    """Led each by its own response; by the mean of the two it is not."""
    (lag, dead_time), (pitch_lag, pitch_dead_time) = axes
    own = following(
        lag, dead_time, pitch_lag=pitch_lag, pitch_dead_time=pitch_dead_time, **SLOW_YAW
    )
    mean = following(0.5 * (lag + pitch_lag), 0.5 * (dead_time + pitch_dead_time), **SLOW_YAW)
    bent = []
    for planner in (own, mean):
        plant = LagPlant(
            attitudes(START, [0.7]),
            [lag, pitch_lag, SLOW_YAW["yaw_lag"]],
            [dead_time, pitch_dead_time, SLOW_YAW["yaw_dead_time"]],
        )
        flight = fly([planner], plant, lambda _: [Target(*GOAL, 0.7 + turn)], 150, 0.01)
        bent.append(cross_track(flight))
        assert flight.c[-1, 0] == pytest.approx(GOAL, abs=8e-3)
    assert bent[0] <= 0.0025
    assert bent[1] >= 4.0 * bent[0]


@pytest.mark.parametrize("turn", [0.0, 1.5])
@pytest.mark.parametrize("pitch", [(0.0745, 0.0085, 0.73), (0.055, 0.02, 0.9)])
def test_a_step_is_straight_behind_a_rate_loop_of_second_order(pitch, turn):
    """PX4's roll, and pitch as roll or unlike it; told as of first order it bends more."""
    roll, (lag, dead_time, damping) = (0.0745, 0.0085, 0.73), pitch
    told = {"pitch_lag": lag, "pitch_dead_time": dead_time, "pitch_damping": damping, **SLOW_YAW}
    as_first = {"pitch_lag": 0.63 * lag, "pitch_dead_time": dead_time + 0.4 * lag, **SLOW_YAW}
    bent = []
    for planner in (
        following(*roll[:2], damping=roll[2], **told),
        following(0.047, 0.04, **as_first),
    ):
        plant = SecondOrderPlant(
            attitudes(START, [0.7]),
            [roll[0], lag, SLOW_YAW["yaw_lag"]],
            [roll[1], dead_time, SLOW_YAW["yaw_dead_time"]],
            [roll[2], damping, 10.0],
        )
        flight = fly([planner], plant, lambda _: [Target(*GOAL, 0.7 + turn)], 350, 0.004)
        bent.append(cross_track(flight))
    assert bent[0] <= 0.0012
    assert bent[1] >= 2.0 * bent[0]


@pytest.mark.parametrize("max_tilt_rate", [W_M, np.radians(400)])
def test_a_rate_loop_of_second_order_is_asked_for_no_jerk(max_tilt_rate):
    """A large step of the command saturates the motors: so it rises by 400 °/s within a lag."""
    limits, lag, dt = Limits(max_tilt_rate=max_tilt_rate), 0.0745, 0.004
    planner = following(lag, 0.0085, damping=0.73, limits=limits, **SLOW_YAW)
    plant = SecondOrderPlant(attitudes(START, [0.7]), [lag] * 3, [0.0085] * 3, [0.73, 0.73, 10.0])
    flight = fly([planner], plant, lambda _: [Target(*GOAL, 0.7)], 100, dt)
    slopes = np.diff(flight.tilt_commands[:, 0], prepend=0.0) / dt
    assert 0.9 * np.radians(400) / lag < slopes.max() < 1.1 * np.radians(400) / lag


def test_uneven_samples_do_not_bend_the_line():
    rng = np.random.default_rng(8)
    plant = LagPlant(attitudes(START, [0.7]), [LAG] * 3, [DEAD_TIME] * 3)
    planner, passed, off = following(), 0.01, []
    for period in rng.uniform(0.004, 0.016, 120):
        rates = planner.rates(quaternion(plant.r[0]), Target(*GOAL, 0.7), passed)
        plant.hold([rates], period)
        passed = period
        off.append(coefficients_of(plant.r)[0, 1] + 0.5)
    assert np.abs(off).max() <= 0.0015


GRID = list(itertools.product((0.005, 0.045, 0.08), (0.01, 0.06), (2.0, 8.0)))
"""Dead time, lag, gain."""
WRONG = [(1.0, 1.0), (0.5, 0.5), (0.5, 1.5), (1.5, 0.5), (1.5, 1.5), (1.3, 0.7)]
"""What the planner believes of the lag and of the dead time."""


@pytest.mark.parametrize("hz", [50, 100, 250])
def test_stable_with_half_or_one_and_a_half_times_the_lag_and_the_dead_time(hz):
    cases = list(itertools.product(GRID, WRONG if hz < 250 else WRONG[1:2]))
    bounds = Limits(np.radians(40), W_M)
    planners = [
        following(lag * wrong_lag, dead * wrong_dead, gain, limits=bounds)
        for (dead, lag, gain), (wrong_lag, wrong_dead) in cases
    ]
    dead_times, lags = np.array([[case[0][:2]] * 3 for case in cases]).transpose(2, 0, 1)
    start, goal = (-0.5, 0.0), np.array([0.0, 0.5])
    plant = LagPlant(attitudes(start, np.zeros(len(cases))), lags, dead_times)
    flight = fly(planners, plant, lambda _: [Target(*goal, 0.0)] * len(cases), 3 * hz, 1.0 / hz)
    away = np.hypot(*np.moveaxis(flight.c - goal, 2, 0))
    assert away[-hz // 4 :].max() <= 6e-3  # e^(−2·2.75) of the way is left at the lowest gain
    assert np.hypot(*np.moveaxis(flight.c, 2, 0)).max() <= np.sin(np.radians(35))
    assert flight.tilt_commands.max() <= W_M * (1.0 + 1e-12)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0)])
@pytest.mark.parametrize("c", [(0.0, 0.0), (0.4, -0.3)])
def test_an_unforeseen_push_is_rejected_as_fast_as_by_first_order_without_overshoot(axis, c):
    """1 rad/s for 50 ms; how long until a tenth of the deviation is left for good."""
    took = []
    for planner in (following(), make_planner("first-order", GAIN)):
        plant = LagPlant(attitudes(c, [0.0]), [LAG] * 3, [DEAD_TIME] * 3)
        flight = fly(
            [planner],
            plant,
            lambda _: [Target(*c, 0.0)],
            200,
            0.01,
            lambda n: np.array(axis) * (10 <= n < 15),
        )
        away = np.column_stack([flight.c[:, 0] - c, flight.heading[:, 0]])
        peak = away[np.argmax(np.linalg.norm(away, axis=1))]
        along = away @ peak / (peak @ peak)
        assert along.min() >= -0.05
        took.append(np.nonzero(np.abs(along) > 0.1)[0][-1])
    assert took[0] <= took[1]


@pytest.mark.parametrize("c", [(0.0, 0.0), (0.4, -0.3), (-0.2, 0.6)])
@pytest.mark.parametrize("rates", [(0.5, 0.3, 0.2), (0.0, 0.0, 1.0), (-0.8, 0.4, 0.0)])
def test_started_in_motion_it_goes_on_with_it(rates, c):
    """The target lies where the model, at this speed, would neither speed up nor slow down."""
    r = attitudes(c, [1.0])
    h = 1e-6
    ahead = held(r, [rates], h)
    speed = (coefficients_of(ahead) - coefficients_of(r))[0] / h
    turn = (headings_of(ahead) - headings_of(r))[0] / h
    target = Target(
        *(c + speed * (DEAD_TIME + 1.0 / GAIN)), float(1.0 + turn * (DEAD_TIME + 1.0 / 2.0))
    )
    planner = following()
    planner.reset(quaternion(r[0]), BodyRates(*rates))
    first = np.array(planner.rates(quaternion(r[0]), target, 0.01))
    assert np.linalg.norm(first - rates) <= 0.12 * np.linalg.norm(rates)
    fresh = following().rates(quaternion(r[0]), target, 0.01, BodyRates(*rates))
    assert fresh == pytest.approx(first)


def test_reset_forgets():
    q = quaternion(attitudes(START, 0.2)[0])
    used, fresh = following(), following()
    for _ in range(30):
        used.rates(q, Target(*GOAL, 2.0), 0.01)
    used.reset(q)
    for _ in range(10):
        answer = used.rates(q, Target(*GOAL, 0.5), 0.01)
        assert answer == fresh.rates(q, Target(*GOAL, 0.5), 0.01)


def test_recovery_answers_as_first_order_and_ends_without_a_large_jump():
    bounds = Limits(np.radians(40), W_M, 2.0)
    planner, first_order = following(limits=bounds), make_planner("first-order", GAIN, 2.0, bounds)
    start = Rotation.from_rotvec([[2.6, 0.3, 0.4]])
    plant = LagPlant(start, [LAG] * 3, [DEAD_TIME] * 3)
    target, recovering, answers = Target(0.3, 0.2, 0.5), [], []
    for _ in range(400):
        q, body_rates = quaternion(plant.r[0]), BodyRates(*plant.rates[0])
        cosine = plant.r.as_matrix()[0, 2, 2]
        recovering.append(cosine < math.cos(math.radians(75.0)))
        answers.append(planner.rates(q, target, 0.01, body_rates))
        if recovering[-1]:
            assert answers[-1] == first_order.rates(q, target, 0.01)
        plant.hold([answers[-1]], 0.01)
    assert recovering[0]
    assert np.count_nonzero(np.diff(recovering)) == 1  # once below it stays below
    handover = recovering.index(False)
    jump = np.subtract(answers[handover], answers[handover - 1])
    assert np.hypot(*jump[:2]) <= 0.3
    assert coefficients_of(plant.r)[0] == pytest.approx((0.3, 0.2), abs=2e-3)


@pytest.mark.parametrize("turn", [1.5, -3.0, 4.0])
def test_a_heading_step_behind_a_slow_yaw_loop(turn):
    flight = stepped(lambda: following(**SLOW_YAW), 100, turn, seconds=4.0, **SLOW_YAW)
    short = float(wrapped(turn))
    gone = (flight.heading - flight.heading[0]) / short
    assert gone[-1] == pytest.approx(np.ones(len(HEADINGS)), abs=2e-3)
    assert gone.max() <= 1.05
    assert gone.min() >= -0.05


def test_a_heading_step_leaves_the_coefficients_alone():
    c = (0.4, -0.3)
    plant = LagPlant(attitudes(c, [0.0]), per_axis(LAG, 0.075), per_axis(DEAD_TIME, 0.17))
    flight = fly([following(**SLOW_YAW)], plant, lambda _: [Target(*c, 2.5)], 200, 0.01)
    assert np.abs(flight.c - c).max() <= 1e-6


@effort(max_examples=15, deadline=None)
@given(st.floats(-3.1, 3.1), st.sampled_from([0.0, 0.02]))
def test_like_axes_answer_alike_at_every_heading(heading, wait):
    """Turned with the vehicle the answer is the same; of unlike axes, by half a turn."""
    turn = math.pi if wait else heading
    told = {"damping": 0.7, "pitch_lag": LAG + wait, "pitch_dead_time": DEAD_TIME + wait}
    planner, turned = (following(**told, pitch_damping=0.7) for _ in range(2))
    for c in ((0.0, 0.0), (0.05, 0.1), (0.15, 0.1)):
        for _ in range(12):
            answers = []
            for each, angle in ((planner, 0.0), (turned, turn)):
                rotate = np.array(
                    [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
                )
                q = quaternion(attitudes(rotate @ c, [angle])[0])
                answers.append(each.rates(q, Target(*(rotate @ (0.3, -0.2)), angle), 0.01))
            assert answers[0] == pytest.approx(answers[1], abs=1e-9)


numbers = st.floats(-1.0, 1.0)
quaternions = (
    st.tuples(numbers, numbers, numbers, numbers)
    .filter(lambda v: math.hypot(*v) > 0.1)
    .map(lambda v: tuple(c / math.hypot(*v) for c in v))
)
samples_of = st.tuples(
    quaternions,
    st.builds(Target, st.floats(-2, 2), st.floats(-2, 2), st.floats(-9, 9), st.floats(-3, 3)),
    st.sampled_from([1e-300, 1e-9, 0.003, 0.01, 0.1, 5.0, 1e9]),
    st.one_of(st.none(), st.builds(BodyRates, *[st.floats(-30, 30)] * 3)),
)
delays = st.sampled_from([0.0, 0.004, 0.05, 0.4])
axes = st.fixed_dictionaries(
    {"lag": delays, "dead_time": delays, "pitch_lag": delays, "pitch_dead_time": delays},
    optional={"damping": st.floats(0.3, 10.0), "pitch_damping": st.floats(0.3, 10.0)},
)


@effort(max_examples=60, deadline=None)
@given(st.lists(samples_of, min_size=1, max_size=25), axes, st.floats(0.1, 20.0))
def test_whatever_comes_the_rates_are_finite_within_the_limits_and_those_of_minus_q(
    sequence, response, gain
):
    bounds = Limits(1.0, 2.0, 1.5)
    planner, opposite = (following(gain=gain, limits=bounds, **response) for _ in range(2))
    for q, target, dt, body_rates in sequence:
        rates = planner.rates(q, target, dt, body_rates)
        assert all(math.isfinite(rate) for rate in rates)
        assert math.hypot(rates.roll, rates.pitch) <= 2.0 * (1.0 + 1e-12)
        assert abs(rates.yaw) <= 1.5
        same = opposite.rates(tuple(-part for part in q), target, dt, body_rates)
        assert same == pytest.approx(rates, abs=1e-9)


def test_what_is_not_a_number_is_refused_and_not_remembered():
    q, target = (1.0, 0.0, 0.0, 0.0), Target(0.3, 0.2, 0.5)
    planner, other = following(), following()
    planner.rates(q, target, 0.01)
    other.rates(q, target, 0.01)
    with pytest.raises(InvalidQuaternionError):
        planner.rates((math.nan, 0.0, 0.0, 0.0), target, 0.01)
    with pytest.raises(InvalidTargetError):
        planner.rates(q, Target(0.3, math.nan, 0.5), 0.01)
    assert planner.rates(q, target, 0.01) == other.rates(q, target, 0.01)
    with pytest.raises(InvalidQuaternionError):
        planner.reset((0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", ["lag", "dead_time", "yaw_lag", "yaw_dead_time"])
@pytest.mark.parametrize("value", [-0.001, 1.5, math.nan, math.inf])
def test_a_response_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"^{name} must be"):
        following(**{name: value})


@pytest.mark.parametrize("rate", [math.nan, math.inf, -1e308])
@pytest.mark.parametrize("later", [False, True])
def test_rates_that_no_vehicle_has_are_not_taken_into_the_plan(rate, later):
    q, target, bad = quaternion(attitudes(START, 0.2)[0]), Target(*GOAL, 0.2), BodyRates(0, 0, rate)
    planner, other = following(), following()
    if later:
        planner.rates(q, target, 0.01)
        other.rates(q, target, 0.01)
    assert planner.rates(q, target, 0.01, bad) == other.rates(q, target, 0.01)
    planner.reset(q, bad)
    other.reset(q)
    assert planner.rates(q, target, 0.01) == other.rates(q, target, 0.01)


def test_a_turn_that_was_not_foreseen_bends_the_line_less_where_its_rate_is_measured():
    """A gust turns the vehicle at 2 rad/s in the middle of the step."""
    bent = []
    for measured in (True, False):
        plant = LagPlant(attitudes(START, [0.7]), per_axis(LAG, 0.3), per_axis(DEAD_TIME, 0.17))
        planner, off = following(yaw_lag=0.3, yaw_dead_time=0.17), []
        for n in range(100):
            rates = BodyRates(*plant.true_rates[0]) if measured else None
            asked = planner.rates(quaternion(plant.r[0]), Target(*GOAL, 0.7), 0.01, rates)
            plant.hold([asked], 0.01, np.array([0.0, 0.0, 2.0]) * (10 <= n < 30))
            off.append(coefficients_of(plant.r)[0, 1] + 0.5)
        bent.append(np.abs(off).max())
    assert bent[0] <= 0.5 * bent[1]
