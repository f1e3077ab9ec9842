"""Where the plan of `model-following` stood, and where it goes on to."""

import pytest

from companion.attitude.history import PlannedTilt, PlannedYaw, PlanSeries, SampleHold

MOTION = PlannedYaw(-1.0, 4.0, 0.5)


def test_before_its_start_and_beyond_its_end_it_moves_evenly():
    past = PlanSeries(0.1)
    past.start(0.0, PlannedYaw(2.0, 0.0, 3.0), MOTION)
    assert past.at(-0.05) == pytest.approx((2.05, -0.2, 2.975))
    assert past.at(-0.2) == pytest.approx((2.2, -0.8, 2.9))
    assert past.at(0.02) == pytest.approx((1.98, 0.08, 3.01))


def test_it_is_linear_between_its_rows_and_beyond_the_newest():
    past = PlanSeries(0.1)
    past.start(0.0, PlannedYaw(0.0, 1.0, 2.0), MOTION)
    for n in range(1, 301):
        past.add(0.01 * n, PlannedYaw(1.0 + n, 2.0 - n, 3.0 + n * n))
    square = 0.5 * (295**2 + 296**2)
    assert past.at(2.955) == pytest.approx((296.5, -293.5, 3.0 + square))
    assert past.at(2.9) == pytest.approx((291.0, -288.0, 3.0 + 290**2))
    assert past.at(3.005)[:2] == pytest.approx((301.5, -298.5))
    assert past.newest == past.at(3.0)


def test_it_remembers_its_span_and_not_much_more():
    past = PlanSeries(0.1)
    past.start(0.0, PlannedTilt(*[0.0] * 8), PlannedTilt(*[1.0] * 8))
    for n in range(1, 10_001):
        past.add(0.001 * n, PlannedTilt(*[float(n)] * 8))
    assert past.at(10.0 - 0.1).north == pytest.approx(9900.0)
    assert len(past._plans) == len(past._times) < 300


def test_starting_again_forgets():
    past = PlanSeries(0.1)
    past.start(0.0, PlannedYaw(*[9.0] * 3), MOTION)
    past.add(0.01, PlannedYaw(*[9.0] * 3))
    past.start(0.0, PlannedYaw(*[1.0] * 3), PlannedYaw(*[0.0] * 3))
    assert past.at(-0.07) == past.at(0.0) == past.at(0.01) == PlannedYaw(*[1.0] * 3)


@pytest.mark.parametrize("dt", [0.004, 0.01, 0.012, 0.019, 0.05])
def test_what_was_turned_wrong_until_a_sample_came_is_made_up_by_the_next_rates(dt):
    """Too late or too early by at most a period: the old rates were held, and not the planned."""
    hold = SampleHold()
    hold.note_sample(0.01)
    assert hold.rates(1.0, -2.0) == (1.0, -2.0)
    hold.note_sample(dt)
    late = dt - 0.01
    assert hold.lateness == pytest.approx(late)
    assert hold.period == pytest.approx(0.01 + 0.05 * min(late, 0.01))
    assert hold.plan_dt == pytest.approx(hold.period + late)
    roll, pitch = hold.rates(3.0, 5.0)
    counted = min(late, hold.period)
    assert hold.period * (roll - 3.0) == pytest.approx(counted * (3.0 - 1.0))
    assert hold.period * (pitch - 5.0) == pytest.approx(counted * (5.0 - -2.0))
