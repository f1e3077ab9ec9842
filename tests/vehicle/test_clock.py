"""The vehicle's clock: drift is followed, jumps, stops and restarts are told, strays dropped."""

import csv
import itertools
import math
import random
import re
from pathlib import Path

import pytest

from companion.vehicle.clock import VehicleClock
from companion.vehicle.clock_jumps import Misfit

RECORDINGS = Path(__file__).parents[1] / "mavlink" / "recordings"
STALE = 0.1
"""deadman.telemetry_stale_ms."""


class Link:
    """A vehicle and the way to us: each sample is a little late, some are later."""

    def __init__(self, rate=1.0, timesync=True, lost=0.0, delay=0.002, seed=1, boot=500.0):
        self.clock, self.told = VehicleClock(), []
        self.clock.on_event = self.told.append
        self.rate, self.timesync, self.lost, self.delay = rate, timesync, lost, delay
        self.random = random.Random(seed)
        self.now, self.vehicle, self.received = 7000.0, boot, 0.0
        self.other = 0.0  # TIMESYNC's clock minus the samples', s
        self.ages, self.misfits = [], []

    def run(self, seconds, hz=250, jitter=0.003, stall=0.03):
        """Samples at `hz`, an exchange a second."""
        dt, shuffle = 1.0 / hz, self.random.random
        due = self.now
        for _ in range(round(seconds * hz)):
            self.now += dt
            self.vehicle += self.rate * dt
            late = self.delay + jitter * shuffle() + stall * (shuffle() < 0.01)
            self.received = max(self.now + late, self.received)  # no overtaking
            self.arrive(self.vehicle)
            if self.now >= due:
                due += 1.0
                if self.timesync and shuffle() >= self.lost:
                    self.compare()
                self.clock.update(self.now)
        return self

    def arrive(self, vehicle):
        reading = self.clock.take(int(1000 * vehicle), self.received)
        if reading.misfit is None:
            self.ages.append(reading.age)
        else:
            self.misfits.append(reading.misfit)
        return reading

    def compare(self, trip=0.004):
        out = trip * self.random.random()
        asked = self.vehicle + self.other + self.rate * out
        self.clock.take_timesync(self.now, self.now + trip, round(asked * 1e9))


def stood_still(link):
    """For how long the clock stood still, as it was told last, s."""
    return float(re.fullmatch(r"the vehicle's clock stood still for (.*) s", link.told[-1])[1])


@pytest.mark.parametrize("rate", [0.99, 0.994, 1.0 - 1e-4, 1.006, 1.01])
@pytest.mark.parametrize(("timesync", "lost"), [(True, 0.0), (True, 0.7), (False, 0.0)])
def test_a_clock_that_runs_at_another_rate_is_followed_for_an_hour(rate, timesync, lost):
    link = Link(rate, timesync, lost)
    link.run(60.0)
    link.run(3540.0, hz=25)  # the rest as the clock sees it, more thinly
    assert link.misfits == []
    assert min(link.ages) >= 0.0
    assert max(link.ages) < STALE
    late = sum(age > 0.05 for age in link.ages) / len(link.ages)
    assert late < 0.005
    assert (link.clock.change_count, link.clock.restart_count) == (0, 0)
    assert link.clock.rate.rate == pytest.approx(rate - 1.0, abs=0.002)
    if timesync:
        assert link.clock.age_known
        assert link.clock.delay.seconds == pytest.approx(link.delay, abs=0.006)


def test_a_full_hour_at_250_hz():
    link = Link(rate=0.99, lost=0.3).run(3600.0)
    assert len(link.ages) == 900_000
    assert max(link.ages) < STALE
    assert (link.misfits, link.clock.change_count) == ([], 0)


@pytest.mark.parametrize("timesync", [True, False])
@pytest.mark.parametrize("rate", [0.99, 1.0, 1.01])
@pytest.mark.parametrize("by", [0.1, 0.3, 5.0, 3600.0, -0.1, -0.3, -5.0, -400.0])
def test_a_jump_is_no_drift(by, rate, timesync):
    link = Link(rate, timesync).run(30.0, stall=0.0)
    before = link.clock.take(int(1000 * link.vehicle) + 8, link.received + 0.008).vehicle_time
    link.vehicle += by
    link.run(1.0, stall=0.0)
    assert link.clock.change_count == 1
    assert link.clock.restart_count == (by < -2.0)
    (told,) = [text for text in link.told if "vehicle's" in text]
    assert ("ahead" in told) is (by > 0.0)
    assert ("the autopilot restarted" in told) is (by < -1.0)
    # Time goes on for those who reckon with it, and the ages are right at once.
    assert link.clock.vehicle_time(int(1000 * link.vehicle)) - before == pytest.approx(1.0, abs=0.1)
    assert link.ages[-1] < 0.02
    link.run(20.0)
    assert (link.clock.change_count, link.clock.age_known) == (1, timesync)


@pytest.mark.parametrize("late", [0.06, 0.08])
def test_a_link_that_gets_quicker_is_no_jump_where_timesync_told_that_it_was_late(late):
    """A queue is flushed or a route changes: the next samples seem ahead by what was late."""
    link = Link().run(20.0, stall=0.0)
    link.delay += late
    link.run(30.0, stall=0.0)
    assert link.ages[-1] == pytest.approx(late, abs=0.02)
    link.delay -= late
    link.now, link.vehicle = link.now + late + 0.05, link.vehicle + late + 0.05  # lost meanwhile
    link.run(5.0, stall=0.0)
    assert (link.clock.change_count, link.misfits) == (0, [])
    assert max(link.ages[-1000:]) < 0.03


@pytest.mark.parametrize("timesync", [True, False])
@pytest.mark.parametrize("stop", [0.1, 0.3, 2.0])
def test_a_clock_that_stands_still_and_goes_on_is_no_drift(stop, timesync):
    link = Link(timesync=timesync).run(30.0)
    link.rate = 0.0
    link.run(stop, stall=0.0)
    assert link.misfits[-1] is Misfit.NOT_NEWER
    link.rate = 1.0
    link.run(1.0, stall=0.0)
    assert link.clock.change_count == 1
    assert stood_still(link) == pytest.approx(stop, abs=0.02)
    assert link.clock.restart_count == 0


def test_timesync_tells_that_the_clock_stopped_while_no_samples_came():
    """A simulator that is suspended sends nothing meanwhile; without TIMESYNC that is lateness."""
    link = Link().run(30.0)
    link.now += 0.5
    link.run(1.0)
    assert link.ages[-1] > STALE
    link.run(3.0)
    assert stood_still(link) == pytest.approx(0.5, abs=0.02)
    assert link.ages[-1] < 0.05


def test_an_answer_a_little_older_than_the_newest_sample_is_no_restart():
    """Recorded from ArduPilot: 1 ms. A simulator that stalled for 0.16 s passed for a new boot."""
    link = Link().run(30.0)
    link.now, link.other = link.now + 0.16, -0.006
    link.run(4.0)
    assert stood_still(link) == pytest.approx(0.16, abs=0.02)
    assert link.clock.restart_count == 0


@pytest.mark.parametrize("by", [0.2, 3600.0, 4e6])
def test_one_sample_stamped_far_ahead_is_dropped_counted_and_named(by):
    link = Link().run(10.0)
    for _ in range(3):
        assert link.arrive(link.vehicle + by).misfit is Misfit.AHEAD
        link.run(1.0)
    assert (link.clock.change_count, len(link.misfits)) == (0, 3)
    (told,) = link.told
    assert "was dropped" in told
    assert max(link.ages) < STALE


def test_repeated_and_reordered_samples_are_not_newer_and_no_restart():
    link = Link().run(10.0)
    for _ in range(50):
        assert link.arrive(link.vehicle).misfit is Misfit.NOT_NEWER
        assert link.arrive(link.vehicle - 0.2).misfit is Misfit.NOT_NEWER
        link.run(0.004)
    for back in (0.020, 0.016, 0.012, 0.008):
        assert link.arrive(link.vehicle - back).misfit is Misfit.NOT_NEWER
    link.run(1.0)
    assert (link.clock.change_count, link.told) == (0, [])


def test_boot_time_wraps_after_49_days():
    link = Link(boot=2**32 / 1000.0 - 10.0).run(9.9)
    link.vehicle -= 2**32 / 1000.0
    link.vehicle += 0.2
    link.run(5.0)
    assert "wrapped around after 49.7 days" in link.told[-1]
    assert (link.clock.change_count, link.clock.restart_count) == (1, 0)
    assert link.ages[-1] < 0.02


def test_timesync_which_does_not_wrap_tells_ages_after_49_days():
    wrap = 2**32 / 1000.0
    link = Link(boot=100.0, delay=0.05)
    link.other = wrap
    link.run(10.0)
    assert link.clock.age_known
    assert link.clock.delay.seconds == pytest.approx(0.05, abs=0.01)


def test_timesync_tells_of_a_restart_before_attitude_is_asked_for_again():
    """After a restart ArduPilot does not send attitude by itself."""
    link = Link(boot=500.0).run(10.0)
    link.vehicle = 2.0
    for _ in range(4):
        link.now += 1.0
        link.vehicle += 1.0
        link.compare()
    assert link.clock.restart_count == 1
    link.run(5.0)
    assert link.clock.restart_count == 1
    assert link.ages[-1] < 0.02


def test_a_restart_tells_the_time_since_boot_before_and_after_whatever_the_clock_did_before():
    """A second restart: what the program reckons with goes on, what the vehicle stamps does not."""
    link = Link(boot=500.0).run(10.0, stall=0.0)
    for ran, boot in ((510.0, 2.0), (12.0, 5.0)):
        link.vehicle = boot
        link.run(10.0, stall=0.0)
        told = re.search(r"went back from (.*) s to (.*) s: the autopilot", link.told[-1])
        assert [float(each) for each in told.groups()] == pytest.approx([ran, boot], abs=0.11)
    assert (link.clock.change_count, link.clock.restart_count) == (2, 2)


@pytest.mark.parametrize("timesync", [True, False])
@pytest.mark.parametrize("flown", [4.0, 30.0])
def test_samples_that_were_queued_in_a_stall_of_20_s_are_no_jump_of_the_clock(flown, timesync):
    """The socket's buffer holds those of the first seconds; the next ones are new."""
    link = Link(timesync=timesync).run(flown)
    stall_end = link.received = link.now + 20.0
    for _ in range(500):
        link.vehicle += 0.004
        link.arrive(link.vehicle)
    link.vehicle, link.now = link.vehicle + 18.0, stall_end
    link.run(3.0)
    assert not any("clock" in text for text in link.told), link.told
    assert link.clock.change_count == 0
    assert link.ages[-1] < STALE


def test_before_the_first_sample_no_age_is_known_and_no_stamp_is_ahead():
    clock = VehicleClock()
    assert (clock.offset, clock.age(5.0, 10.0)) == (None, None)
    assert not clock.is_ahead(1e6, 10.0)
    clock.take_timesync(10.0, 10.004, 5_000_000_000)  # nothing to compare it with
    assert not clock.age_known
    clock.take(5000, 10.0)
    assert (clock.offset, clock.age(4.0, 10.0)) == (-5.0, 1.0)
    assert clock.age(6.0, 10.0) == 0.0  # never negative


def test_delay_from_the_start_counts_where_timesync_tells_it():
    link = Link(delay=0.4).run(2.0)
    assert link.ages[-1] == pytest.approx(0.4, abs=0.01)
    assert Link(delay=0.012).run(5.0, stall=0.0).ages[-1] < 0.02


def test_a_queue_that_grows_slowly_is_seen_by_timesync_though_it_looks_like_drift():
    link = Link().run(30.0)
    for _ in range(40):
        link.delay += 0.01
        link.run(1.0, hz=100, stall=0.0)
    assert link.ages[-1] == pytest.approx(0.4, abs=0.05)


def test_without_timesync_the_age_is_said_to_be_unknown_once():
    link = Link(timesync=False).run(30.0)
    (told,) = link.told
    assert "age of telemetry is not known, because the autopilot does not answer TIMESYNC" in told
    link.timesync = True
    link.run(3.0)
    assert "is known by TIMESYNC" in link.told[-1]
    link.timesync = False
    link.run(19.0)
    assert link.clock.age_known
    link.run(3.0)
    assert not link.clock.age_known
    assert "is not known" in link.told[-1]


@pytest.mark.parametrize("other", [1.8e9, 30.0, -0.5, -400.0])
def test_timesync_of_another_clock_is_not_taken_for_lateness(other):
    link = Link()
    link.other = other
    link.run(30.0)
    assert not link.clock.age_known
    assert (max(link.ages) < 0.06, min(link.ages) >= 0.0) == (True, True)
    (told,) = link.told
    assert "TIMESYNC uses a different clock" in told
    assert link.clock.change_count == 0


def test_timesyncs_clock_may_become_another_one_in_flight():
    link = Link().run(30.0)
    for other in (-5.0, 2e9):
        link.other = other
        link.run(10.0)
        assert (link.clock.age_known, link.clock.change_count) == (False, 0)
    assert max(link.ages) < STALE


@pytest.mark.parametrize("timesync", [True, False])
def test_a_real_px4_with_a_slow_clock_is_not_late(timesync):
    """Recorded: each fourth sample of a flight that was given up after 16 s, and all exchanges."""
    clock, ages, told = VehicleClock(), [], []
    clock.on_event = told.append
    with (RECORDINGS / "px4-slow-clock.csv").open() as file:
        for row in csv.DictReader(file):
            received, vehicle_ms = float(row["received_s"]), float(row["vehicle_ms"])
            if not row["timesync_sent_s"]:
                ages.append(clock.take(int(vehicle_ms), received).age)
                clock.update(received)
            elif timesync:
                clock.take_timesync(
                    float(row["timesync_sent_s"]), received, round(1e6 * vehicle_ms)
                )
    assert len(ages) > 900
    assert max(ages) < 0.01
    assert clock.rate.rate == pytest.approx(-0.006, abs=0.001)
    assert (clock.age_known, clock.change_count, len(told)) == (timesync, 0, not timesync)


def test_simulators_that_send_in_bursts_and_slip_are_not_late():
    """ArduPilot's: every 5.6 ms, steps of 2, 3 and 5 ms, and 16 ms of slip in 36 s under load."""
    clock, now, vehicle = VehicleClock(), 100.0, 20.0
    steps, ages = itertools.cycle((0.002, 0.003, 0.005)), []
    slips = {k * 900 for k in range(1, 8)}
    for k in range(round(36.0 / 0.0056)):
        now += 0.0056
        burst = 0.0
        vehicle -= 0.016 if k in slips else 0.0
        while burst < 0.0056:
            step = next(steps)
            burst += step
            vehicle += step * 0.0056 / max(burst, 0.0056)
            reading = clock.take(round(1000 * vehicle), now)
            if reading.misfit is None:
                ages.append(reading.age)
    assert max(ages) < 0.07
    assert clock.change_count == 0


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("backlog", [0.02, 0.048, 0.068, 0.3])
def test_a_backlog_at_the_start_is_no_drift(backlog, seed):
    """What waited while we started is read at once: PX4's had 17 samples, ArduPilot's 12."""
    link = Link(timesync=False, seed=seed)
    for waited in range(round(backlog / 0.004)):
        link.received = link.now + backlog + 1e-4 * waited
        link.arrive(link.vehicle + 0.004 * waited)
    link.now += backlog
    link.vehicle += backlog
    link.ages.clear()
    link.run(60.0, stall=0.0)
    assert max(link.ages) < 0.012
    assert link.misfits == []


@pytest.mark.parametrize(("slip", "seen"), [(0.010, 0.014), (0.016, 0.018), (0.045, 0.020)])
def test_a_slip_of_the_clock_makes_samples_old_for_seconds_at_most(slip, seen):
    """Measured: a busy computer's simulator loses 10 to 16 ms, now and then 45 ms."""
    link = Link().run(30.0, jitter=0.002, stall=0.0)
    for _ in range(4):
        link.now += slip  # time that the vehicle never had
        link.ages.clear()
        link.run(1.2, jitter=0.002, stall=0.0)
        assert max(link.ages) < slip + 0.01
        link.ages.clear()
        link.run(0.2, jitter=0.002, stall=0.0)
        assert max(link.ages) < link.delay + seen
        link.ages.clear()
        link.run(6.0, jitter=0.002, stall=0.0)
        assert max(link.ages[-250:]) < link.delay + 0.006
    assert (link.misfits, link.clock.change_count) == ([], 0)


def test_in_lockstep_the_age_of_the_first_sample_is_known():
    assert VehicleClock(lockstep=True).take(4000, 4.3).age == pytest.approx(0.3)
    assert VehicleClock().take(4000, 4.3).age == 0.0


def test_in_lockstep_there_is_one_clock_and_timesync_is_not_needed():
    clock = VehicleClock(lockstep=True)
    told = []
    clock.on_event = told.append
    for k in range(1000):
        age = clock.take(4 * k, 0.004 * k + (0.4 if k > 500 else 0.0)).age
        clock.update(0.004 * k)
    assert clock.age_known
    assert age == pytest.approx(0.4)
    assert told == []
    assert clock.take(3996, 10.0).misfit is Misfit.NOT_NEWER
    assert math.isnan(clock.take(3996, 10.0).age)
