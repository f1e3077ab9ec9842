"""Each monitor at its limit: on which side it is a breach, when it is over, and what it says."""

from math import cos, inf, sin

import pytest

from companion.config import Config
from companion.control.loop_record import UnansweredReason
from companion.guidance.fence import Fence, LatLon
from companion.safety import (
    Action,
    SafetyLadder,
    Verdict,
    autopilot_breaches,
    link_breaches,
    motion_breaches,
)
from companion.safety.actions import Exit, FlightEnded, StreamEffect
from companion.safety.link_breaches import silence
from companion.safety.monitor import Monitor
from companion.safety.motion_breaches import braking
from companion.safety.snapshot import AutopilotStatus, Control, Health, Motion, Resets, Snapshot
from companion.safety.table import monitors
from companion.vehicle.records import Battery, EstimatorStatus
from companion.vehicle.timesync import Uplink

NOW = 100.0
OLD = NOW - 6.0


def at(**parts):
    return Snapshot(NOW, **parts)


def health(name):
    return lambda value: at(health=Health(**{name: value}))


def leaning(angle):
    """Pitched, so that only the second component of the vector part tells it."""
    return at(motion=Motion(q=(cos(0.5 * angle), 0.0, sin(0.5 * angle), 0.0)))


UPPER = {
    "tilt": (motion_breaches.tilt, leaning),
    "body rate": (
        motion_breaches.body_rate,
        lambda v: at(motion=Motion(body_rates=(0.6 * v, 0, 0.8 * v))),
    ),
    "speed": (
        motion_breaches.speed,
        lambda v: at(motion=Motion(velocity=(0.6 * v, -0.8 * v, 0.0))),
    ),
    "tracking": (motion_breaches.tracking, lambda v: at(motion=Motion(tracking_error=v))),
    "link loss": (link_breaches.loss, health("lost_share")),
    "round trip": (link_breaches.round_trip, health("round_trip")),
    "late setpoints": (
        lambda most: link_breaches.late_setpoints(most / 1.5),
        lambda v: at(health=Health(uplink=Uplink(v))),
    ),
    "deadlines": (link_breaches.deadlines, health("missed_share")),
    "starvation": (link_breaches.starvation, health("starved_share")),
}
LOWER = {
    "answer rate": (link_breaches.answer_rate, health("answer_rate")),
    "position rate": (link_breaches.position_rate, health("position_rate")),
}


@pytest.mark.parametrize("name", UPPER)
def test_an_upper_limit_is_allowed_and_a_breach_is_over_below_nine_tenths_of_it(name):
    check, seen = UPPER[name]
    if name != "tilt":  # an angle from a quaternion is not exact
        assert check(0.5)(seen(0.5), False) is None
    assert check(0.0)(seen(0.0), False) is None
    assert check(0.5)(seen(0.4999), False) is None
    assert check(0.5)(seen(0.5001), False)
    assert check(0.5)(seen(0.4501), True)
    assert check(0.5)(seen(0.4499), True) is None


@pytest.mark.parametrize("name", LOWER)
def test_a_lower_limit_is_allowed_and_a_breach_is_over_a_ninth_above_it(name):
    check, seen = LOWER[name]
    assert check(45.0)(seen(45.0), False) is None
    assert check(45.0)(seen(44.9), False)
    assert check(45.0)(seen(49.9), True)
    assert check(45.0)(seen(50.1), True) is None


def test_counts_and_shares_at_their_limit_are_allowed():
    assert link_breaches.gaps(2)(at(health=Health(gaps=2)), False) is None
    assert (
        autopilot_breaches.battery(0.25)(autopilot(battery=Battery(inf, 14.0, 0.25)), False) is None
    )
    found = at(resets=Resets(3, 1.0, -0.5, 0.25))
    assert autopilot_breaches.too_many_estimator_resets(3, 1.0, 0.5)(found, False) is None


def autopilot(**told):
    return at(autopilot=AutopilotStatus(**told))


SAID = [
    (
        lambda: autopilot_breaches.landed,
        autopilot(landed=True),
        "the autopilot says that it has landed",
    ),
    (
        lambda: autopilot_breaches.failsafe,
        autopilot(failsafe=True),
        "the autopilot reports a failsafe",
    ),
    (
        lambda: autopilot_breaches.estimator_flags,
        autopilot(estimator=EstimatorStatus(OLD, 0x33F)),
        "the estimator's state is not reported any more",
    ),
    (
        lambda: autopilot_breaches.any_estimator_reset,
        at(resets=Resets(1, 0.5, 0.3)),
        "the estimator was reset: 0.5 m and 17° of heading in total; the references were moved by "
        "the same amount",
    ),
    (
        lambda: autopilot_breaches.battery(0.2),
        autopilot(battery=Battery(OLD, 16.0, 0.9)),
        "the battery's state is not reported any more",
    ),
    (
        lambda: autopilot_breaches.battery(0.2),
        autopilot(battery=Battery(inf, 16.0, None, OLD)),
        "the battery's charge is not reported any more",
    ),
    (
        lambda: autopilot_breaches.battery(0.7),
        autopilot(battery=Battery(inf, 14.0, 0.6)),
        "battery at 60 %, below limits.min_battery_percent = 70",
    ),
    (
        lambda: link_breaches.loss(0.2),
        at(health=Health(lost_share=0.6)),
        "60 % of the vehicle's frames are lost, more than safety.max_loss = 0.2 (20 %)",
    ),
    (
        lambda: link_breaches.round_trip(0.2),
        at(health=Health(round_trip=0.6)),
        "the link's round trip takes 600 ms, longer than safety.max_round_trip_ms = 200",
    ),
    (
        lambda: link_breaches.late_setpoints(0.1),
        at(health=Health(uplink=Uplink(0.3))),
        "setpoints reach the vehicle too late: the link's round trip takes 300 ms, longer than "
        "1.5 · deadman.telemetry_stale_ms = 150",
    ),
    (
        lambda: link_breaches.lost_setpoints(7),
        at(health=Health(uplink=Uplink(None, 10))),
        "setpoints do not reach the vehicle: the last 10 TIMESYNC requests, ten a second, were not "
        "answered",
    ),
    (
        lambda: link_breaches.foreign_setpoints(2),
        at(health=Health(foreign_reports=3)),
        "another program sends setpoints to the vehicle: within 5 s the autopilot reported 3 that "
        "this program did not send (ATTITUDE_TARGET)",
    ),
    (
        lambda: link_breaches.rare_foreign_setpoint,
        at(health=Health(any_foreign_report=True)),
        "another program may send setpoints to the vehicle now and then: the autopilot reported "
        "one that this program did not send (ATTITUDE_TARGET)",
    ),
    (
        lambda: link_breaches.frozen_telemetry,
        at(health=Health(frozen_telemetry="ATTITUDE_QUATERNION repeats one attitude")),
        "frozen telemetry: ATTITUDE_QUATERNION repeats one attitude",
    ),
    (
        lambda: link_breaches.deadlines(0.2),
        at(health=Health(missed_share=0.6)),
        "60 % of the setpoints miss deadman.deadline_ms, more than safety.max_missed = 0.2 (20 %)",
    ),
    (
        lambda: link_breaches.starvation(0.2),
        at(health=Health(starved_share=0.6)),
        "CPU starvation: the program's timer was late for 60 % of the last second, "
        "more than safety.max_starved = 0.2 (20 %)",
    ),
    (
        lambda: link_breaches.gaps(2),
        at(health=Health(gaps=3)),
        "setpoints paused 3 times within 5 s, each time for longer than deadman.telemetry_stale_ms",
    ),
]
"""A check, the breach that it sees, its words. The tests make the check, so that mutants count."""


@pytest.mark.parametrize(("make", "snapshot", "words"), SAID, ids=[row[2] for row in SAID])
def test_a_breach_is_told_in_these_words(make, snapshot, words):
    assert make()(snapshot, False) == words


def test_lost_velocity_and_lost_position_are_told_together():
    lost = at(
        autopilot=AutopilotStatus(estimator=EstimatorStatus(NOW, 0x33F & ~0x1A)),
        initial_estimator_flags=0x33F,
    )
    assert autopilot_breaches.estimator_flags(lost, False).endswith(
        "no valid velocity, position any more"
    )


def silent(reason=None, **changes):
    """Unanswered for 0.75 s, 0.5 s of them without an attitude: all exact in binary."""
    stages = {
        "last_answered_arrival": NOW - 0.75,
        "last_sample_arrival": NOW - 0.5,
        "last_position_arrival": NOW - 0.5,
        "reason": reason,
    }
    return at(control=Control(**{**stages, **changes}))


@pytest.mark.parametrize(
    ("snapshot", "words"),
    [
        (silent(), "no setpoint was sent"),
        (silent(UnansweredReason.LATE), UnansweredReason.LATE.text),
        (silent(UnansweredReason.LATE, stall_time=0.375), UnansweredReason.LATE.text),
        (silent(UnansweredReason.OLD_TARGET), UnansweredReason.OLD_TARGET.text),
        (
            silent(last_sample_arrival=NOW - 0.6, attitude_not_finite=True),
            "the vehicle's attitude is not finite (NaN or infinity)",
        ),
        (
            silent(UnansweredReason.NO_TARGET, last_position_arrival=NOW - 0.6),
            "no position from the vehicle",
        ),
        (
            silent(
                UnansweredReason.NO_TARGET,
                last_position_arrival=NOW - 0.6,
                position_not_finite=True,
            ),
            "the vehicle's position is not finite (NaN or infinity)",
        ),
        (
            silent(UnansweredReason.OLD_TARGET, position_fresh=False),
            "positions arrive, but older than deadman.position_stale_ms",
        ),
        (
            silent(UnansweredReason.OLD_TARGET, command_not_finite=True),
            "the commands of guidance (guidance.kind: linear) are NaN or infinite",
        ),
        (
            silent(UnansweredReason.INVALID_RATES),
            "the planner (planner.name: auto) gives no body rates: they are NaN or infinite, or it "
            "refuses the target",
        ),
    ],
)
def test_silence_tells_the_stage_that_failed_for_longer_than_its_limit(snapshot, words):
    assert silence(0.5, vehicle_heard=True)(snapshot, False) == words


def test_exactly_the_limit_of_silence_is_none_and_a_vehicle_not_heard_cannot_be_asked():
    assert silence(0.75, vehicle_heard=True)(silent(), False) is None
    unheard = silent(last_frame_noticed=NOW - 0.75)
    assert silence(0.5, vehicle_heard=True)(unheard, False) is None
    assert silence(0.5, vehicle_heard=False)(unheard, False)
    at_the_limit = Snapshot(
        0.3, control=Control(last_answered_arrival=-1.0, last_frame_noticed=0.0)
    )
    assert silence(0.5, vehicle_heard=False)(at_the_limit, False)
    verdict = SafetyLadder(monitors(Config()), 1.0).step(unheard)
    assert (verdict.action, verdict.stream) == (Action.LISTEN, StreamEffect.STOPS_AT_ONCE)


def test_it_brakes_in_time_before_a_fence_on_the_map():
    corners = ((46.999, 7.999), (46.999, 8.001), (47.001, 8.001), (47.001, 7.999))  # 111 m north
    check = braking(Fence(inf, inf, -inf, (), corners, 2.0, 0.5))
    moving = Motion(
        offset=(80.0, 0.0, 0.0), velocity=(2.0, 0.0, 0.0), height=20.0, origin=LatLon(47.0, 8.0)
    )
    assert check(at(motion=moving), False) is None  # stops 2 m on
    fast = moving._replace(velocity=(12.0, 0.0, 0.0))  # stops 42 m on
    assert "braking now would end" in check(at(motion=fast), False)


@pytest.mark.parametrize("more", [{"acceleration": (4.0, 0.0)}, {"wind": (2.0, 0.0)}])
def test_it_brakes_earlier_while_the_vehicle_still_gains_speed_and_in_tail_wind(more):
    check = braking(Fence(10.0, inf, -inf, (), (), 2.0, 0.5, tilt_acceleration=3.0))
    moving = Motion(offset=(6.5, 0.0, 0.0), velocity=(2.0, 0.0, 0.0), height=20.0)
    assert check(at(motion=moving), False) is None  # stops 2 m on
    assert "braking now would end" in check(at(motion=moving._replace(**more)), False)


def odd(name, action_after_hold=Action.LAND, action=Action.HOLD):
    """A monitor that is wrong while its bit of the flags is set: 1 for a, 2 for b."""
    bit = 1 << "ab".index(name)
    reason = f"reason {name}"
    return Monitor(
        name,
        lambda s, _: reason if s.initial_estimator_flags & bit else None,
        action,
        action_after_hold=action_after_hold,
    )


def test_what_holding_does_not_mend_goes_on_to_the_graver_next_rung_in_time():
    told = []
    ladder = SafetyLadder([odd("a", Action.HAND_BACK), odd("b", Action.LAND)], 2.0)
    ladder.note = told.append
    both = Snapshot(0.0, initial_estimator_flags=3)
    assert ladder.step(both) == Verdict(Action.HOLD, "reason a")
    assert ladder.step(both._replace(now=1.75)) is None
    assert ladder.step(both._replace(now=2.0)) == Verdict(Action.LAND, "reason b")
    assert told == ["safety: a: reason a → hold", "safety: b: reason b → hold"]


def test_raised_and_ended_alarms_are_reported_with_name_reason_and_action():
    changes = []
    ladder = SafetyLadder([odd("a"), odd("b", action=Action.WARN)], 2.0)
    ladder.on_change = lambda *change: changes.append(change)
    ladder.step(Snapshot(0.0, initial_estimator_flags=3))
    ladder.step(Snapshot(1.0))
    ladder.step(Snapshot(2.0))
    assert changes == [
        (True, "a", "reason a", "hold"),
        (True, "b", "reason b", "warn"),
        (False, "a", "", ""),
        (False, "b", "", ""),
    ]
    assert ladder.breaches == {"reason a": "a", "reason b": "b"}


def test_a_ladder_that_nobody_listens_to_still_decides():
    assert (
        SafetyLadder([odd("a")], 2.0).step(Snapshot(0.0, initial_estimator_flags=1)).action
        is Action.HOLD
    )


def test_how_a_flight_ended_is_kept_with_its_reason():
    ended = FlightEnded("the fence", Exit.LAND)
    assert (str(ended), ended.reason, ended.exit) == ("the fence", "the fence", Exit.LAND)
    assert FlightEnded("the fence").exit is None
