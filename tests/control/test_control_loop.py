"""The path of one sample: which samples are answered, which are not, and why."""

import math
from time import perf_counter_ns
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates, Limits, Target, make_planner
from companion.control.control_loop import ControlLoop
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_command import GuidanceCommand
from companion.control.loop_record import Deadlines, UnansweredReason
from companion.control.planner_runner import PlannerRunner
from companion.guidance import HoverThrust, ThrustSettings
from companion.mavlink.codec import SetpointEncoder
from companion.mavlink.errors import InvalidSetpoint
from companion.recording.trace import FlightTrace
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample, AttitudeTarget

LEVEL = (1.0, 0.0, 0.0, 0.0)
TARGET = Target(0.1, 0.0, 0.0)
LIMITS = Limits(0.6, 1.5, 1.0)


class Bench:
    """A control loop that collects its setpoints, and samples every 4 ms."""

    def __init__(self, planner=None, send=None):
        self.sent, self.clock = [], VehicleClock()
        self.connected = True
        self.asked = 0
        self.time = 10.0
        self.loop = ControlLoop(
            planner or make_planner("first-order", limits=LIMITS),
            HoverThrust(ThrustSettings(0.5, 0.4, 1.5, 0.1, 0.9)),
            send or self.send,
            Deadlines(telemetry_stale=0.1, target_stale=0.15, deadline=0.004),
            FlightTrace(),
            LIMITS,
            lambda: self.time,
        )
        self.loop.request_mode = self.ask
        self.loop.on = True
        self.refresh()

    def send(self, stamp, rates, thrust):
        if self.connected:
            self.sent.append((stamp, rates, thrust))
        return self.connected

    def ask(self):
        self.asked += 1

    def refresh(self, **changes):
        self.loop.command = GuidanceCommand(TARGET, 0.0, self.time)._replace(**changes)

    def sample(self, vehicle_time=None, q=LEVEL, late=0.0, lead=0):
        """One sample; `vehicle_time` defaults to our time minus 7 s."""
        stamp = self.time - 7.0 if vehicle_time is None else vehicle_time
        stamp_ms, received = round(stamp * 1000), self.time + late
        reading = self.clock.take(stamp_ms, received)
        self.loop.on_sample(
            AttitudeSample(
                stamp_ms,
                reading.vehicle_time,
                received,
                perf_counter_ns() - lead,
                q,
                BodyRates(0.0, 0.0, 0.0),
                reading.age,
                reading.misfit,
            )
        )

    def run(self, count, **options):
        for _ in range(count):
            self.time += 0.004
            self.refresh()
            self.sample(**options)


def test_every_fresh_sample_gets_one_answer_with_its_own_stamp():
    bench = Bench()
    bench.run(50)
    assert len(bench.sent) == bench.loop.record.setpoints == bench.loop.record.samples == 50
    stamps = [stamp for stamp, _, _ in bench.sent]
    assert stamps == [3000 + 4 * k for k in range(1, 51)]
    _, rates, thrust = bench.sent[0]
    assert rates.pitch == pytest.approx(-0.5)  # towards north: nose down
    assert thrust == pytest.approx(0.5)


def test_a_process_that_is_stopped_while_it_answers_does_not_send():
    """Measured on ArduPilot: stopped for 3 s, continued, and one setpoint left 1 ms later."""
    planner, away = make_planner("first-order", limits=LIMITS), 0.0

    def rates(*arguments):
        bench.time += away
        return planner.rates(*arguments)

    bench = Bench(SimpleNamespace(rates=rates, reset=planner.reset))
    bench.run(10)
    away = 3.0
    bench.run(1)
    assert (len(bench.sent), bench.loop.record.reason) == (10, UnansweredReason.LATE)


def test_nothing_is_sent_while_off_or_before_the_first_target():
    bench = Bench()
    bench.loop.on = False
    bench.run(5)
    assert (bench.sent, bench.loop.record.samples) == ([], 0)
    bench.loop.on, bench.loop.command = True, None
    bench.sample(vehicle_time=9.0)
    assert (bench.sent, bench.loop.record.stale_count) == ([], 1)


def test_an_old_target_is_not_answered():
    bench = Bench()
    bench.run(2)
    for _ in range(60):
        bench.time += 0.004
        bench.sample()
    answered = len(bench.sent) - 2
    assert answered == 37  # 0.15 s of 4 ms samples
    assert bench.loop.record.stale_count == 60 - answered


@pytest.mark.parametrize("stamp", [3.02, None])
def test_repeated_and_reordered_samples_are_not_answered(stamp):
    bench = Bench()
    bench.run(10)
    bench.sample(vehicle_time=stamp)
    assert len(bench.sent) == 10
    assert bench.loop.record.stale_count == 1


def test_a_sample_that_was_long_under_way_is_not_answered():
    bench = Bench()
    bench.run(10)
    bench.time += 0.004
    bench.sample(late=0.11)
    assert (len(bench.sent), bench.loop.record.stale_count) == (10, 1)


@pytest.mark.parametrize("rates", [None, BodyRates(0.3, -0.4, 0.5)])
@pytest.mark.parametrize(
    "q",
    [
        (1.01, 0.0, 0.0, 0.0),
        (math.nan, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
        (0.5, 9.0, 0.0, 0.0),
        (math.inf, 0.0, 0.0, 0.0),
    ],
)
def test_an_unusable_attitude_is_refused_and_counted(q, rates):
    """With the planner and with body rates from guidance."""
    bench = Bench()
    for _ in range(3):
        bench.time += 0.004
        bench.refresh(body_rates=rates)
        bench.sample(q=q)
    assert (bench.sent, bench.loop.record.refused_count, bench.loop.record.setpoints) == ([], 3, 0)


def test_a_setpoint_that_could_not_leave_is_no_answer():
    bench = Bench()
    bench.run(3)
    last = bench.loop.record.last_answered_arrival
    bench.connected = False
    bench.run(3)
    assert (bench.loop.record.setpoints, bench.loop.record.refused_count) == (3, 3)
    assert bench.loop.record.last_answered_arrival == last


def test_idle_sends_neither_rates_nor_thrust():
    bench = Bench()
    bench.time += 0.004
    bench.refresh(idle=True)
    bench.sample(q=(0.8, 0.6, 0.0, 0.0))
    bench.time += 0.004
    bench.sample(q=(0.0, 0.0, 0.0, 0.0))  # on the ground it asks for nothing, whatever the attitude
    assert [answer[1:] for answer in bench.sent] == 2 * [(BodyRates(0.0, 0.0, 0.0), 0.0)]


@pytest.mark.parametrize("what", ["offboard_active", "taking_over"])
def test_after_a_gap_it_waits_for_the_mode(what):
    """The autopilot may obey us before it reports the mode."""
    bench = Bench()
    setattr(bench.loop, what, True)
    bench.run(10)
    bench.time += 0.2
    bench.run(10)
    assert (len(bench.sent), bench.asked, bench.loop.awaiting_mode) == (10, 1, True)
    bench.loop.resume()
    assert bench.loop.awaiting_mode is False
    bench.run(10)
    assert (len(bench.sent), bench.asked) == (20, 1)
    bench.time += 0.2
    bench.run(1)
    assert (len(bench.sent), bench.asked) == (20, 2)


def test_without_guard_a_gap_needs_no_confirmation():
    bench = Bench()
    bench.run(10)
    bench.time += 0.2
    bench.run(10)
    assert (len(bench.sent), bench.asked) == (20, 0)


def test_a_late_answer_counts_as_a_missed_deadline():
    bench = Bench()
    bench.run(3, lead=-1_000_000_000)  # in time, however busy this computer is
    assert bench.loop.record.missed_deadlines == 0
    bench.run(2, lead=5_000_000)
    assert bench.loop.record.missed_deadlines == 2


def test_each_unanswered_sample_has_one_reason_which_is_counted():
    """Every reason of the enumeration occurs here."""
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(10)
    bench.sample()
    bench.time += 0.004
    bench.sample(vehicle_time=99.0)
    bench.sample(late=0.12)
    bench.time += 0.2
    bench.sample()
    bench.refresh()
    bench.time += 0.004
    bench.sample()
    bench.loop.resume()
    bench.run(1, q=(0.0, 0.0, 0.0, 0.0))
    bench.connected = False
    bench.run(2)
    bench.loop.command = None
    bench.time += 0.004
    bench.sample()
    bench.loop.is_same_vehicle = lambda: False
    bench.run(3)
    bench.loop.is_same_vehicle = lambda: True
    bench.loop._send = refuse_setpoint
    bench.run(1)
    assert {reason: n for reason, n in bench.loop.record.unanswered.items() if n} == {
        UnansweredReason.ANOTHER_VEHICLE: 3,
        UnansweredReason.INVALID_SETPOINT: 1,
        UnansweredReason.NOT_NEWER: 1,
        UnansweredReason.STAMPED_AHEAD: 1,
        UnansweredReason.LATE: 1,
        UnansweredReason.OLD_TARGET: 1,
        UnansweredReason.AWAITING_MODE: 1,
        UnansweredReason.INVALID_ATTITUDE: 1,
        UnansweredReason.NOT_SENT: 2,
        UnansweredReason.NO_TARGET: 1,
    }
    loop = bench.loop
    assert (loop.record.stale_count, loop.record.refused_count) == (9, 4)
    assert (
        loop.record.samples
        == loop.record.setpoints + loop.record.stale_count + loop.record.refused_count
    )
    assert loop.record.reason is UnansweredReason.INVALID_SETPOINT
    assert all(reason.text for reason in UnansweredReason)


def refuse_setpoint(*_):
    raise InvalidSetpoint("out of range")


@pytest.mark.parametrize(
    ("intervals", "rate"),
    [
        (250 * [0.004], 250.0),
        (12 * [1 / 12], 12.0),
        (12 * [0.08, *20 * [0.0]], 25.0),  # a pause and then 21 at once
        (50 * [0.015, 0.025], 50.0),  # ordinary unevenness is no lower rate
    ],
)
def test_the_rate_of_answers_counts_bursts_as_what_they_are(intervals, rate):
    bench = Bench()
    bench.run(10)
    before, stamp = bench.loop.record.setpoint_intervals.copy(), bench.time - 7.0
    for interval in intervals:
        bench.time += interval
        stamp += sum(intervals) / len(intervals)
        bench.refresh()
        bench.sample(vehicle_time=min(stamp, bench.time - 7.0))
    assert bench.loop.record.setpoint_intervals.rate_since(before) == pytest.approx(rate, rel=0.01)


def test_gaps_are_counted_and_are_no_part_of_the_rate():
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(50)
    before = bench.loop.record.setpoint_intervals.copy()
    for _ in range(3):
        bench.time += 0.2
        bench.run(1)
        bench.loop.resume()
        bench.run(10)
    assert len(bench.loop.record.gaps) == 3
    assert bench.loop.record.setpoint_intervals.rate_since(before) == pytest.approx(250.0)


ASKED = BodyRates(0.3, -0.4, 0.5)


class CountingPlanner:
    """Returns zero rates; counts its calls and resets."""

    def __init__(self):
        self.resets = self.asked = 0
        self.periods = []

    def reset(self, q, body_rates=None):
        self.resets += 1

    def rates(self, q, target, dt, body_rates=None):
        self.asked += 1
        self.periods.append(dt)
        return BodyRates(0.0, 0.0, 0.0)


def test_rates_that_guidance_asks_for_are_sent_instead_of_the_planners():
    bench = Bench()
    bench.refresh(body_rates=ASKED)
    bench.sample(vehicle_time=3.1)
    _, rates, thrust = bench.sent[-1]
    assert rates == ASKED
    assert thrust == pytest.approx(0.5)


def test_they_are_sent_within_the_limits():
    bench = Bench()
    bench.refresh(body_rates=BodyRates(3.0, -4.0, 5.0))
    bench.sample(vehicle_time=3.1)
    rates = bench.sent[-1][1]
    assert rates == pytest.approx((0.9, -1.2, 1.0))  # limits of 1.5 and 1.0 rad/s


def test_they_are_held_to_the_same_freshness_and_never_sent_as_nan():
    bench = Bench()
    bench.refresh(body_rates=ASKED)
    bench.sample(vehicle_time=3.1)
    bench.time += 0.2  # the command is older than 0.15 s
    bench.sample(vehicle_time=3.3)
    assert (len(bench.sent), bench.loop.record.stale_count) == (1, 1)
    encoder = SetpointEncoder(1, 191, 1, 1, signed=False)

    def send(stamp, rates, thrust):
        encoder.frame(0, stamp, rates, thrust)
        return True

    bench = Bench(send=send)
    bench.refresh(body_rates=BodyRates(math.nan, 0.0, 0.0))
    bench.sample(vehicle_time=3.1)
    assert (bench.loop.record.setpoints, bench.loop.record.refused_count) == (0, 1)


def test_after_them_the_planner_begins_anew():
    planner = CountingPlanner()
    bench = Bench(planner=planner)
    bench.run(10)
    assert (planner.asked, planner.resets) == (10, 1)
    for _ in range(50):
        bench.time += 0.004
        bench.refresh(body_rates=ASKED)
        bench.sample()
    assert (planner.asked, planner.resets) == (10, 1)
    bench.run(1)
    assert (planner.asked, planner.resets) == (11, 2)


@pytest.mark.parametrize(
    ("q", "resets"),
    [
        ((math.cos(0.1), math.sin(0.1), 0.0, 0.0), 2),  # the thrust axis jumps by 0.2 rad
        ((math.cos(0.1), 0.0, 0.0, math.sin(0.1)), 1),  # the heading does: no planner sees it
    ],
)
def test_after_a_jump_of_the_thrust_axis_the_planner_begins_anew(q, resets):
    planner = CountingPlanner()
    bench = Bench(planner=planner)
    bench.run(10)
    bench.run(5, q=q)
    assert (planner.asked, planner.resets) == (15, resets)


def test_the_step_after_a_gap_is_as_long_as_the_one_before_it():
    planner = CountingPlanner()
    bench = Bench(planner=planner)
    bench.run(10)
    bench.time += 0.3
    bench.run(2)
    assert planner.resets == 2
    assert planner.periods[1:] == pytest.approx(11 * [0.004])


def test_a_target_moves_with_the_samples_times_until_its_period_is_over():
    """The sample's own time counts, not its arrival: it arrived 10 ms late."""
    asked = []
    planner = SimpleNamespace(
        rates=lambda q, target, dt, rates: asked.append(target.north) or BodyRates(0.0, 0.0, 0.0),
        reset=lambda *_: None,
    )
    bench = Bench(planner)
    bench.run(20)  # the quickest of these tells the vehicle's clock
    asked.clear()
    bench.refresh(target=Target(0.0, 0.0, 0.0), later_target=Target(0.2, 0.0, 0.0), period=0.02)
    begun = bench.time
    for elapsed in (0.005, 0.010, 0.020, 0.040):
        bench.time = begun + elapsed
        bench.sample(late=0.010)
    # The clock's rate is uncertain: by some 0.1 ms here.
    assert asked == pytest.approx([0.05, 0.1, 0.2, 0.2], abs=0.006)


class NotingPlanner:
    """Records each ATTITUDE_TARGET that the loop passes on: heading in rad, age in s."""

    def __init__(self):
        self.noted = []

    def rates(self, *_):
        return BodyRates(0.0, 0.0, 0.0)

    def reset(self, *_):
        pass

    def note_attitude_target(self, q, age):
        self.noted.append((2.0 * math.atan2(q[3], q[0]), age))


def facing(heading):
    return (math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0))


def test_the_attitude_target_is_passed_on_once_with_its_age_at_the_sample():
    bench = Bench(planner := NotingPlanner())
    told = None
    bench.loop.planner.attitude_target = lambda: told
    bench.run(3)
    assert planner.noted == []
    told = AttitudeTarget(3000 + 4 * 3 - 10, facing(0.3))
    bench.run(3)
    assert planner.noted == [(pytest.approx(0.3), pytest.approx(0.014))]
    told = AttitudeTarget(3000 + 4 * 6 + 6, facing(0.4))  # newer than the coming sample
    bench.run(1)
    assert len(planner.noted) == 1
    bench.run(2)
    assert planner.noted[1:] == [(pytest.approx(0.4), pytest.approx(0.002))]


def test_after_a_jump_of_the_heading_the_target_is_told_without_it():
    """An ATTITUDE_TARGET from before the jump may be in either frame and is ignored."""
    bench = Bench(planner := NotingPlanner())
    told = None
    bench.loop.planner.attitude_target = lambda: told
    bench.run(3)
    told = AttitudeTarget(3000 + 4 * 4, facing(0.3))
    bench.run(1, q=facing(0.5))
    assert bench.loop.resets.frame.offset == pytest.approx(0.5)
    assert planner.noted == []
    told = AttitudeTarget(3000 + 4 * 5, facing(0.8))
    bench.run(1, q=facing(0.5))
    assert planner.noted == [(pytest.approx(0.3), pytest.approx(0.0))]


def turning(rates):
    return rates != BodyRates(0.0, 0.0, 0.0)


def test_the_last_answer_of_a_stream_that_is_obeyed_turns_nothing():
    """The autopilot keeps it for seconds; what guidance commands later is not sent."""
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(10)
    bench.loop.end_stream()
    bench.loop.end_stream()
    bench.run(10)
    assert [turning(rates) for _, rates, _ in bench.sent] == [*10 * [True], False]
    assert (bench.loop.on, bench.loop.offboard_active) == (False, False)


@pytest.mark.parametrize("what", ["on", "offboard_active", "command"])
def test_a_stream_that_nobody_obeys_ends_without_a_last_answer(what):
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(10)
    setattr(bench.loop, what, None if what == "command" else False)
    bench.loop.end_stream()
    bench.run(10)
    assert len(bench.sent) == 10


@pytest.mark.parametrize("gap", [0.12, 0.2])
def test_the_last_answer_is_not_sent_after_a_gap(gap):
    """0.12 s: the mode would have to be confirmed; 0.2 s: the command is old, too."""
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(10)
    bench.loop.end_stream()
    bench.time += gap
    bench.run(10)
    bench.loop.resume()
    bench.run(10)
    assert (len(bench.sent), bench.loop.on) == (10, False)


def test_an_unusable_sample_leaves_the_last_answer_to_the_next_one():
    bench = Bench()
    bench.loop.offboard_active = True
    bench.run(10)
    bench.loop.end_stream()
    bench.run(2, q=(0.0, 0.0, 0.0, 0.0))
    assert len(bench.sent) == 10
    bench.run(3)
    assert [turning(rates) for _, rates, _ in bench.sent[10:]] == [False]


@pytest.mark.parametrize("later", [0.0, -0.05])
def test_a_sample_no_later_than_the_one_before_is_asked_with_a_positive_period(later):
    """No planner takes a period of 0 s; the sample need not stay unanswered for that."""
    planner = CountingPlanner()
    runner = PlannerRunner(planner, EstimatorResets(), LIMITS)
    command = GuidanceCommand(Target(0.1, 0.0, 0.0), 0.0, 10.0)
    for vehicle_time in (3.0, 3.0 + later):
        sample = AttitudeSample(
            3000, vehicle_time, 10.0, 0, LEVEL, BodyRates(0.0, 0.0, 0.0), 0.0, 0.0
        )
        runner.rates(sample, command, 0.004)
    assert planner.periods == [0.004, 1e-4]
