"""Asking for message rates where the autopilot does not grant every one."""

import asyncio
from math import inf

import pytest

from companion.mavlink.errors import CommandRefused
from companion.mavlink.stats import LinkStats
from companion.vehicle.streams import StreamRate, measure_rates, set_rates

WHOLE_MILLISECONDS = 1000
DENIED, UNSUPPORTED = 2, 3


class Autopilot:
    """Denies intervals below `shortest_us`, as ArduPilot does those above its loop rate."""

    def __init__(self, shortest_us, refusal=DENIED):
        self.shortest_us, self.refusal = shortest_us, refusal
        self.asked = []

    async def send(self, command, params, timeout_s, retries):
        assert command == 511
        self.asked.append(params)
        if params[1] < self.shortest_us:
            raise CommandRefused("MAV_CMD_SET_MESSAGE_INTERVAL", self.refusal, "DENIED", ())


def asked_of(autopilot, rates, step_us=WHOLE_MILLISECONDS):
    return asyncio.run(set_rates(autopilot, LinkStats(), rates, 0.001, step_us))


@pytest.mark.parametrize(
    ("rate", "intervals_us", "granted"),
    [
        (50.0, [20000.0], 50.0),
        (300.0, [3000.0], 1000.0 / 3.0),
        (333.0, [3000.0], 1000.0 / 3.0),
        (400.0, [2000.0, 5000.0], 200.0),  # 2.5 ms are 2 ms to it, and more than its loop does
        (1000.0, [1000.0, 2000.0, 4000.0], 250.0),
    ],
)
def test_a_denied_rate_is_halved_until_it_is_granted(rate, intervals_us, granted):
    """Granted and denied as recorded with a loop of 400 Hz: 333 Hz is, 400 Hz is not."""
    autopilot = Autopilot(shortest_us=2500)
    answer = asked_of(autopilot, {"ATTITUDE_QUATERNION": rate})["ATTITUDE_QUATERNION"]
    assert autopilot.asked == [(31.0, interval) for interval in intervals_us]
    assert answer == StreamRate(rate, pytest.approx(granted), 0.0, "")


@pytest.mark.parametrize(("refusal", "questions"), [(DENIED, 4), (UNSUPPORTED, 1)])
def test_a_message_that_is_not_sent_at_all_is_told_so(refusal, questions):
    autopilot = Autopilot(shortest_us=inf, refusal=refusal)
    assert asked_of(autopilot, {"ODOMETRY": 10.0})["ODOMETRY"] == (10.0, 0.0, 0.0, "DENIED")
    assert len(autopilot.asked) == questions


def test_no_rounding_error_costs_a_step():
    autopilot = Autopilot(shortest_us=0)
    asked_of(autopilot, {"ATTITUDE_QUATERNION": 1e3 / 3, "HEARTBEAT": 0.0})
    asked_of(autopilot, {"ATTITUDE_QUATERNION": 400.0}, step_us=1)
    assert autopilot.asked == [(31.0, 3000.0), (0.0, -1.0), (31.0, 2500.0)]


def test_only_messages_of_the_window_count_towards_a_measured_rate():
    """5 of ATTITUDE_QUATERNION, 2 of a HEARTBEAT that was not heard before, and no ODOMETRY."""
    stats = LinkStats()
    stats.by_message[31] = 100

    async def measured():
        clock = asyncio.get_running_loop().time
        began = clock()
        counting = asyncio.ensure_future(
            measure_rates(stats, ("ATTITUDE_QUATERNION", "HEARTBEAT", "ODOMETRY"), 0.05)
        )
        await asyncio.sleep(0.01)
        stats.by_message.update({31: 105, 0: 2})
        return await counting, clock() - began

    rates, longest = asyncio.run(measured())
    for name, count in (("ATTITUDE_QUATERNION", 5), ("HEARTBEAT", 2)):
        assert count / longest <= rates[name] <= count / 0.049
    assert rates["ODOMETRY"] == 0.0
