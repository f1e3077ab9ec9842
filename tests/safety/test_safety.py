"""The safety ladder: each monitor's breach, how long it must last, and the action."""

from math import cos, degrees, inf, radians, sin
from types import SimpleNamespace

import pytest

from companion.config import Config
from companion.control.loop_record import LoopRecord, UnansweredReason
from companion.guidance.fence import LatLon, inside, local_polygon
from companion.safety import Action, SafetyLadder, monitors
from companion.safety.actions import StreamEffect
from companion.safety.counter_window import CounterWindow
from companion.safety.monitor import Alarm, Monitor
from companion.safety.snapshot import AutopilotStatus, Control, Health, Motion, Resets, Snapshot
from companion.vehicle.records import Battery, EstimatorStatus, Gps
from companion.vehicle.timesync import Uplink

CONFIG = Config.model_validate({"limits": {"fence_radius_m": 60.0}})
NOW = 100.0
LEVEL = (1.0, 0.0, 0.0, 0.0)
GOOD = 0x33F


def roll(angle_deg):
    half = 0.5 * radians(angle_deg)
    return cos(half), sin(half), 0.0, 0.0


FINE = Snapshot(
    NOW,
    AutopilotStatus(
        battery=Battery(inf, 16.0, 0.9),
        gps=Gps(inf, 3, 12, 500.0),
        estimator=EstimatorStatus(inf, GOOD),
    ),
    Motion(
        LEVEL, (0.1, 0.0, 0.0), (1.0, 2.0, -1.0), (1.0, 1.0, 0.0), 6.0, 0.2, 0.5, LatLon(47.0, 8.0)
    ),
    Control(),
    Health(0.01, 0.02, 0.01, 0.01),
    had_gps=True,
    initial_estimator_flags=GOOD,
)


def autopilot(**changes):
    return FINE._replace(autopilot=FINE.autopilot._replace(**changes))


def motion(**changes):
    return FINE._replace(motion=FINE.motion._replace(**changes))


def health(**changes):
    return FINE._replace(health=FINE.health._replace(**changes))


def control(**changes):
    return FINE._replace(control=Control(**changes))


def unanswered(reason, **changes):
    return control(last_answered_arrival=OLD, reason=reason, **changes)


OLD = NOW - 0.6
SILENT = {"last_answered_arrival": OLD, "last_sample_arrival": OLD}
WARN, HOLD, HAND_BACK, LAND, LISTEN, RELEASE = Action
STALLED = "this program did not run for 0.4 s (computer overloaded or suspended)"
TILTED = "the vehicle tilts by 57°, more than limits.max_tilt_deg + safety.tilt_margin_deg = 55"
BREACHES = [
    (
        "unheard",
        control(**SILENT, last_frame_noticed=OLD),
        LISTEN,
        0.0,
        "no attitude from the vehicle for 0.6",
    ),
    ("silence", control(**SILENT), HAND_BACK, 0.0, "no attitude"),
    ("silence", unanswered(UnansweredReason.NOT_NEWER), HAND_BACK, 0.0, "clock stands still"),
    ("silence", unanswered(UnansweredReason.STAMPED_AHEAD), HAND_BACK, 0.0, "stamped far ahead"),
    ("silence", unanswered(UnansweredReason.LATE), HAND_BACK, 0.0, "telemetry_stale_ms"),
    ("silence", unanswered(UnansweredReason.LATE, stall_time=0.2), HAND_BACK, 0.0, "stale_ms"),
    ("silence", unanswered(UnansweredReason.LATE, stall_time=0.4), HAND_BACK, 0.0, STALLED),
    (
        "silence",
        unanswered(UnansweredReason.AWAITING_MODE, stall_time=0.4),
        HAND_BACK,
        0.0,
        STALLED,
    ),
    ("unheard", control(**SILENT, last_frame_noticed=OLD, stall_time=0.4), LISTEN, 0.0, STALLED),
    (
        "silence",
        unanswered(UnansweredReason.OLD_TARGET, last_position_arrival=OLD),
        HAND_BACK,
        0.0,
        "no position",
    ),
    (
        "silence",
        unanswered(UnansweredReason.OLD_TARGET, position_fresh=False),
        HAND_BACK,
        0.0,
        "position_stale_ms",
    ),
    ("silence", unanswered(UnansweredReason.OLD_TARGET), HAND_BACK, 0.0, "guidance makes no"),
    ("silence", unanswered(UnansweredReason.AWAITING_MODE), HAND_BACK, 0.0, "did not confirm"),
    ("silence", unanswered(UnansweredReason.INVALID_ATTITUDE), HAND_BACK, 0.0, "cannot be used"),
    ("silence", unanswered(UnansweredReason.NOT_SENT), HAND_BACK, 0.0, "cannot be sent"),
    (
        "frozen",
        health(frozen_telemetry="it repeats"),
        HAND_BACK,
        0.0,
        "frozen telemetry: it repeats",
    ),
    ("clock", control(clock_change="the vehicle's clock jumped"), HAND_BACK, 0.0, "jumped"),
    ("disarmed", autopilot(armed=False), RELEASE, 0.0, "disarmed in flight"),
    ("landed", autopilot(landed=True), LAND, 0.0, "landed"),
    ("failsafe", autopilot(failsafe=True), HAND_BACK, 0.0, "failsafe"),
    ("battery", autopilot(battery=Battery(inf, 14.0, 0.15)), LAND, 0.2, "battery at 15 %"),
    ("battery", autopilot(battery=Battery(NOW - 6.0, 16.0, 0.9)), LAND, 0.2, "not reported"),
    ("battery", autopilot(battery=Battery(NOW, 16.0, None, NOW - 6.0)), LAND, 0.2, "charge is not"),
    ("gps", autopilot(gps=Gps(NOW, 1, 3, 500.0)), LAND, 0.2, "GPS position lost"),
    ("gps", autopilot(gps=Gps(NOW - 6.0, 3, 12, 500.0)), LAND, 0.2, "GPS is not reported"),
    ("estimator", autopilot(estimator=EstimatorStatus(NOW - 6.0, GOOD)), LAND, 0.5, "not reported"),
    (
        "estimator",
        autopilot(estimator=EstimatorStatus(NOW, GOOD & ~0x1)),
        LAND,
        0.5,
        "valid attitude",
    ),
    (
        "estimator",
        autopilot(estimator=EstimatorStatus(NOW, GOOD & ~0x18)),
        LAND,
        0.5,
        "valid position",
    ),
    ("reset", FINE._replace(resets=Resets(1, 0.5, 0.3)), WARN, 0.1, "0.5 m and 17°"),
    ("resets", FINE._replace(resets=Resets(4)), LAND, 0.0, "reset 4 times"),
    ("resets", FINE._replace(resets=Resets(1, 1.1)), LAND, 0.0, "reset by 1.1 m"),
    ("resets", FINE._replace(resets=Resets(1, 0.0, -0.8)), LAND, 0.0, "46° of heading"),
    ("resets", FINE._replace(resets=Resets(1, 0.0, 0.0, 0.4)), LAND, 0.0, "23° of tilt"),
    ("heading", FINE._replace(resets=Resets(heading_drift=0.6)), LAND, 0.0, "changed by 34°"),
    (
        "height",
        FINE._replace(resets=Resets(height_contradiction=1.6)),
        LAND,
        0.1,
        "by 1.6 m",
    ),
    ("tilt", motion(q=roll(57.0)), HAND_BACK, 0.3, TILTED),
    ("body rate", motion(body_rates=(0.0, 0.0, -7.1)), HAND_BACK, 0.2, "407°/s, faster than"),
    ("fence", motion(offset=(50.0, 35.0, 0.0)), LAND, 0.0, "61.0 m from where control began"),
    ("fence", motion(offset=(0.0, 0.0, -30.1), velocity=(0, 0, 0)), LAND, 0.0, "ceiling"),
    ("fence", motion(height=0.9, velocity=(0, 0, 0)), LAND, 0.0, "0.9 m above home"),
    ("braking", motion(offset=(0.0, 50.0, 0.0), velocity=(0.0, 6.5, 0.0)), HOLD, 0.04, "60.9 m"),
    ("braking", motion(velocity=(0.0, 0.0, 4.5), height=6.0), HOLD, 0.04, "0.6 m above home"),
    ("speed", motion(velocity=(11.0, 11.0, 0.0)), HOLD, 0.3, "15.6 m/s"),
    ("tracking", motion(tracking_error=5.1), HOLD, 1.0, "5.1 m from its reference"),
    ("thrust", motion(thrust=0.9), HOLD, 2.0, "limits.max_thrust"),
    ("thrust", motion(thrust=0.1), HOLD, 2.0, "limits.min_thrust"),
    ("answer gaps", health(gaps=3), HAND_BACK, 0.0, "setpoints paused 3 times within 5 s"),
    ("answer rate", health(answer_rate=49.0), HAND_BACK, 1.0, "sent at 49 Hz, below link.min"),
    ("position rate", health(position_rate=9.0), HAND_BACK, 1.0, "come at 9 Hz, below link.min"),
    ("late setpoints", health(uplink=Uplink(0.16)), HAND_BACK, 0.0, "160 ms, longer than 1.5"),
    ("lost setpoints", health(uplink=Uplink(0.01, 8)), HAND_BACK, 0.0, "the last 8 TIMESYNC"),
    (
        "foreign setpoints",
        health(foreign_reports=3),
        HAND_BACK,
        0.3,
        "another program sends setpoints",
    ),
    ("rare setpoint", health(any_foreign_report=True), WARN, 1.0, "now and then"),
    ("link loss", health(lost_share=0.45), WARN, 2.0, "45 % of the vehicle's frames"),
    ("round trip", health(round_trip=0.2), WARN, 5.0, "200 ms"),
    ("deadlines", health(missed_share=0.3), HAND_BACK, 1.5, "30 % of the setpoints"),
    ("starvation", health(starved_share=0.6), HAND_BACK, 1.5, "60 %"),
]


class Climb:
    """A ladder, stepped every 20 ms, that keeps its messages."""

    def __init__(self, config=CONFIG, table=None):
        self.told = []
        self.now = NOW
        self.ladder = SafetyLadder(table or monitors(config), config.safety.hold_s)
        self.ladder.note = self.told.append

    def see(self, snapshot, seconds):
        """The first verdict within `seconds`, and the time until it came, s."""
        for step in range(round(seconds / 0.02) + 1):
            verdict = self.ladder.step(snapshot._replace(now=self.now))
            self.now += 0.02
            if verdict is not None:
                return verdict, 0.02 * step
        return None, None


def test_a_stall_of_our_own_is_counted_from_the_last_setpoint():
    """The counters are read every 20 ms; a reading that is less than 10 ms late is no stall."""
    state = SimpleNamespace(position_count=0)
    link = SimpleNamespace(state=state, stats=SimpleNamespace(frames=0, lost=0))
    window = CounterWindow(link, LoopRecord(), real_time=True)
    for now in (0.0, 0.02, 0.05, 0.48, 0.5):
        window.read(now)
    assert window.stall_time(since=0.02) == pytest.approx(0.4)
    assert window.stall_time(since=0.49) == 0.0
    window.read(3.53)
    assert window.stall_time(since=0.49) == pytest.approx(3.0)
    assert window.stall_time(since=3.53) == 0.0


def test_in_lockstep_a_jump_of_time_is_a_silent_vehicle_and_no_stall_of_ours():
    state = SimpleNamespace(position_count=0)
    link = SimpleNamespace(state=state, stats=SimpleNamespace(frames=0, lost=0))
    window = CounterWindow(link, LoopRecord(), real_time=False)
    for now in (0.0, 0.02, 2.02):
        window.read(now)
    assert window.stall_time(since=0.0) == 0.0


@pytest.mark.parametrize(
    ("name", "snapshot", "action", "raise_after", "words"),
    BREACHES,
    ids=[f"{row[0]}-{row[4]}" for row in BREACHES],
)
def test_a_breach_leads_to_its_action_once_it_lasts(name, snapshot, action, raise_after, words):
    table = monitors(CONFIG)
    alarms = {monitor.name: Alarm(monitor) for monitor in table}
    wrong = [monitor.name for monitor in table if monitor.check(snapshot, False)]
    assert wrong == (["reset", "resets"] if name == "resets" else [name])
    assert words in alarms[name].monitor.check(snapshot, False)
    monitor = alarms[name].monitor
    assert (monitor.action, monitor.raise_after) == (action, raise_after)
    assert alarms[name].step(snapshot) is (raise_after == 0.0)
    if raise_after > 0.0:
        assert not alarms[name].step(snapshot._replace(now=NOW + raise_after - 0.01))
        assert alarms[name].step(snapshot._replace(now=NOW + raise_after + 0.001))


def test_every_row_of_the_table_is_tried_here_and_a_calm_flight_raises_none():
    table = monitors(CONFIG)
    assert {row[0] for row in BREACHES} == {monitor.name for monitor in table}
    assert [m.name for m in table if m.check(FINE, False)] == []
    assert [m.name for m in table if m.check(Snapshot(NOW), False)] == []


def test_what_the_rows_of_the_table_say_besides_action_and_time():
    table = monitors(Config.model_validate({"safety": {"fence_action": "hand_back"}}))
    clear_after = {"battery": 5.0, "link loss": 2.0, "round trip": 5.0}
    assert {row.name: row.clear_after for row in table} == {
        row.name: clear_after.get(row.name, 1.0) for row in table
    }
    assert [row.name for row in table if row.stream is StreamEffect.STOPS_AT_ONCE] == [
        "unheard",
        "silence",
        "clock",
    ]
    assert [row.name for row in table if row.stream is StreamEffect.ENDS_WITH_ZERO_RATES] == [
        "frozen",
        "late setpoints",
        "lost setpoints",
    ]
    after_hold = {row.name: row.action_after_hold for row in table if row.action is HOLD}
    assert after_hold == {"braking": HAND_BACK, "speed": LAND, "tracking": LAND, "thrust": LAND}


def test_tilt_is_a_breach_only_above_the_largest_commanded_tilt_and_its_margin():
    limit = degrees(CONFIG.limits.max_tilt + CONFIG.safety.tilt_margin)
    assert CONFIG.safety.tilt_margin > 0.0
    (tilt,) = (row for row in monitors(CONFIG) if row.name == "tilt")
    assert tilt.check(motion(q=roll(limit - 0.1)), False) is None
    assert tilt.check(motion(q=roll(limit + 0.1)), False)


def test_a_breach_that_comes_and_goes_is_not_one_and_an_alarm_needs_calm_to_be_over():
    monitor = Monitor("odd", lambda s, _: "wrong" if s.now % 1.0 < 0.4 else None, WARN, 0.5, 0.5)
    alarm = Alarm(monitor)
    assert not any(alarm.step(FINE._replace(now=NOW + 0.1 * k)) for k in range(50))
    latched = Alarm(Monitor("odd", monitor.check, WARN, raise_after=0.25, clear_after=0.7))
    changes = [k for k in range(50) if latched.step(FINE._replace(now=NOW + 0.1 * k))]
    assert len(changes) == 1  # 0.6 s of calm in each second are not enough


def test_over_the_limit_is_over_only_well_within_it():
    climb = Climb()
    speeding, less = (motion(velocity=(v, 0.0, 0.0)) for v in (15.1, 14.5))
    verdict, after = climb.see(speeding, 1.0)
    assert (verdict.action, after) == (HOLD, pytest.approx(0.3, abs=0.021))
    verdict, after = climb.see(less, 5.0)
    assert (verdict.action, after) == (LAND, pytest.approx(3.0, abs=0.021))
    assert climb.told == [
        "safety: speed: the vehicle flies at 15.1 m/s, faster than safety.max_speed_m_s = 15 → hold"
    ]


def test_a_hold_that_mends_it_ends_by_landing_with_what_it_was_for():
    climb = Climb()
    climb.see(motion(tracking_error=6.0), 2.0)
    verdict, after = climb.see(FINE, 5.0)
    assert verdict.action is LAND
    assert "6.0 m from its reference" in verdict.reason
    assert after == pytest.approx(1.0, abs=0.021)
    assert climb.told[-1] == "safety: tracking alarm is over"


def test_a_vehicle_that_still_brakes_is_not_landed_before_it_rests_but_after_the_hold_time():
    moving = FINE._replace(motion=FINE.motion._replace(moves_to_hold=True))
    for braked_for, expected in ((2.0, 2.0), (60.0, CONFIG.safety.hold_s)):
        climb = Climb()
        verdict, _ = climb.see(motion(tracking_error=6.0, moves_to_hold=True), 2.0)
        assert verdict.action is HOLD
        held_at = climb.now - 0.02
        climb.see(moving, min(braked_for, expected) - 0.06)
        verdict, _ = climb.see(FINE if braked_for == expected else moving, 2.0)
        assert verdict.action is LAND
        assert climb.now - held_at == pytest.approx(expected, abs=0.1)


def test_a_graver_breach_ends_a_hold_and_the_gravest_of_two_decides():
    climb = Climb()
    climb.see(motion(tracking_error=6.0), 2.0)
    both = autopilot(armed=False, failsafe=True)
    verdict, after = climb.see(both, 1.0)
    assert (verdict.action, verdict.reason, after) == (
        RELEASE,
        "the vehicle disarmed in flight",
        0.0,
    )


def test_a_warning_is_told_once_and_when_it_is_over():
    climb = Climb()
    assert climb.see(health(lost_share=0.5), 4.0) == (None, None)
    assert climb.see(FINE, 4.0) == (None, None)
    assert [text.split(":")[1] for text in climb.told] == [" link loss", " link loss alarm is over"]


def test_an_action_can_be_set_but_not_everywhere_to_a_warning():
    warned = Config.model_validate({"safety": {"battery_action": "warn"}})
    climb = Climb(warned)
    assert climb.see(autopilot(battery=Battery(inf, 14.0, 0.1)), 1.0) == (None, None)
    assert "→ warn" in climb.told[0]
    with pytest.raises(ValueError, match="fence_action"):
        Config.model_validate({"safety": {"fence_action": "warn"}})


def test_in_silence_nothing_is_sent_any_more():
    verdict, _ = Climb().see(control(**SILENT), 0.0)
    assert verdict.stream is StreamEffect.STOPS_AT_ONCE
    verdict, _ = Climb().see(autopilot(landed=True), 0.0)
    assert verdict.stream is StreamEffect.CONTINUES


L_SHAPE = ((-10.0, -10.0), (-10.0, 10.0), (10.0, 10.0), (10.0, -1.0), (1.0, -1.0), (1.0, -10.0))


@pytest.mark.parametrize(
    ("north", "east", "within"),
    [(5.0, 5.0, True), (-5.0, -5.0, True), (5.0, -5.0, False), (0.0, 11.0, False), (-11, 0, False)],
)
def test_a_polygon_has_an_inside(north, east, within):
    assert inside(north, east, L_SHAPE) is within
    assert inside(north, east, L_SHAPE[::-1]) is within


def test_the_polygon_is_judged_about_where_control_began_or_on_the_map():
    local = Config.model_validate({"safety": {"fence_polygon_m": L_SHAPE}})
    verdict, _ = Climb(local).see(motion(offset=(5.0, -5.0, 0.0)), 0.0)
    where = "5.0 m north and -5.0 m east of where control began"
    assert verdict.action == LAND
    assert verdict.reason == f"{where}, outside safety.fence_polygon_m"
    degree = 111_194.9  # m of latitude
    map_corners = [(47.0 + n / degree, 8.0 + e / degree / cos(radians(47.0))) for n, e in L_SHAPE]
    flat = [
        value for corner in local_polygon(tuple(map_corners), LatLon(47.0, 8.0)) for value in corner
    ]
    assert flat == pytest.approx([value for corner in L_SHAPE for value in corner], abs=0.01)
    on_map = Config.model_validate({"safety": {"fence_polygon_deg": map_corners}})
    assert Climb(on_map).see(motion(offset=(5.0, 5.0, 0.0), velocity=(0, 0, 0)), 0.1)[0] is None
    verdict, _ = Climb(on_map).see(motion(offset=(5.0, -5.0, 0.0)), 0.0)
    assert verdict.action is LAND
    verdict, _ = Climb(on_map).see(motion(origin=None), 0.0)
    assert "not known" in verdict.reason
