"""The correction against an estimator that follows its GPS too slowly, integrated independently."""

from math import cos, hypot, isfinite, pi, sin, sqrt
from random import Random
from statistics import mean

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from companion.guidance.position_correction import CorrectionSettings, PositionCorrection
from companion.guidance.reference import VehicleMotion

SETTINGS = CorrectionSettings(0.7, 0.1, 0.2, position_delay=0.0, output_delay=0.0)
DT = 0.02
RATE = 0.4
"""Of how the estimator's velocity wanders, rad/s."""
metres = st.floats(-1e4, 1e4)
pairs = st.tuples(metres, metres)


def wandering(seconds, position_delay=0.0):
    """(time, true north, measured motion) at 5 m/s north, with a velocity that is off by 6 cm/s.

    The filter pulls its position to GPS, which comes `position_delay` s too late, with a gain of
    1/ahead.
    """
    north, rows = -position_delay * 5.0, []
    for n in range(round(seconds / DT)):
        time = n * DT
        velocity = 5.0 + 0.06 * cos(RATE * time)
        rows.append((time, 5.0 * time, VehicleMotion((north, 3.0, -5.0), (velocity, 0.0, 0.0))))
        gps = 5.0 * (time - position_delay)
        north += DT * (velocity + (gps - north) / SETTINGS.estimator_time)
    return rows


def errors(settings, position_delay=0.0):
    """The largest errors of a position after 5 s: as measured, and corrected; m."""
    correction, measured_off, off = PositionCorrection(settings), 0.0, 0.0
    for time, truth, measured in wandering(40.0, position_delay):
        found = correction.corrected_motion(time, measured)
        assert found.position_ned[1:] == pytest.approx((3.0, -5.0))
        assert found.velocity_ned == measured.velocity_ned
        if time > 5.0:
            measured_off = max(measured_off, abs(measured.position_ned[0] - truth))
            off = max(off, abs(found.position_ned[0] - truth))
    return measured_off, off


def test_what_the_estimator_has_still_to_correct_is_taken_ahead():
    before, after = errors(SETTINGS)
    assert before >= 0.035
    assert after <= 0.25 * before


def test_a_known_position_delay_is_made_up_for():
    late = CorrectionSettings(0.7, 0.1, 0.2, position_delay=0.02, output_delay=0.0)
    before, after = errors(late, position_delay=0.02)
    assert before >= 0.12
    assert after <= 0.015


@pytest.mark.parametrize("filter_time", [0.04, 0.1])
@pytest.mark.parametrize("period", [3.0, 6.0])
def test_in_a_figure_eight_a_late_position_is_made_up_for(filter_time, period):
    """The filter's position errs by e, ė = −(e + τ·v)/T, and e shows 0.25 s later.

    Taken to be late by τ now, the position of a real ArduPilot was off by twice as much.
    """
    estimator_time, position_delay, output_delay, dt = 0.5, 0.02, 0.3, 0.02
    knowing, unknowing = (
        PositionCorrection(
            CorrectionSettings(estimator_time, filter_time, 0.2, position_delay, known_delay)
        )
        for known_delay in (output_delay, 0.0)
    )
    angular_rate, error, shown = 2.0 * pi / period, 0.0, []
    off = {knowing: 0.0, unknowing: 0.0}
    for n in range(round(20.0 / dt)):
        angle = angular_rate * n * dt
        north, velocity = 8.0 / angular_rate * sin(angle), 8.0 * cos(angle)
        shown.append(error)
        error -= dt * (error + position_delay * velocity) / estimator_time
        told = north + shown[max(0, n - round(output_delay / dt))]
        measured = VehicleMotion((told, 0.0, 0.0), (velocity, 0.0, 0.0))
        for correction, most in off.items():
            found = correction.corrected_motion(n * dt, measured).position_ned[0]
            if n * dt > 8.0:
                off[correction] = max(most, abs(found - north))
    assert off[knowing] <= 0.65 * off[unknowing]
    assert off[knowing] <= (0.25 if filter_time < 0.05 else 0.4) * position_delay * 8.0


def test_north_and_east_are_corrected_alike_and_down_is_left_alone():
    late = CorrectionSettings(0.7, 0.1, 0.2, position_delay=0.02, output_delay=0.1)
    northwards, eastwards = PositionCorrection(late), PositionCorrection(late)
    for time, _, ((north, east, down), (speed, _, _)) in wandering(2.0, position_delay=0.02):
        sinking = 0.5 + time
        there = VehicleMotion((north, east, down), (speed, -1.0, sinking))
        swapped = VehicleMotion((east, north, down), (-1.0, speed, sinking))
        (n, e, d), velocity = northwards.corrected_motion(time, there)
        assert velocity == there.velocity_ned
        assert d == down
        assert eastwards.corrected_motion(time, swapped).position_ned == (e, n, d)


def test_other_settings_count_from_the_next_position_on():
    late = CorrectionSettings(0.7, 0.1, 0.2, position_delay=0.02, output_delay=0.0)
    retuned, kept = PositionCorrection(SETTINGS), PositionCorrection(SETTINGS)
    rows = wandering(6.0)
    for time, _, measured in rows[:200]:
        assert retuned.corrected_motion(time, measured) == kept.corrected_motion(time, measured)
    retuned.retune(late)
    for time, _, measured in rows[200:]:
        (north, east, down), velocity = kept.corrected_motion(time, measured)
        later = (north + late.position_delay * velocity[0], east, down)
        assert retuned.corrected_motion(time, measured).position_ned == pytest.approx(later)


def test_at_rest_nothing_changes():
    late = CorrectionSettings(0.7, 0.1, 0.2, position_delay=0.05, output_delay=0.3)
    correction = PositionCorrection(late)
    rest = VehicleMotion((3.0, -2.0, -5.0), (0.0, 0.0, 0.0))
    for n in range(100):
        assert correction.corrected_motion(n * DT, rest) == rest


def test_a_gap_and_a_reset_begin_anew():
    correction = PositionCorrection(SETTINGS)
    away = VehicleMotion((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    correction.corrected_motion(0.0, VehicleMotion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert correction.corrected_motion(DT, away).position_ned[0] > 1.0
    assert correction.corrected_motion(5.0, away) == away
    correction.corrected_motion(5.0 + DT, VehicleMotion((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    correction.reset()
    assert correction.corrected_motion(5.0 + 2.0 * DT, away) == away


def noisy(metres, speed, seconds=20.0, seed=3):
    """The correction at a speed (m/s), and the errors it adds (m), with white position noise."""
    quick = CorrectionSettings(0.5, 0.04, 0.2, position_delay=0.0, output_delay=0.3)
    correction, random, added = PositionCorrection(quick), Random(seed), []
    for n in range(round(seconds / DT)):
        north = speed * n * DT + random.gauss(0.0, metres)
        found = correction.corrected_motion(
            n * DT, VehicleMotion((north, 0.0, 0.0), (speed, 0.0, 0.0))
        )
        added.append(abs(found.position_ned[0] - north))
    return correction, added


def test_noise_of_the_positions_lengthens_the_filters():
    smooth, little = noisy(1e-4, speed=3.0)
    assert smooth.trust == 1.0
    assert max(little) <= 2e-3
    rough, added = noisy(0.02, speed=3.0)
    assert rough.trust == 0.0
    assert max(added[50:]) <= 0.12  # unfiltered: 0.5 s · √2·0.02 m / 0.02 s, about 0.7 m rms


@pytest.mark.parametrize("slip", [-0.001, 0.001])
def test_a_stamp_that_slips_by_a_millisecond_hardly_moves_the_position(slip):
    """As on ArduPilot. Unlimited, these 5 mm become a correction of 28 mm."""
    quick = CorrectionSettings(0.5, 0.04, 0.2, position_delay=0.0, output_delay=0.3)
    correction, added = PositionCorrection(quick), []
    for n in range(200):
        time = n * DT + (slip if n >= 100 else 0.0)
        measured = VehicleMotion((5.0 * n * DT, 0.0, 0.0), (5.0, 0.0, 0.0))
        added.append(correction.corrected_motion(time, measured).position_ned[0] - 5.0 * n * DT)
    assert max(map(abs, added)) <= 0.01


def test_at_rest_the_positions_are_trusted_less_and_filtered_more():
    assert [noisy(1e-4, speed)[0].trust for speed in (0.0, 1.0, 2.0)] == [0.0, 0.5, 1.0]
    added = {speed: sqrt(mean(a * a for a in noisy(0.001, speed)[1])) for speed in (0.0, 3.0)}
    assert added[0.0] <= 0.6 * added[3.0]


@example([(0.0, (0.0, 1.0), (0.0, 0.0)), (1e-265, (0.0, 0.0), (0.0, 0.0))])
@given(st.lists(st.tuples(st.floats(-1.0, 1.0), pairs, pairs), min_size=1, max_size=30))
def test_it_is_bounded_whatever_comes(rows):
    correction, time = PositionCorrection(SETTINGS), 0.0
    for dt, place, speed in rows:
        time += dt
        measured = VehicleMotion((*place, 0.0), (*speed, 0.0))
        north, east, _ = correction.corrected_motion(time, measured).position_ned
        assert isfinite(north + east)
        assert hypot(north - place[0], east - place[1]) <= 0.2 * (1.0 + 1e-9) + 1e-9


def test_a_turning_vehicle_without_errors_is_left_alone():
    correction, most = PositionCorrection(SETTINGS), 0.0
    for n in range(1000):
        a = n * DT
        place = (5.0 * cos(a), 5.0 * sin(a), 0.0)
        speed = (-5.0 * sin(a), 5.0 * cos(a), 0.0)
        found = correction.corrected_motion(a, VehicleMotion(place, speed))
        off = hypot(found.position_ned[0] - place[0], found.position_ned[1] - place[1])
        most = max(most, off)
    assert most <= 1e-3
