"""Whose vehicle it is among the clients."""

import random

import pytest

from companion.serve.ownership import ControlState, Ownership

TIMEOUT, HOLD = 0.5, 2.0


@pytest.fixture
def ownership():
    return Ownership(TIMEOUT, HOLD)


def stream(ownership, client, begin, end, period=0.1):
    refusals, now = [], begin
    while now <= end:
        refusals.append(ownership.note_setpoint(client, now))
        now += period
    return refusals


def test_control_needs_a_fresh_setpoint_as_px4_does(ownership):
    assert "setpoints first" in ownership.request_control("a", 0.0)
    ownership.note_setpoint("a", 0.0)
    assert "setpoints first" in ownership.request_control("a", TIMEOUT + 0.1), "too old"
    ownership.note_setpoint("a", 1.0)
    assert ownership.request_control("a", 1.1) is None
    assert ownership.owner == "a"


def test_one_setpoint_alone_is_no_stream(ownership):
    ownership.note_setpoint("a", 0.0)
    assert not ownership.has_stream("a", 0.1)
    ownership.note_setpoint("a", 0.4)
    assert ownership.has_stream("a", 0.5)
    assert not ownership.has_stream("a", 1.0)
    ownership.note_setpoint("a", 2.0)
    assert not ownership.has_stream("a", 2.1)


def test_a_setpoint_that_cannot_be_flown_keeps_nobody_live(ownership):
    ownership.note_setpoint("a", 0.0)
    ownership.request_control("a", 0.1)
    for number in range(10):
        now = 0.2 + 0.1 * number
        assert ownership.note_setpoint("a", now) is None
        ownership.withdraw("a", "a")
    assert ownership.state(now) is ControlState.HOLDING
    before = ownership.owner
    assert ownership.note_setpoint("b", now) is None
    ownership.withdraw("b", before)
    assert ownership.owner == "a"


def test_setpoints_without_asking_give_no_control(ownership):
    stream(ownership, "a", 0.0, 1.0)
    assert ownership.state(1.0) is ControlState.FREE


def test_another_clients_setpoints_are_refused_by_name_while_the_owner_is_live(ownership):
    stream(ownership, "a", 0.0, 1.0)
    ownership.request_control("a", 1.0)
    assert set(stream(ownership, "b", 1.0, 1.45)) == {"a is in control"}
    assert ownership.request_control("b", 1.2) == "a is in control"
    assert ownership.owner == "a"


def test_a_silent_owner_is_held_for_and_then_handed_back(ownership):
    stream(ownership, "a", 0.0, 1.0)
    ownership.request_control("a", 1.0)
    now = 1.0
    assert ownership.state(now + TIMEOUT - 0.01) is ControlState.LIVE
    assert ownership.state(now + TIMEOUT + 0.01) is ControlState.HOLDING
    assert ownership.state(now + TIMEOUT + HOLD - 0.01) is ControlState.HOLDING
    assert ownership.state(now + TIMEOUT + HOLD + 0.01) is ControlState.EXPIRED


def test_an_owner_that_resumes_is_live_again(ownership):
    stream(ownership, "a", 0.0, 1.0)
    ownership.request_control("a", 1.0)
    ownership.note_setpoint("a", 2.0)
    assert ownership.state(2.1) is ControlState.LIVE


def test_another_client_takes_over_from_a_silent_owner(ownership):
    stream(ownership, "a", 0.0, 1.0)
    ownership.request_control("a", 1.0)
    assert ownership.note_setpoint("b", 1.6) is None
    assert ownership.owner == "b"
    assert ownership.note_setpoint("a", 1.7) == "b is in control"


def test_after_release_nobody_is_in_control(ownership):
    stream(ownership, "a", 0.0, 1.0)
    ownership.request_control("a", 1.0)
    ownership.release()
    assert ownership.state(1.1) is ControlState.FREE
    assert ownership.note_setpoint("b", 1.1) is None


def test_many_clients_are_not_remembered_for_ever(ownership):
    for number in range(1000):
        ownership.note_setpoint(number, float(number))
    assert len(ownership._streams) < 100


def test_at_any_time_only_a_live_owner_is_flown(ownership):
    """Random clients: a refused setpoint never comes from the owner, and the owner only changes
    when it was silent, or nobody had control."""
    rng, now, newest = random.Random(3), 0.0, {}
    for _ in range(5000):
        now += rng.choice((0.01, 0.1, 0.3, 0.7))
        client, before = rng.choice("abc"), ownership.owner
        match rng.randrange(10):
            case 0:
                ownership.request_control(client, now)
            case 1:
                ownership.release()
                continue
            case _:
                refusal = ownership.note_setpoint(client, now)
                assert (refusal is None) or client != before
                if refusal is None:
                    newest[client] = now
        if before is not None and ownership.owner != before:
            assert now - newest.get(before, -9.0) > TIMEOUT
        if ownership.state(now) is ControlState.LIVE:
            assert now - newest[ownership.owner] <= TIMEOUT
