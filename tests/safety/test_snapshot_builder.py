"""What the monitors are shown: every value is that of its source, since control began."""

from collections import deque
from math import inf
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates
from companion.control.heading_frame import HeadingFrame
from companion.control.loop_record import LoopRecord, UnansweredReason
from companion.guidance.fence import FenceCentre, LatLon
from companion.safety.snapshot import AutopilotStatus, Health, Motion, Resets
from companion.safety.snapshot_builder import SnapshotBuilder
from companion.vehicle.records import LocalPosition
from companion.vehicle.timesync import Uplink

Q = (0.6, 0.0, 0.8, 0.0)


class Flight:
    """A link, a control loop and guidance with a value of its own everywhere."""

    def __init__(self, **options):
        self.counted = []
        self.state = SimpleNamespace(
            armed=True,
            landed=False,
            failsafe=True,
            battery="battery",
            gps="gps",
            estimator=SimpleNamespace(flags=0x33F),
            position=LocalPosition(9.75, 9.75, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            global_position=SimpleNamespace(latitude_deg=47.0, longitude_deg=8.0, received=9.0),
            height=12.5,
            reset_counter=3,
            position_count=0,
            gps_was_good=True,
        )
        self.clock = SimpleNamespace(change_count=2, last_change="it jumped")
        self.stats = SimpleNamespace(frames=0, lost=0, non_finite_at={})
        link = SimpleNamespace(
            state=self.state,
            clock=self.clock,
            stats=self.stats,
            autopilot=SimpleNamespace(rates_about_target_axes=False),
            timesync=SimpleNamespace(round_trip_s=0.04, uplink=Uplink(0.05, 1)),
        )
        self.resets = SimpleNamespace(
            newest_attitude=SimpleNamespace(received=9.9, q=Q, body_rates=(0.1, 0.2, 0.3)),
            reset_times=[],
            position_shift=(1.0, 2.0, 3.0),
            frame=HeadingFrame(3.0),
            largest_tilt_jump=0.7,
            heading_corrections=0.0,
            total_turn=0.0,
            on_counter=lambda *seen: self.counted.append(seen),
        )
        self.record = LoopRecord(sent_setpoints=deque([(BodyRates(0.0, 0.0, 0.0), 0.45)]))
        command = SimpleNamespace(idle=False)
        self.loop = SimpleNamespace(resets=self.resets, record=self.record, command=command)
        self.course = SimpleNamespace(position_ned=(5.0, -6.0, -7.0), velocity=(1.0, 2.0, 0.5))
        self.guidance = SimpleNamespace(
            motion=Motions(self.course.position_ned, self.course.velocity),
            acceleration=(0.0, 0.0),
            estimate=SimpleNamespace(disturbance=(0.0, 0.0)),
            tracking_error=0.9,
            remaining_braking_time=0.0,
            command_not_finite=False,
            fresh_position=lambda: "fresh",
        )
        self.builder = SnapshotBuilder(
            link, self.loop, self.guidance, **{"real_time": True, **options}
        )

    def listen(self, *times):
        for now in times:
            self.builder.read_counters(now)

    def snapshot(self, now=10.0):
        return self.builder.snapshot(now)


class Motions(tuple):
    """A position and a velocity, as `MotionEstimate.motion` names them."""

    def __new__(cls, position, velocity):
        return super().__new__(cls, (position, velocity))

    position_ned = property(lambda self: self[0])


@pytest.fixture
def flight():
    flight = Flight()
    flight.builder.begin(10.0)
    flight.listen(10.0)
    return flight


def test_the_autopilots_words_are_passed_on(flight):
    state = flight.state
    told = flight.snapshot()
    assert told.now == 10.0
    assert told.autopilot == AutopilotStatus(True, False, True, "battery", "gps", state.estimator)
    assert (told.had_gps, told.initial_estimator_flags) == (True, 0x33F)
    flight.state.estimator = None
    assert flight.snapshot().initial_estimator_flags == 0x33F
    flight.builder.begin(11.0)
    flight.listen(11.0)
    assert flight.snapshot(11.0).initial_estimator_flags == 0


def test_motion_is_seen_from_where_control_began(flight):
    flight.guidance.motion = Motions((7.0, -9.0, -3.0), (1.0, 2.0, 0.5))
    flight.guidance.acceleration, flight.guidance.remaining_braking_time = (0.3, -0.4), 0.1
    flight.guidance.estimate.disturbance = (0.5, -0.6)
    assert flight.snapshot().motion == Motion(
        q=Q,
        body_rates=(0.1, 0.2, 0.3),
        offset=(2.0, -3.0, 4.0),
        velocity=(1.0, 2.0, 0.5),
        height=12.5,
        tracking_error=0.9,
        thrust=0.45,
        origin=LatLon(47.0, 8.0),
        acceleration=(0.3, -0.4),
        wind=(0.5, -0.6),
        moves_to_hold=True,
    )


@pytest.mark.parametrize(("error", "moves"), [(None, False), (0.29, False), (0.31, True)])
def test_a_vehicle_that_wind_keeps_from_its_hold_still_moves_there(flight, error, moves):
    flight.guidance.remaining_braking_time, flight.guidance.tracking_error = 0.0, error
    assert flight.snapshot().motion.moves_to_hold is moves


def test_the_fence_may_have_another_centre_than_where_control_began(flight):
    flight.builder.begin(10.0, FenceCentre((4.0, 5.0, -6.0), LatLon(46.0, 7.0)))
    assert flight.builder.fence_centre_without_resets().lat_lon == LatLon(46.0, 7.0)
    flight.listen(10.0)
    assert flight.snapshot().motion.origin == LatLon(46.0, 7.0)


@pytest.mark.parametrize("command", [None, SimpleNamespace(idle=True)])
def test_what_is_not_known_is_none(command):
    flight = Flight()
    flight.guidance.motion = flight.guidance.tracking_error = None
    flight.state.global_position.received = 8.99
    flight.builder.begin(10.0)
    flight.listen(10.0)
    flight.resets.newest_attitude = flight.state.position = None
    flight.loop.command = command
    flight.guidance.fresh_position = lambda: None
    told = flight.snapshot()
    assert told.motion == Motion(height=12.5)
    assert (told.control.last_position_arrival, told.control.position_fresh) == (-inf, False)
    flight.guidance.motion = Motions((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert flight.snapshot().motion[2:4] == (None, (4.0, 5.0, 6.0))
    flight.state.global_position = None
    flight.builder.begin(10.0)
    flight.listen(10.0)
    assert flight.snapshot().motion.origin is None


def test_before_control_begins_everything_counts_from_the_start_of_the_clock():
    flight = Flight()
    flight.record.gaps.append(0.5)
    flight.resets.reset_times.append(0.5)
    flight.listen(1.0, 4.0)
    told = flight.snapshot(4.0)
    assert (told.motion.offset, told.motion.origin, told.initial_estimator_flags) == (None, None, 0)
    assert flight.builder.fence_centre_ned is None
    assert told.control.last_frame_noticed == 0.0
    assert told.control.clock_change == "it jumped"
    flight.clock.change_count = 0
    assert flight.snapshot(4.0).control.clock_change is None
    assert told.health.gaps == 1
    assert told.resets[:3] == (1, pytest.approx(14.0**0.5), 3.0)


def test_the_newest_attitude_or_position_with_a_nan_is_known(flight):
    flight.record.last_sample_arrival = 9.5
    assert not flight.snapshot().control.attitude_not_finite
    flight.stats.non_finite_at = {"ATTITUDE_QUATERNION": 9.6, "LOCAL_POSITION_NED": 9.7}
    told = flight.snapshot().control
    assert (told.attitude_not_finite, told.position_not_finite) == (True, False)  # one at 9.75
    flight.stats.non_finite_at["LOCAL_POSITION_NED"] = 9.8
    flight.record.last_sample_arrival = 9.65
    told = flight.snapshot().control
    assert (told.attitude_not_finite, told.position_not_finite) == (False, True)


def test_every_stage_of_a_samples_way_has_its_time(flight):
    flight.record.last_answered_arrival, flight.record.last_sample_arrival = 9.9, 9.95
    flight.record.reason = UnansweredReason.LATE
    flight.stats.frames = 1
    flight.listen(10.02)
    flight.listen(10.04)
    flight.listen(10.24)  # late by 0.17 s
    told = flight.snapshot(10.3).control
    assert (told.last_answered_arrival, told.last_sample_arrival, told.reason) == (
        9.9,
        9.95,
        UnansweredReason.LATE,
    )
    assert (told.last_position_arrival, told.last_frame_noticed) == (9.75, 10.02)
    assert (told.position_fresh, told.clock_change) == (True, None)
    assert told.stall_time == pytest.approx(0.17)
    flight.clock.change_count = 3
    assert flight.snapshot().control.clock_change == "it jumped"
    assert flight.counted == [(3, now) for now in (10.0, 10.02, 10.04, 10.24)]


def run_for(flight, seconds):
    """50 looks a second; of ten frames four are lost, every fourth answer is late."""
    for step in range(1, round(50 * seconds) + 1):
        flight.stats.frames, flight.stats.lost = 6 * step, 4 * step
        flight.record.setpoints, flight.record.missed_deadlines = 4 * step, step
        flight.record.setpoint_intervals.add(0.005)
        flight.state.position_count = step // 5
        flight.listen(10.0 + 0.02 * step)
    return flight.snapshot(10.0 + seconds)


def test_shares_and_rates_are_those_of_the_last_second(flight):
    told = run_for(flight, 3.0).health
    assert told.lost_share == pytest.approx(0.4)
    assert told.missed_share == pytest.approx(0.25)
    assert told.answer_rate == pytest.approx(200.0)
    assert told.position_rate == pytest.approx(10.0, rel=0.03)
    assert (told.starved_share, told.round_trip, told.gaps) == (0.0, 0.04, 0)
    assert told.uplink == Uplink(0.05, 1)
    flight.listen(13.28)  # 0.25 s too late, and the second looked at began at 12.26 s
    starved = flight.snapshot(13.28).health.starved_share
    assert starved == pytest.approx(0.25 / 1.02)
    assert len(flight.builder.counters._readings) <= 52


def test_shares_are_not_known_before_most_of_a_second_is_seen(flight):
    assert run_for(flight, 0.88).health == Health(round_trip=0.04, uplink=Uplink(0.05, 1))
    assert run_for(flight, 0.92).health.lost_share is not None
    flight.builder.begin(11.0)
    flight.listen(11.0)
    assert flight.snapshot(11.0).health == Health(round_trip=0.04, uplink=Uplink(0.05, 1))


def test_rates_of_three_looks_far_apart_are_those_since_the_second_one():
    """And what came late before the second one does not count."""
    flight = Flight()
    for now, positions, setpoints in ((10.0, 0, 5), (11.5, 10, 6), (13.0, 13, 7)):
        flight.state.position_count = positions
        flight.record.setpoints = flight.record.missed_deadlines = setpoints
        flight.listen(now)
    told = flight.snapshot(13.0).health
    assert (told.position_rate, told.missed_share) == (2.0, 1.0)
    assert told.starved_share == pytest.approx(1.47 / 1.5)


def test_nine_tenths_of_the_window_are_enough():
    flight = Flight()
    flight.listen(0.0, 0.9)
    assert flight.snapshot(0.9).health.position_rate == 0.0


def test_deadlines_do_not_count_in_lockstep():
    flight = Flight(real_time=False)
    flight.builder.begin(10.0)
    flight.listen(10.0)
    assert run_for(flight, 1.0).health.missed_share is None


def test_gaps_count_for_five_seconds_and_resets_for_thirty_but_none_from_before(flight):
    flight.record.gaps.extend([9.0, 10.0, 11.0, 12.0])
    flight.resets.reset_times.extend([9.0, 10.0, 11.0, 30.0])
    assert flight.snapshot(14.0).health.gaps == 2
    assert flight.snapshot(16.5).health.gaps == 1
    assert flight.snapshot(17.0).health.gaps == 0
    assert flight.snapshot(31.0).resets.recent_count == 2
    assert flight.snapshot(41.5).resets.recent_count == 1


def test_resets_are_summed_from_where_control_began(flight):
    assert flight.snapshot().resets == Resets(0, 0.0, 0.0, 0.0)
    flight.resets.position_shift, flight.resets.frame = (1.0, 5.0, 7.0), HeadingFrame(-3.0)
    flight.resets.largest_tilt_jump = 0.2
    found = flight.snapshot().resets
    assert found.position_shift == pytest.approx(5.0)
    assert found.heading_shift == pytest.approx(2.0 * 3.141592653589793 - 6.0)
    assert found.largest_tilt_jump == 0.2
