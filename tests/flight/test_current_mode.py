"""A change that the autopilot tells of between two heartbeats is heard at once."""

import asyncio
from math import ceil, floor
from types import SimpleNamespace

import pytest

from companion.config import Config
from companion.flight.phase import Phase
from companion.flight.watch import Watch
from companion.vehicle.autopilot import Role
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

PHASE = Phase("connect", "", lambda _: None, 1.0)
AFTER_A_HEARTBEAT = [0.1, pytest.param(0.35, marks=pytest.mark.slow), 0.7]
"""s; PX4's heartbeats come at whole seconds of vehicle time."""


def takeover(after, **settings):
    """A pilot takes over in the maneuver; returns the summary and how late we were silent, s."""
    at = None

    def begin():
        nonlocal at
        at = ceil(mock.state()["time"]) + 2.0 + after
        mock.inject({"kind": "pilot_takeover", "mode": "POSCTL", "at_s": at})

    with mock_vehicle(full_rate=True, **settings, in_lockstep=True) as mock:
        summary = fly(mock, None, When("maneuvers", begin))
        state = mock.state()
    assert "took over: mode POSCTL" in summary.result
    assert state["mode"] == "POSCTL"
    assert state["last_setpoint"] > at - 0.1
    return summary, state["last_setpoint"] - at


@pytest.mark.parametrize("after", AFTER_A_HEARTBEAT)
def test_a_takeover_is_heard_within_150_ms(after):
    _, late = takeover(after)
    assert late < 0.15


def test_a_vehicle_that_disarms_in_flight_is_heard_at_once():
    """Only a heartbeat tells of that, and none is due yet; CURRENT_MODE makes us ask for one."""
    at = None

    def kill():
        nonlocal at
        at = mock.state()["time"]
        mock.command(400, 0, 21196)

    with mock_vehicle(in_lockstep=True) as mock:
        summary = fly(mock, None, When("maneuvers", kill, after=1.0))
        state = mock.state()
    assert summary.result == "the vehicle disarmed in flight"
    assert floor(at) + 1.0 - at > 0.3
    assert state["last_setpoint"] - at < 0.15


def test_without_current_mode_the_heartbeat_tells():
    """As before PX4 1.15, which has no such message."""
    silent = {"kind": "stop_telemetry", "messages": ["CURRENT_MODE"]}
    _, late = takeover(0.35, faults=[silent])
    assert 0.6 < late < 0.7


def test_one_that_comes_early_asks_for_a_heartbeat():
    """It may mean that the vehicle disarmed, which only a heartbeat tells."""
    now, asked, answer = 0.0, [], asyncio.Event()

    async def fresh_heartbeat():
        asked.append(now)
        await answer.wait()

    context = SimpleNamespace(
        snapshot_builder=SimpleNamespace(read_counters=lambda _: None),
        ground=SimpleNamespace(update=lambda: None),
        replacement_detector=SimpleNamespace(update=lambda: None, require=lambda: None),
        fresh_heartbeat=fresh_heartbeat,
    )

    async def run():
        watch = Watch(context, None, None, lambda: now)

        async def comes(at):
            nonlocal now
            now = at
            watch.on_current_mode(PHASE)
            await asyncio.sleep(0)

        for at in (0.5, 1.0, 1.5):
            await comes(at)
        assert asked == []
        for at in (1.7, 1.8):  # not twice while the first is not answered
            await comes(at)
        assert asked == [1.7]
        answer.set()
        await asyncio.sleep(0)
        await comes(1.9)
        assert asked == [1.7, 1.9]

    asyncio.run(run())


@pytest.mark.parametrize(
    ("mode", "failsafe", "taking_over", "goes_on"),
    [
        (Role.OFFBOARD, False, False, True),
        (Role.OFFBOARD, False, True, True),
        (Role.READY, False, True, True),  # not entered yet, and entered only with a stream
        (Role.READY, True, True, False),  # its failsafe holds; a setpoint would end that
        (Role.READY, False, False, False),
        (Role.LAND, True, True, False),
    ],
)
async def test_after_a_gap_only_a_fresh_heartbeat_lets_us_go_on(
    mode, failsafe, taking_over, goes_on
):
    """After a stall one that waited to be read says what was, and looks new."""
    resumed, answer = [], asyncio.Event()
    loop = SimpleNamespace(
        awaiting_mode=True,
        offboard_active=False,
        taking_over=taking_over,
        record=SimpleNamespace(gap_start=0.0),
        resume=lambda: resumed.append(1),
    )
    state = SimpleNamespace(mode=Role.OFFBOARD, failsafe=False, mode_not_intended=False)
    autopilot = SimpleNamespace(roles=lambda mode: frozenset({mode}))
    context = SimpleNamespace(
        snapshot_builder=SimpleNamespace(read_counters=lambda _: None),
        ground=SimpleNamespace(update=lambda: None),
        replacement_detector=SimpleNamespace(update=lambda: None, require=lambda: None),
        config=Config(),
        loop=loop,
        link=SimpleNamespace(state=state, autopilot=autopilot),
        fresh_heartbeat=answer.wait,
    )

    watch = Watch(context, None, None, lambda: 0.0)
    watch.request_mode()
    await asyncio.sleep(0)
    watch.check(PHASE)  # the one that waited to be read
    assert resumed == []
    state.mode, state.failsafe = mode, failsafe
    answer.set()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert bool(resumed) is goes_on
