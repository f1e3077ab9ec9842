"""What `make real` measures, on motion that is known."""

import numpy as np
import pytest

from companion.attitude import attitude
from companion.attitude.types import Coefficients
from tests.real.measures import (
    maneuvers,
    resting,
    split_error,
    straightness,
    tracking_errors,
)
from tests.real.truth import NoTruthError, Truth, multiplied, truth_from

RADIUS, SPEED, RAMP, LAP = 5.0, 5.0, 5.0, 2.0 * np.pi
"""m, m/s, s, s."""


def circle(time):
    """Rest, a circle whose speed rises and falls over RAMP, and rest again: positions (n, 3)."""
    began, length = 3.0, 3.0 * LAP * SPEED
    duration = length / SPEED + RAMP
    at = np.clip(time - began, 0.0, duration)
    eased = lambda t: 0.5 * SPEED * (t - RAMP / np.pi * np.sin(np.pi * t / RAMP))  # noqa: E731
    way = np.where(
        at < RAMP,
        eased(np.minimum(at, RAMP)),
        np.where(
            at > duration - RAMP,
            length - eased(np.minimum(duration - at, RAMP)),
            SPEED * (at - 0.5 * RAMP),
        ),
    )
    angle = way / RADIUS
    zero = np.zeros_like(angle)
    return np.column_stack([RADIUS * (1.0 - np.cos(angle)), RADIUS * np.sin(angle), zero])


def flight(*, truth_late=0.0, wrong=0.0, origin=(0.0, 0.0, 0.0)):
    """Tracking rows, positions told and the truth of a vehicle that flies `wrong` m outside."""
    time = np.arange(0.0, 32.0, 0.02)
    stretched = 1.0 + wrong / RADIUS
    tracking = np.column_stack([time, circle(time), circle(time - 0.004)])
    told = np.arange(-1.0, 33.0, 0.02)
    positions = np.column_stack([told, circle(told - truth_late - 0.01)])
    true = np.arange(-1.0, 33.0, 0.004)
    centre = np.array([RADIUS, 0.0, 0.0])
    where = centre + stretched * (circle(true - truth_late) - centre) + np.array(origin)
    return (
        tracking,
        positions,
        truth_from(
            np.column_stack([true, where]),
            np.column_stack([true, np.tile([1.0, 0, 0, 0], (len(true), 1))]),
        ),
    )


def test_steady_state_leaves_out_the_gathering_of_speed_and_the_braking():
    tracking, _, _ = flight()
    moving, calm = maneuvers(tracking)
    time = tracking[:, 0]
    (part,) = moving
    # Full speed from 8 s to 21.8 s; the raised cosine is within 1 % of it for 0.3 s more.
    assert time[part.start] == pytest.approx(8.0 - 0.32 + 1.0, abs=0.05)
    assert time[part.stop - 1] == pytest.approx(3.0 + 3.0 * LAP + 0.32, abs=0.05)
    assert len(calm) == 2
    assert time[calm[0].start] == pytest.approx(2.0, abs=0.03)


def test_a_late_vehicle_is_late_along_the_path():
    tracking, positions, truth = flight(truth_late=0.012)
    errors = tracking_errors(tracking, positions, truth)["moving"][0]
    assert errors["truth"]["late_ms"] == pytest.approx(12.0, abs=0.2)
    assert errors["truth"]["along"] == pytest.approx(0.060, abs=0.001)
    assert errors["truth"]["across"] < 0.001
    assert errors["telemetry"]["late_ms"] == pytest.approx(22.0, abs=0.2)
    assert errors["program"]["late_ms"] == pytest.approx(4.0, abs=0.2)
    assert errors["estimator"]["late_ms"] == pytest.approx(10.0, abs=0.2)


def test_a_constant_distance_between_the_frames_is_no_error():
    tracking, positions, truth = flight(origin=(120.0, -40.0, 7.0))
    errors = tracking_errors(tracking, positions, truth)["moving"][0]
    assert errors["truth"]["rms"] < 0.003


def test_a_wider_circle_is_an_error_across():
    tracking, positions, truth = flight(wrong=0.05)
    errors = tracking_errors(tracking, positions, truth)["moving"][0]
    assert errors["truth"]["across"] == pytest.approx(0.05, abs=0.004)


def test_height_counts_by_itself():
    rows = np.tile([0.0, 0.0, 0.2], (10, 1))
    split = split_error(rows, np.tile([1.0, 0.0, 0.0], (10, 1)))
    assert split["height"] == split["rms"] == 0.2
    assert split["along"] == split["across"] == 0.0


def test_a_hole_in_the_truth_is_told():
    tracking, positions, truth = flight()
    kept = (truth.time < 10.0) | (truth.time > 10.3)
    holed = Truth(truth.time[kept], truth.position[kept], truth.q_time, truth.q)
    with pytest.raises(NoTruthError, match=r"hole of 0\.3"):
        tracking_errors(tracking, positions, holed)


NOTHING_ADDED = np.zeros(2)


def step_rows(*, bent, turn=0.0, every=0.004, late=0.0):
    """Response rows of one step by telemetry, and the truth, which is `bent` off the line."""
    gain, before, after = 4.0, np.array([0.4, 0.5]), np.array([-0.4, 0.5])

    def path(time):
        share = np.where(time < 0.5, 0.0, 1.0 - np.exp(-gain * np.maximum(time - 0.5, 0.0)))
        on = before + share[:, None] * (after - before)
        return on - np.outer(bent * 4.0 * share * (1.0 - share), [0.0, 1.0])

    time = np.arange(0.0, 2.5, 0.004)
    rows = np.array(
        [
            [t, *attitude(Coefficients(*c), 0.3), *(before if t < 0.5 else after)]
            for t, c in zip(time, path(time - late), strict=True)
        ]
    )
    at = np.arange(-0.1, 2.6, every)
    q = np.array([attitude(Coefficients(*c), 0.3) for c in path(at)])
    about = np.array([[np.cos(turn / 2.0), 0.0, 0.0, np.sin(turn / 2.0)]])
    truth = truth_from(
        np.column_stack([at, np.zeros((len(at), 3))]), np.column_stack([at, multiplied(about, q)])
    )
    return rows, truth


@pytest.mark.parametrize("every", [0.004, 0.04])
def test_the_distance_from_the_line_is_that_of_the_true_attitude(every):
    told, _ = step_rows(bent=0.0)
    _, truth = step_rows(bent=0.03, turn=0.05, every=every)
    figures = straightness(told, told[:, 1:5], truth, 4.0, NOTHING_ADDED)
    assert figures["telemetry"] < 0.001
    # The target is reached up to exp(-8), so the line is that of the step.
    assert figures["truth"] == pytest.approx(0.03, abs=0.0015)
    assert figures["heading_off_deg"] == pytest.approx(-np.degrees(0.05), abs=0.1)


def late_ms(rows, truth):
    return straightness(rows, rows[:, 1:5], truth, 4.0, NOTHING_ADDED)["attitude_late_ms"]


def test_late_telemetry_is_told():
    rows, truth = step_rows(bent=0.01, late=0.006)
    assert late_ms(rows, truth) == pytest.approx(6.0, abs=0.2)


def test_what_was_added_to_balance_a_tilted_estimate_is_no_target_in_the_world():
    rows, truth = step_rows(bent=0.0)
    rows[:, 5:7] += [0.0, 0.004]
    added = np.array([0.0, 0.004])
    figures = straightness(rows, rows[:, 1:5], truth, 4.0, added)
    assert figures["truth"] == pytest.approx(0.0, abs=2e-4)
    assert figures["telemetry"] == pytest.approx(0.004, abs=4e-4)
    corners = np.array([[n + 0.01, e - 0.02] for n in (-0.4, 0.4) for e in (-0.5, 0.5)])
    everything = np.zeros((12, 7))
    everything[:, 5:7] = np.repeat(corners, 3, axis=0)
    assert resting(everything) == pytest.approx([0.01, -0.02])
