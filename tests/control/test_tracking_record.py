"""Which part of a flight is flown, and what is recorded of its reference."""

from math import isnan
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates, Coefficients
from companion.control.flown_source import FlownPart, FlownSource
from companion.control.step_recorder import StepRecorder
from companion.control.step_rows import StepFlags, StepOutput
from companion.guidance import Doublets, ManeuverSequence, Pose, Reference, VehicleMotion
from companion.guidance.follow import Follow
from companion.guidance.reference import HorizontalMode, TiltCommand, VerticalMode
from companion.guidance.source import ManeuverSource
from companion.guidance.trajectory import Laps, circle
from companion.recording.trace import FlightTrace, ManeuverChange

POSE = Pose((1.0, 2.0, -3.0), 0.5)
HERE = VehicleMotion((1.5, 2.5, -3.5), (0.0, 0.0, 0.0))
DOUBLETS = Doublets(
    1.0, 0.25, 0.8, 1.0, climb_acceleration=2.0, climb_step_time=0.25, settle_time=1.0
)


class Steps:
    """Steps of guidance that are recorded in memory only."""

    def __init__(self, flown):
        self.trace, self.told = FlightTrace(), []
        self.recorder = StepRecorder(self.trace, flown, vehicle=None)
        self.recorder.note = self.told.append

    def step(self, now, reference, *, offboard_active=True):
        flags = StepFlags(True, False, False, offboard_active)
        output = StepOutput(
            now - 6.0, (1.0, 0.0, 0.0, 0.0), SimpleNamespace(present=HERE), reference, None
        )
        self.recorder.step(flags, now, output, None)


def program(ends=20.0):
    """A source that another program commands."""
    return SimpleNamespace(name="program", begin=lambda *_: None, finished=lambda now: now > ends)


def test_what_is_flown_has_its_name_and_its_time():
    flown, source = FlownSource(), program()
    assert flown.part(12.0) is None
    assert flown.finished(99.0) is False
    flown.begin(source, POSE, 10.0)
    assert flown.part(12.0) == FlownPart("program", 2.0, None, source)
    assert (flown.finished(20.0), flown.finished(20.5)) == (False, True)
    assert flown.part(20.5) is None
    flown.begin(ManeuverSource(ManeuverSequence([DOUBLETS])), POSE, 30.0)
    assert flown.part(31.5) == FlownPart("identify", 1.5, DOUBLETS.duration, DOUBLETS)
    flown.begun_at = None
    assert flown.part(31.5) is None


def test_only_a_trajectory_is_followed():
    flown, follow = FlownSource(), Follow(circle(5.0, Laps(2.0)), yaw_rate=1.0)
    assert flown.followed_trajectory(12.0) is None
    flown.begin(program(), POSE, 10.0)
    assert flown.followed_trajectory(12.0) is None
    flown.begin(ManeuverSource(ManeuverSequence([DOUBLETS, follow])), POSE, 10.0)
    assert flown.followed_trajectory(12.0) is None
    assert flown.followed_trajectory(12.5 + DOUBLETS.duration) == (follow, 2.5, POSE)
    flown.pose = None
    assert flown.followed_trajectory(12.5 + DOUBLETS.duration) is None


def test_a_maneuver_is_told_once_and_its_end_is_marked():
    flown = FlownSource()
    bench = Steps(flown)
    bench.step(9.0, Reference((1.0, 2.0, -3.0)))
    flown.begin(program(), POSE, 10.0)
    for now in (10.0, 12.0, 21.0, 22.0):
        bench.step(now, Reference((1.0, 2.0, -3.0)))
    assert bench.told == ["maneuver: program"]
    maneuver_changes = [ManeuverChange(10.0, 4.0, "program"), ManeuverChange(21.0, 15.0, None)]
    assert bench.trace.maneuvers == maneuver_changes
    rows = bench.trace.tracking.rows()
    assert rows[0].tolist() == pytest.approx([3.0, 1.0, 2.0, -3.0, 1.5, 2.5, -3.5])
    assert len(rows) == 5


def test_what_is_not_under_control_is_not_tracked():
    flown = FlownSource()
    bench = Steps(flown)
    flown.begin(program(), POSE, 10.0)
    bench.step(12.0, Reference((1.0, 2.0, -3.0)), offboard_active=False)
    bench.recorder.step(StepFlags(True, False, False, True), 12.5, None, None)
    assert (len(bench.trace.tracking), bench.trace.maneuvers, bench.told) == (0, [], [])


@pytest.mark.parametrize(
    ("reference", "known"),
    [
        (Reference((1.0, 2.0, -3.0), horizontal=HorizontalMode.ACCELERATION), [False, False, True]),
        (Reference((1.0, 2.0, -3.0), horizontal=BodyRates(0.1, 0.0, 0.0)), [False, False, True]),
        (Reference((1.0, 2.0, -3.0), vertical=VerticalMode.ACCELERATION), [True, True, False]),
    ],
)
def test_what_is_no_reference_is_nan(reference, known):
    bench = Steps(FlownSource())
    bench.step(9.0, reference)
    assert [not isnan(value) for value in bench.trace.tracking.rows()[0, 1:4]] == known


def test_open_loop_before_a_vehicle_has_returned_gives_it_no_more_time_to_return():
    """Steps with settling times of 3 s, in a wind that the vehicle cannot hold."""
    flown, away = FlownSource(), VehicleMotion((30.0, 2.0, -3.0), (0.0, 0.0, 0.0))
    flown.begin(program(), POSE, 0.0)
    hold = Reference(POSE.position_ned)
    step = hold._replace(horizontal=TiltCommand(Coefficients(0.2, 0.0)))
    for began in (0.0, 5.0, 10.0):
        for second in range(5):
            reference = step if second < 2 else hold
            error = flown.tracking_error(began + second, reference, away)
            assert error is None or began + second > 12.0, began + second
    assert error == pytest.approx(29.0)
    assert flown.tracking_error(15.0, step, away) is None
    here = VehicleMotion(POSE.position_ned, (0.0, 0.0, 0.0))
    assert flown.tracking_error(16.0, hold, here) == 0.0
    assert flown.tracking_error(17.0, step, away) is None
    assert flown.tracking_error(18.0, hold, away) is None
