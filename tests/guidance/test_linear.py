"""Linear guidance against a point mass behind the linear inner response it is made for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import Coefficients
from companion.drag import ROUND_BODY, AxisDrag, Drag
from companion.guidance import (
    GRAVITY,
    IMMEDIATE,
    GuidanceInput,
    HeightGains,
    InnerResponse,
    LinearGuidance,
    LinearSettings,
    Reference,
    VehicleMotion,
    Weights,
    horizontal_gains,
)
from companion.guidance.feedback import HorizontalGains
from companion.guidance.reference import HorizontalMode, TiltCommand, VerticalMode
from companion.guidance.thrust import specific_thrust

REST = (0.0, 0.0, 0.0)
THRUST = 2.0, 18.0  # m/s²
DRAG = Drag(0.5)
TILT = InnerResponse(5.0, 0.05, 0.05, follows_model=True)
SETTINGS = LinearSettings(
    gains=horizontal_gains(Weights(40.0, 8.0), TILT.effective_delay, DRAG.linear),
    height=HeightGains(1.5, 3.5, 2.0, 1.0),
    tilt=TILT,
    heading=InnerResponse(2.0, 0.3, 0.1, follows_model=True),
    max_horizontal_acceleration=9.0,
    thrust_lag=0.05,
)
DT = 0.002
numbers = st.floats(-200, 200)


def acceleration(target, down):
    """World acceleration, but for drag, at the commanded tilt with the commanded height thrust."""
    sine = math.hypot(target.north, target.east)
    thrust = specific_thrust(down, math.sqrt(1 - sine * sine))
    return np.array([thrust * target.north, thrust * target.east, down])


def circling(time):
    """5 m, 1 rad/s, with the heading along the path."""
    s, c = math.sin(time), math.cos(time)
    return Reference(
        (5.0 * s, 5.0 - 5.0 * c, -5.0), (5.0 * c, 5.0 * s, 0.0), (-5.0 * s, 5.0 * c, 0.0), time, 1.0
    )


def flown(settings, reference_at, seconds, wind=REST, start=None, has=ROUND_BODY, told=ROUND_BODY):
    """(S, 2) position errors of a point mass whose coefficients follow the inner response.

    It `has` a drag along its axes; guidance is `told` of another.
    """
    guidance, response = LinearGuidance(settings), TILT
    late = round(response.dead_time / DT)
    begin = start or reference_at(0.0)
    p, v = np.array(begin.position_ned), np.array(begin.velocity_ned)
    wind, c, speed, asked, errors = np.array(wind), np.zeros(2), np.zeros(2), [], []
    for n in range(round(seconds / DT)):
        t = n * DT
        thrust = GRAVITY * c / math.sqrt(1.0 - c @ c)
        motion = VehicleMotion(tuple(p), tuple(v))
        ahead = guidance.effect_delay
        known = np.array([*thrust, 0.0]) + DRAG.linear * (wind - v)
        known[:2] -= has.deceleration(v[0], v[1])
        acts = VehicleMotion(
            tuple(p + ahead * v + 0.5 * ahead**2 * known), tuple(v + ahead * known)
        )
        situation = GuidanceInput(
            motion, acts, tuple(thrust), tuple(DRAG.linear * wind[:2]), DRAG, THRUST, told
        )
        target, _, down = guidance.command(reference_at, t, situation)
        asked.append((target.north, target.east))
        wanted = np.array(asked[max(0, len(asked) - 1 - late)])
        speed = speed + DT * (response.gain * (wanted - c) - speed) / response.lag
        c = c + DT * speed
        v = v + DT * np.array([*known[:2], down])
        p = p + DT * v
        errors.append((p - reference_at(t + DT).position_ned)[:2])
    return np.array(errors)


def test_a_circle_is_followed_without_lag():
    errors = np.hypot(*flown(SETTINGS, circling, 12.0)[-3000:].T)
    assert errors.max() <= 0.01  # Euler's steps of 2 ms
    late = replace(SETTINGS, tilt=IMMEDIATE)
    assert np.hypot(*flown(late, circling, 12.0)[-3000:].T).max() >= 0.2


def test_thrust_wind_and_both_drags_add_up_to_the_acceleration():
    """By hand, at 5 m/s: 0.5·v and 0.1·(|v_i| − 0.85·5)·v_i along north and east."""
    motion = VehicleMotion(REST, (3.0, 4.0, 1.0))
    wind = (0.5, -0.25)
    inputs = GuidanceInput(motion, motion, (1.0, 2.0), wind, Drag(0.5), THRUST, AxisDrag(0.1))
    drag = (1.5 - 0.375, 2.0 - 0.1)
    assert inputs.deceleration(motion.velocity_ned) == pytest.approx(drag, abs=0.005)
    assert inputs.acceleration == pytest.approx((1.5 - drag[0], 1.75 - drag[1]), abs=0.005)


def test_drag_along_the_axes_is_fed_forward():
    has = AxisDrag(0.06, 0.4)
    known, unknown = (
        np.hypot(*flown(SETTINGS, circling, 12.0, has=has, told=told)[-3000:].T).max()
        for told in (has, ROUND_BODY)
    )
    assert known <= 0.012
    assert unknown >= 3.0 * known


def test_a_known_wind_moves_it_off_no_more_than_for_a_moment():
    errors = np.hypot(*flown(SETTINGS, lambda _: Reference((0.0, 0.0, -5.0)), 8.0, (6.0, 2.0, 0)).T)
    assert 0.01 <= errors.max() <= 0.3
    assert errors[-500:].max() <= 1e-3


def test_it_comes_from_elsewhere_within_the_speed_limits_of_height():
    goal = Reference((4.0, -3.0, -20.0), heading=0.3)
    errors = flown(SETTINGS, lambda _: goal, 15.0, start=Reference((0.0, 0.0, -20.0)))
    assert np.abs(errors[-1]).max() <= 1e-3
    guidance = LinearGuidance(SETTINGS)
    motion = VehicleMotion((4.0, -3.0, -5.0), REST)
    for _ in range(3000):
        situation = GuidanceInput(motion, motion, (0.0, 0.0), (0.0, 0.0), DRAG, THRUST)
        target, _, down = guidance.command(lambda _: goal, 0.0, situation)
        speed = motion.velocity_ned[2] + 0.01 * down
        motion = VehicleMotion(
            (4.0, -3.0, motion.position_ned[2] + 0.01 * speed), (0.0, 0.0, speed)
        )
        assert -2.05 <= speed <= 1.05
        assert target.heading == pytest.approx(0.3)
    assert motion.position_ned[2] == pytest.approx(-20.0, abs=0.01)


@given(
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers),
    st.tuples(numbers, numbers),
)
def test_every_command_can_be_flown(position, velocity, thrust, disturbance):
    motion = VehicleMotion(position, velocity)
    situation = GuidanceInput(motion, motion, thrust, disturbance, DRAG, THRUST)
    target, _, down = LinearGuidance(SETTINGS).command(lambda _: Reference(REST), 0.0, situation)
    a = acceleration(target, down)
    assert np.hypot(a[0], a[1]) <= SETTINGS.max_horizontal_acceleration * (1 + 1e-9)
    assert abs(down) <= 0.5 * GRAVITY
    assert math.hypot(GRAVITY - down, *a[:2]) <= 18.0 * (1 + 1e-9)
    assert math.hypot(target.north, target.east) < 1.0


def test_open_loop_coefficients_pass_unchanged_while_height_is_held():
    reference = Reference((0.0, 0.0, -5.0), horizontal=TiltCommand(Coefficients(0.2, -0.1)))
    motion = VehicleMotion((7.0, 7.0, -4.0), (3.0, 3.0, 0.0))
    situation = GuidanceInput(motion, motion, (0.0, 0.0), (1.0, 1.0), DRAG, THRUST)
    target, _, down = LinearGuidance(SETTINGS).command(lambda _: reference, 0.0, situation)
    assert (target.north, target.east) == (0.2, -0.1)
    assert down < 0.0


@pytest.mark.parametrize("climb", [-1.5, 0.5])
def test_thrust_balances_the_drag_of_climb_and_descent_where_the_height_is_held(climb):
    reference = Reference((0.0, 0.0, -5.0), (3.0, 0.0, climb))
    motion, drag = VehicleMotion(*reference[:2]), Drag(0.8, 0.1)
    situation = GuidanceInput(motion, motion, (0.0, 0.0), (0.0, 0.0), drag, THRUST)

    def down(reference):
        return (
            LinearGuidance(SETTINGS).command(lambda _: reference, 0.0, situation).acceleration_down
        )

    assert down(reference) == pytest.approx((0.8 + 0.1 * math.hypot(3.0, climb)) * climb)
    assert down(reference._replace(vertical=VerticalMode.ACCELERATION)) == 0.0


def test_by_acceleration_alone_it_asks_for_what_holds_against_the_wind_wherever_it_is():
    motion = VehicleMotion((7.0, 7.0, -5.0), (3.0, 3.0, 0.0))
    situation = GuidanceInput(motion, motion, (0.5, 0.5), (1.0, -0.5), DRAG, THRUST)
    reference = Reference((0.0, 0.0, -5.0), horizontal=HorizontalMode.ACCELERATION)
    target, later, down = LinearGuidance(SETTINGS).command(lambda _: reference, 0.0, situation)
    assert acceleration(target, down)[:2] == pytest.approx([-1.0, 0.5])
    assert later == target


def test_trimmed_steps_are_added_to_the_mean_of_the_pause_just_before_them():
    guidance, motion = LinearGuidance(SETTINGS), VehicleMotion((0.0, 0.0, -5.0), REST)

    def target(wind, horizontal=HorizontalMode.POSITION):
        inputs = GuidanceInput(motion, motion, (0.0, 0.0), wind, DRAG, THRUST)
        reference = Reference(motion.position_ned, horizontal=horizontal)
        return np.array(guidance.command(lambda _: reference, 0.0, inputs).target[:2])

    def pause(wind):
        return target(wind, HorizontalMode.ACCELERATION)

    def step(wind, *, trimmed=True):
        return target(wind, TiltCommand(Coefficients(0.2, -0.1), trimmed))

    strong = (3.0, 3.0)
    assert step(strong) == pytest.approx([0.2, -0.1])  # no pause came before
    pause(strong)
    target(strong)  # the hold goes on: the pause that follows is another one
    mean = 0.5 * (pause((0.2, 0.4)) + pause((0.4, 0.2)))
    assert mean == pytest.approx([-0.3 / GRAVITY] * 2, rel=2e-3)
    for _ in range(2):
        assert step(strong) == pytest.approx(np.add([0.2, -0.1], mean))
    assert step(strong, trimmed=False) == pytest.approx([0.2, -0.1])
    again = pause((-0.2, 0.0))
    assert step(strong) == pytest.approx(np.add([0.2, -0.1], again))


def test_the_heading_is_asked_for_ahead_of_its_response():
    motion = VehicleMotion(circling(2.0).position_ned, circling(2.0).velocity_ned)
    situation = GuidanceInput(motion, motion, (0.0, 0.0), (0.0, 0.0), DRAG, THRUST)
    target, _, _ = LinearGuidance(SETTINGS).command(circling, 2.0, situation)
    assert (target.heading, target.heading_rate) == pytest.approx((2.1, 1.0))


def test_without_feedback_the_later_target_is_the_one_of_a_period_later():
    settings = replace(SETTINGS, period=0.02, gains=HorizontalGains(0.0, 0.0, 0.0))
    motion = VehicleMotion(circling(2.0).position_ned, circling(2.0).velocity_ned)
    situation = GuidanceInput(motion, motion, (0.0, 0.0), (0.0, 0.0), DRAG, THRUST)
    guidance = LinearGuidance(settings)
    before, later, _ = guidance.command(circling, 2.0, situation)
    then = guidance.command(circling, 2.02, situation).target
    assert later == pytest.approx(then, abs=1e-3)
    assert math.hypot(later.north - before.north, later.east - before.east) >= 0.008


def test_an_open_loop_step_does_not_move():
    step = Reference((0.0, 0.0, -5.0), horizontal=TiltCommand(Coefficients(0.2, -0.1)))
    situation = GuidanceInput(
        VehicleMotion(REST, REST), VehicleMotion(REST, REST), (0.0, 0.0), (0.0, 0.0), DRAG, THRUST
    )
    target, later, _ = LinearGuidance(replace(SETTINGS, period=0.02)).command(
        lambda _: step, 0.0, situation
    )
    assert target == later
