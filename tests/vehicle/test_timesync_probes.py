"""The way to the vehicle, by probes that do not change the estimate of the clock."""

from types import SimpleNamespace

import pytest

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.stats import LinkStats
from companion.vehicle.timesync import TimeSync


class Bench:
    """A TimeSync whose requests are kept; `answer` answers the newest one."""

    def __init__(self):
        self.now, self.sent, self.exchanges = 100.0, [], []
        outbox = SimpleNamespace(send=self.sent.append)
        clock = SimpleNamespace(take_timesync=lambda *seen: self.exchanges.append(seen))
        self.timesync = TimeSync(outbox, MessageDispatcher(LinkStats()), lambda: self.now, clock)

    def answer(self, after):
        self.now += after
        stamp = self.sent[-1].ts1
        self.timesync._on_timesync(SimpleNamespace(tc1=7 * 10**9, ts1=stamp))

    def probe(self, round_trip):
        self.now += 0.1
        self.timesync.probe()
        self.answer(round_trip)


def test_the_present_round_trip_is_the_shortest_of_the_last_moments_and_needs_six_probes():
    bench = Bench()
    for trip in (0.005, 0.003, 0.005, 0.005, 0.005):
        bench.probe(trip)
        assert bench.timesync.uplink.round_trip is None
    bench.probe(0.005)
    assert bench.timesync.uplink.round_trip == pytest.approx(0.003)


def test_one_late_answer_tells_of_a_slow_link_once_no_quick_one_is_left():
    bench = Bench()
    for _ in range(8):
        bench.probe(0.005)
    for _ in range(6):  # not answered yet
        bench.now += 0.1
        bench.timesync.probe()
    assert bench.timesync.uplink.round_trip == pytest.approx(0.005)
    bench.now += 0.11
    oldest = bench.sent[8].ts1
    bench.timesync._on_timesync(SimpleNamespace(tc1=7 * 10**9, ts1=oldest))
    assert bench.timesync.uplink.round_trip == pytest.approx(0.61)
    bench.now += 0.8
    assert bench.timesync.uplink.round_trip is None


def test_a_probe_changes_neither_the_clock_nor_the_long_round_trip():
    bench = Bench()
    for _ in range(4):
        bench.probe(0.05)
    assert bench.exchanges == []
    assert bench.timesync.round_trip_s is None
    bench.timesync.send_exchange_request()
    bench.answer(0.01)
    assert len(bench.exchanges) == 1
    assert bench.timesync.round_trip_s == pytest.approx(0.01)


def test_probes_are_sent_ten_times_a_second_and_forgotten_after_a_reconnect():
    bench = Bench()
    for _ in range(50):
        bench.timesync.probe()
        bench.now += 0.02
    assert len(bench.sent) in (9, 10)
    bench.timesync.reset()
    for request in bench.sent:
        bench.timesync._on_timesync(SimpleNamespace(tc1=7 * 10**9, ts1=request.ts1))
    assert bench.timesync.uplink.round_trip is None


def test_unanswered_probes_are_counted_once_the_vehicle_has_answered_any_request():
    bench = Bench()
    for _ in range(5):
        bench.timesync.probe()
        bench.now += 0.1
    assert bench.timesync.uplink.unanswered_count is None
    bench.answer(0.01)
    assert bench.timesync.uplink.unanswered_count == 0
    for sent in range(1, 17):
        bench.now += 0.1
        bench.timesync.probe()
        assert bench.timesync.uplink.unanswered_count == sent


def test_an_answer_leaves_the_probes_sent_after_its_request_unanswered():
    bench = Bench()
    bench.timesync.send_exchange_request()
    bench.answer(0.01)
    for _ in range(6):
        bench.now += 0.1
        bench.timesync.probe()
    probes = [request.ts1 for request in bench.sent[1:]]

    def unanswered_after(stamp):
        bench.timesync._on_timesync(SimpleNamespace(tc1=7 * 10**9, ts1=stamp))
        return bench.timesync.uplink.unanswered_count

    assert unanswered_after(probes[3]) == 2
    assert unanswered_after(probes[1]) == 2  # overtaken on the way
    assert unanswered_after(probes[3] + 1) == 2  # an answer to another station
    bench.timesync.send_exchange_request()
    assert unanswered_after(bench.sent[-1].ts1) == 0


def test_after_a_reconnect_the_vehicle_must_answer_again_before_probes_count():
    bench = Bench()
    bench.probe(0.01)
    bench.timesync.reset()
    bench.now += 0.1
    bench.timesync.probe()
    assert bench.timesync.uplink.unanswered_count is None
