"""`model-following` on an autopilot that takes the rates along an attitude target, as ArduPilot."""

import math
from math import inf, nan

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Limits, Target, make_planner
from companion.attitude.rate_response import AxisResponse, RateLoopResponse
from companion.attitude.yaw import OLDEST_ATTITUDE_TARGET, TargetFrame
from tests.attitude.independent import attitudes, coefficients_of
from tests.attitude.simulate import quaternion

START, GOAL, HEADING = np.array([-0.4, -0.5]), np.array([0.4, -0.5]), 0.7
LAG, YAW_LAG = 0.02, 0.12
KP = 4.5
LAGS = (LAG, LAG, YAW_LAG)


def times(p, q):
    """p ⊗ q, in the order x, y, z, w."""
    (a, b, c, d), (x, y, z, w) = p, q
    return (
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    )


def turn(rates, seconds):
    """The quaternion of these rates, held for so long."""
    angle = math.hypot(*rates) * seconds
    share = 0.5 * seconds * (math.sin(0.5 * angle) / (0.5 * angle) if angle else 1.0)
    return (*(share * rate for rate in rates), math.cos(0.5 * angle))


def rotation_vector(q):
    """Of a quaternion, the short way round."""
    x, y, z, w = q if q[3] >= 0.0 else tuple(-each for each in q)
    sine = math.hypot(x, y, z)
    share = 2.0 * math.atan2(sine, w) / sine if sine else 2.0
    return share * x, share * y, share * z


class LedByTarget:
    """The target turns by the rates as commanded; the body follows by the lags of its own axes.

    What the body aims at are the commanded rates, seen from its own axes, and the target.
    """

    def __init__(self, start):
        self.target = self.body = start
        self._rates = (0.0, 0.0, 0.0)

    @property
    def body_rates(self):
        return BodyRates(*self._rates)

    def hold(self, command, seconds, steps=8):
        h = seconds / steps
        step, kept = turn(command, h), [math.exp(-h / lag) for lag in LAGS]
        target, body = self.target.as_quat().tolist(), self.body.as_quat().tolist()
        for _ in range(steps):
            target = times(target, step)
            back = (-body[0], -body[1], -body[2], body[3])
            ahead = times(back, target)
            behind = (-ahead[0], -ahead[1], -ahead[2], ahead[3])
            seen = times(times(ahead, (*command, 0.0)), behind)
            aim = [c + KP * away for c, away in zip(seen, rotation_vector(ahead), strict=False)]
            self._rates = tuple(
                a + (rate - a) * left for a, rate, left in zip(aim, self._rates, kept, strict=True)
            )
            body = times(body, turn(self._rates, h))
        self.target, self.body = Rotation.from_quat(target), Rotation.from_quat(body)


def cross_track(turn, tell=lambda planner, plant, n: None, **options):
    limits = Limits(max_yaw_rate=1.0)
    planner = make_planner(
        "model-following", 5.0, limits=limits, lag=LAG, dead_time=0.0, yaw_lag=YAW_LAG, **options
    )
    plant, off = LedByTarget(attitudes(START, HEADING)[0]), []
    for n in range(375):
        tell(planner, plant, n)
        rates = planner.rates(
            quaternion(plant.body), Target(*GOAL, HEADING + turn), 0.004, plant.body_rates
        )
        plant.hold(rates, 0.004)
        off.append(coefficients_of(plant.body)[1] + 0.5)
    return np.abs(off).max()


def truly(every, late=0):
    """Tells the target at every so many samples, by so many samples too late."""
    seen = []

    def tell(planner, plant, n):
        seen.append(quaternion(plant.target))
        if n % every == 0 and n >= late:
            planner.note_attitude_target(seen[n - late], 0.004 * late)

    return tell


@pytest.mark.parametrize("turn", [0.0, 1.5])
def test_the_lead_of_the_frame_keeps_the_line_straight(turn):
    untold = cross_track(turn)
    assert cross_track(turn, frame_lead=0.7 * (YAW_LAG - LAG)) <= 0.003
    assert untold >= 0.005  # it is worth something


@pytest.mark.parametrize("turn", [0.0, 1.5])
@pytest.mark.parametrize(("every", "late"), [(1, 0), (5, 0), (5, 2)])
def test_a_target_that_is_told_keeps_it_straight_without_knowing_any_lead(turn, every, late):
    assert cross_track(turn, truly(every, late)) <= 3e-3


def test_what_is_told_counts_for_more_than_what_was_configured():
    assert cross_track(0.0, truly(5), frame_lead=0.5) <= 6e-3


def turned_away(plant, angle):
    return quaternion(plant.target * Rotation.from_rotvec([0.0, 0.0, angle]))


UNUSABLE = {
    "not a number": lambda plant: ((nan, 0.0, 0.0, 0.0), 0.0),
    "infinite": lambda plant: ((1.0, inf, 0.0, 0.0), 0.0),
    "no rotation": lambda plant: ((0.5, 0.0, 0.0, 0.0), 0.0),
    "zero": lambda plant: ((0.0, 0.0, 0.0, 0.0), 0.0),
    "upside down": lambda plant: ((0.0, 1.0, 0.0, 0.0), 0.0),
    "of the future": lambda plant: (turned_away(plant, 0.5), -0.01),
    "too old": lambda plant: (turned_away(plant, 0.5), OLDEST_ATTITUDE_TARGET + 0.01),
    "of no known age": lambda plant: (turned_away(plant, 0.5), nan),
    "far ahead of the body": lambda plant: (turned_away(plant, 1.0), 0.0),
}


@pytest.fixture(scope="module")
def untold():
    return cross_track(0.0, frame_lead=YAW_LAG - LAG)


@pytest.mark.parametrize("what", UNUSABLE)
def test_a_target_that_is_not_usable_changes_nothing(what, untold):
    def tell(planner, plant, n):
        planner.note_attitude_target(*UNUSABLE[what](plant))

    assert cross_track(0.0, tell, frame_lead=YAW_LAG - LAG) == untold


def test_one_that_is_told_no_more_is_used_no_more():
    """It goes on by what is sent, for a while; then the lead in time serves."""
    axis = AxisResponse(LAG, 0.015, inf)
    frame = TargetFrame(RateLoopResponse(axis, axis, axis))
    assert frame.heading() is None
    frame.note_heading(1.0, 0.0)
    assert frame.heading() == pytest.approx(1.0)
    for n in range(1, 61):
        frame.advance(0.5, 0.1, 0.004)
        assert frame.heading() == pytest.approx(1.0 + 0.4 * 0.004 * n)
    for _ in range(5):
        frame.advance(0.5, 0.1, 0.004)
    assert frame.heading() is None
    frame.note_heading(2.0, 0.0)
    assert frame.heading() == pytest.approx(2.0 + 0.4 * 0.007)  # sent within the delay
    frame.forget()
    assert frame.heading() is None


def test_it_turns_no_faster_than_the_slew_limit():
    axis = AxisResponse(LAG, 0.0, 2.0)
    frame = TargetFrame(RateLoopResponse(axis, axis, axis))
    frame.note_heading(0.0, 0.0)
    for _ in range(50):
        frame.advance(0.4, 0.0, 0.004)
    assert frame.heading() == pytest.approx(0.5 * 2.0 * 0.2**2, rel=0.03)


def test_the_lead_is_derived_where_acceleration_is_limited():
    """Yaw's dead time and lag, less the dead time of roll and pitch; 0 where nothing is limited."""
    tilt, yaw = AxisResponse(0.02, 0.015, 20.0), AxisResponse(0.056, 0.143, 4.7)
    assert RateLoopResponse(tilt, tilt, yaw).lead_time == pytest.approx(0.184)
    assert RateLoopResponse(tilt, tilt, yaw, 0.04).lead_time == 0.04
    assert RateLoopResponse(tilt, tilt, yaw, 0.0).lead_time == 0.0
    assert RateLoopResponse(AxisResponse(0.047, 0.04), yaw=AxisResponse(0.37, 0.1)).lead_time == 0.0


def test_an_older_report_is_completed_by_the_rates_sent_since_it_was_measured():
    axis = AxisResponse(LAG, 0.008, inf)
    frame = TargetFrame(RateLoopResponse(axis, axis, axis))
    frame.note_heading(1.0, 0.0)
    for _ in range(30):
        frame.advance(0.5, 0.1, 0.004)
    frame.note_heading(2.0, 0.04)  # after it was measured, ten samples turned the target
    assert frame.heading() == pytest.approx(2.0 + 0.4 * 0.04)
    frame.note_heading(3.0, OLDEST_ATTITUDE_TARGET)  # the oldest that is used
    assert frame.heading() == pytest.approx(3.0 + 0.4 * 0.12)
    frame.note_heading(4.0, OLDEST_ATTITUDE_TARGET + 1e-3)
    assert frame.heading() == pytest.approx(3.0 + 0.4 * 0.12)
    frame.note_heading(4.0, -1e-3)
    assert frame.heading() == pytest.approx(3.0 + 0.4 * 0.12)
