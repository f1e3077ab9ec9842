"""What telemetry becomes, and what of it is never believed."""

import math

import pytest
from pymavlink.dialects.v20 import common as dialect
from pymavlink.dialects.v20 import development

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.messages import decode
from companion.mavlink.stats import LinkStats
from companion.mavlink.texts import TextAssembler
from companion.vehicle.clock import VehicleClock
from companion.vehicle.state import VehicleState
from tests.mavlink.fakes import heartbeat


class Bench:
    def __init__(self):
        self.now, self.stats = 10.0, LinkStats()
        self.dispatcher = MessageDispatcher(self.stats)
        self.clock = VehicleClock()
        self.state = VehicleState(
            self.dispatcher, self.stats, TextAssembler(), lambda: self.now, self.clock
        )

    def take(self, message):
        message.pack(dialect.MAVLink(None))
        self.dispatcher.dispatch(message.get_msgId(), bytes(message.get_payload()))
        return self.state


@pytest.fixture
def bench():
    return Bench()


# As PX4 main sends them.
@pytest.mark.parametrize(
    ("base_mode", "custom_mode", "mode", "armed"),
    [
        (29, 0x03040000, "AUTO.LOITER", False),
        (157, 0x02040000, "AUTO.TAKEOFF", True),
        (157, 0x05040000, "AUTO.RTL", True),
        (157, 0x06040000, "AUTO.LAND", True),
        (1, 0x00060000, "OFFBOARD", False),
        (129, 0x00060000, "OFFBOARD", True),
        (129, 0x00630000, "mode 0x00630000", True),
    ],
)
def test_heartbeats(bench, base_mode, custom_mode, mode, armed):
    state = bench.take(dialect.MAVLink_heartbeat_message(2, 12, base_mode, custom_mode, 4, 3))
    assert (state.mode, state.armed) == (mode, armed)
    assert state.heartbeat.received == 10.0
    assert state.heartbeat.system_status == 4
    assert not state.failsafe


ARDUPILOT_HEARTBEAT = dialect.MAVLink_heartbeat_message(2, 3, 217, 4, 4, 3)


def told_target(q, stamp=5000):
    return dialect.MAVLink_attitude_target_message(stamp, 0, q, 0.1, 0.2, 0.3, 0.4)


def test_the_axes_of_the_rates_are_told_by_ardupilot_only(bench):
    """PX4's message holds an old attitude while it is flown by rates."""
    tilted = [0.8, 0.0, 0.6, 0.0]
    assert bench.take(told_target(tilted)).attitude_target is None
    bench.take(px4_heartbeat(0x00060000))
    assert bench.take(told_target(tilted)).attitude_target is None
    ardupilot = Bench()
    ardupilot.take(ARDUPILOT_HEARTBEAT)
    told = ardupilot.take(told_target(tilted)).attitude_target
    assert told.time_boot_ms == 5000
    assert told.q == pytest.approx(tilted)


@pytest.mark.parametrize(
    "q", [[math.nan] * 4, [math.inf, 0.0, 0.0, 0.0], [0.0] * 4, [1.5, 0.0, 0.0, 0.0]]
)
def test_an_attitude_target_that_is_none_is_passed_over(bench, q):
    bench.take(ARDUPILOT_HEARTBEAT)
    before = bench.take(told_target([1.0, 0.0, 0.0, 0.0])).attitude_target
    state = bench.take(told_target(q, 5100))
    assert state.attitude_target is before
    assert bench.stats.non_finite == (0 if all(map(math.isfinite, q)) else 1)


def px4_heartbeat(custom_mode, base_mode=157):
    return dialect.MAVLink_heartbeat_message(2, 12, base_mode, custom_mode, 4, 3)


def test_each_arming_is_counted(bench):
    assert bench.state.arming_count == 0
    for base_mode in (1, 129, 129, 1, 129):
        bench.take(px4_heartbeat(0x00060000, base_mode))
    assert bench.state.arming_count == 2
    assert bench.state.heartbeat == (10.0, "OFFBOARD", True, 4)


def test_an_autopilot_that_is_none_of_ours_is_told_until_one_of_ours_comes(bench):
    assert (bench.state.current_mode, bench.state.unsupported_error) == (None, None)
    state = bench.take(dialect.MAVLink_heartbeat_message(2, 4, 129, 7, 4, 3))
    assert (state.autopilot, state.mode) == (None, "7")
    assert state.unsupported_error is not None
    state = bench.take(px4_heartbeat(0x00060000))
    assert (state.unsupported_error, state.mode) == (None, "OFFBOARD")


def test_the_mode_is_what_came_last_of_heartbeat_and_current_mode(bench):
    offboard, hold = 0x00060000, 0x03040000
    bench.take(development.MAVLink_current_mode_message(0, offboard, offboard))
    assert bench.state.mode is None  # no heartbeat told yet what the number means
    bench.take(px4_heartbeat(offboard, 129))
    bench.now += 0.1
    bench.take(development.MAVLink_current_mode_message(0, hold, hold))
    assert (bench.state.mode, bench.state.mode_received_at) == ("AUTO.LOITER", 10.1)
    assert (bench.state.armed, bench.state.heartbeat.received) == (True, 10.0)
    assert not bench.state.heartbeat_is_newest
    bench.now += 0.1
    bench.take(px4_heartbeat(offboard, 129))
    assert (bench.state.mode, bench.state.mode_received_at) == ("OFFBOARD", 10.2)
    assert bench.state.heartbeat_is_newest


def test_a_mode_that_nobody_asked_for_is_a_failsafes(bench):
    """PX4 tells of the mode before its next heartbeat tells of the failsafe (recorded)."""
    landing, offboard = 0x06040000, 0x00060000
    bench.take(px4_heartbeat(offboard, 129))
    bench.take(development.MAVLink_current_mode_message(0, landing, landing))
    assert not bench.state.mode_by_failsafe
    bench.take(development.MAVLink_current_mode_message(0, landing, offboard))
    assert bench.state.mode_by_failsafe
    assert not bench.state.failsafe
    bench.take(px4_heartbeat(landing, 129))  # says the same mode, and not yet the failsafe
    assert bench.state.mode_by_failsafe
    bench.take(development.MAVLink_current_mode_message(0, landing, 0))  # 0: unknown
    assert not bench.state.mode_by_failsafe


def test_current_mode_does_not_hide_that_ardupilot_obeys_rates(bench):
    bench.take(dialect.MAVLink_heartbeat_message(2, 3, 209, 4, 4, 3))
    bench.take(development.MAVLink_current_mode_message(0, 4, 4))
    assert bench.state.mode == "GUIDED (body rates)"


@pytest.mark.parametrize(
    ("status", "failsafe"), [(3, False), (4, False), (5, True), (6, True), (7, False), (8, True)]
)
def test_failsafe_is_seen(bench, status, failsafe):
    """Critical, emergency and flight termination, in which the motors have stopped."""
    beat = dialect.MAVLink_heartbeat_message(2, 12, 157, 0x05040000, status, 3)
    assert bench.take(beat).failsafe is failsafe


def test_another_parts_heartbeat_is_not_the_autopilots(bench):
    assert bench.take(heartbeat(autopilot=8)).heartbeat is None


def test_position_with_both_times(bench):
    state = bench.take(dialect.MAVLink_local_position_ned_message(2500, 1, 2, -3, 0.5, -0.5, 0.25))
    assert (state.position.received, state.position.vehicle_time) == (10.0, 2.5)
    assert state.position.position_ned == (1.0, 2.0, -3.0)
    assert state.position.velocity_ned == (0.5, -0.5, 0.25)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_positions_that_are_not_finite_are_counted_never_stored(bench, bad):
    good = dialect.MAVLink_local_position_ned_message(4, 1, 2, -3, 0, 0, 0)
    bench.take(good)
    for place in range(6):
        values = [1.0, 2.0, -3.0, 0.0, 0.0, 0.0]
        values[place] = bad
        bench.take(dialect.MAVLink_local_position_ned_message(8, *values))
    assert bench.state.position.vehicle_time == 0.004
    assert bench.stats.non_finite == 6
    assert bench.stats.non_finite_at == {"LOCAL_POSITION_NED": 10.0}


def position(bench, seconds, north=0.0):
    """The position that is known once one with this stamp came."""
    stamp = round(1e3 * seconds)
    message = dialect.MAVLink_local_position_ned_message(stamp, north, 0, 0, 0, 0, 0)
    return bench.take(message).position


def test_a_position_stamped_no_later_than_the_last_is_counted_never_stored(bench):
    kept = position(bench, 60.0, 1.0)
    assert bench.state.position_count == 1
    for bench.now, stamp in ((10.1, 60.0), (10.2, 59.9), (10.3, 50.0), (20.0, 60.0), (21.0, 57.0)):
        assert position(bench, stamp, 2.0) == kept
    assert bench.stats.outdated == 5
    assert position(bench, 60.1, 3.0).position_ned == (3.0, 0.0, 0.0)
    assert bench.state.position_count == 2


def attitudes(bench, seconds, began=0.0):
    """Samples at 50 Hz of a vehicle that started when our clock showed `began`."""
    for _ in range(round(50 * seconds)):
        bench.now += 0.02
        bench.clock.take(round(1e3 * (bench.now - began)), bench.now)


def test_after_a_new_boot_positions_are_news_again(bench):
    attitudes(bench, 3.0)
    before = position(bench, bench.now).vehicle_time
    attitudes(bench, 1.0, began=12.0)
    after = position(bench, bench.now - 12.0).vehicle_time
    assert bench.clock.restart_count == 1
    assert after == pytest.approx(before + 1.0, abs=0.03)  # time goes on
    assert bench.stats.outdated == 0


def test_a_position_stamped_far_ahead_is_counted_never_stored(bench):
    position(bench, 5000.0, 1.0)  # before the vehicle's clock was known
    attitudes(bench, 3.0)
    kept = position(bench, bench.now, 2.0)
    assert kept.position_ned == (2.0, 0.0, 0.0)
    assert position(bench, bench.now + 3600.0, 3.0) == kept
    assert bench.stats.stamped_ahead == 1
    bench.now += 0.02
    assert position(bench, bench.now, 4.0).position_ned == (4.0, 0.0, 0.0)


def sys_status(voltage, remaining, health=0):
    return dialect.MAVLink_sys_status_message(
        0, 0, health, 0, voltage, -1, remaining, 0, 0, 0, 0, 0, 0
    )


def test_battery(bench):
    assert bench.take(sys_status(15800, 73)).battery[:3] == (10.0, 15.8, 0.73)
    bench.now = 12.0
    assert bench.take(sys_status(65535, -1)).battery == (12.0, None, None, 10.0)
    bench.now = 10.0
    assert bench.take(sys_status(9900, 0)).battery[:3] == (10.0, 9.9, 0.0)  # empty, not unknown
    cells = [4100, 4000, 3900, *[65535] * 7]
    message = dialect.MAVLink_battery_status_message(0, 0, 0, 0, cells, -1, -1, -1, 55)
    assert bench.take(message).battery[:3] == (10.0, 12.0, 0.55)
    more = [4000, 4000, 0, 0]  # 12 cells: SYS_STATUS would tell 48 V, and both must agree
    message = dialect.MAVLink_battery_status_message(
        0, 0, 0, 0, [4000] * 10, -1, -1, -1, 55, voltages_ext=more
    )
    assert bench.take(message).battery[:3] == (10.0, 48.0, 0.55)


def test_a_message_without_the_charge_does_not_hide_the_charge_of_the_other(bench):
    unknown = [65535] * 10
    for charge in (55, 54, 53):
        bench.take(dialect.MAVLink_battery_status_message(0, 0, 0, 0, unknown, -1, -1, -1, charge))
        told = bench.now
        for _ in range(4):
            bench.now += 0.25
            battery = bench.take(sys_status(15800, -1)).battery
            assert battery == (bench.now, 15.8, charge / 100.0, told)
    bench.now += 1.0
    assert bench.take(sys_status(15700, -1)).battery[:3] == (bench.now, 15.7, None)


def test_prearm_check_comes_with_sys_status(bench):
    assert bench.state.readiness.prearm_passed is None
    assert bench.take(sys_status(0, 0, 0x10000000)).readiness.prearm_passed is True
    assert bench.take(sys_status(0, 0, 0)).readiness.prearm_passed is False
    bench.now += 5.1
    assert bench.state.readiness.prearm_passed is None


def test_landed_gps_home_estimator(bench):
    assert bench.take(dialect.MAVLink_extended_sys_state_message(0, 1)).landed
    assert not bench.take(dialect.MAVLink_extended_sys_state_message(0, 2)).landed
    gps = dialect.MAVLink_gps_raw_int_message(0, 3, 473977418, 85455939, 488000, 1, 1, 1, 1, 10)
    assert bench.take(gps).gps == (10.0, 3, 10, 488.0)
    home = dialect.MAVLink_home_position_message(
        473977418, 85455939, 488000, 0, 0, -0.5, [1, 0, 0, 0], 0, 0, 0
    )
    state = bench.take(home)
    assert (state.home.latitude_deg, state.home.altitude_m) == (47.3977418, 488.0)


def test_what_was_not_told_for_long_is_not_known_any_more(bench):
    bench.take(dialect.MAVLink_extended_sys_state_message(0, 1))
    assert not bench.take(sys_status(15800, 73)).battery_silent
    bench.now += 5.1
    assert (bench.state.landed, bench.state.battery_silent) == (False, True)
    assert bench.take(dialect.MAVLink_extended_sys_state_message(0, 3)).taking_off
    assert not bench.take(sys_status(15800, 70)).battery_silent
    bench.now += 5.1
    assert bench.take(sys_status(15800, -1)).battery_silent  # its charge is not
    assert not bench.state.taking_off


def home_at(down):
    return dialect.MAVLink_home_position_message(
        473977418, 85455939, 488000, 0, 0, down, [1, 0, 0, 0], 0, 0, 0
    )


def gps_fix(fix_type, satellites=10):
    return dialect.MAVLink_gps_raw_int_message(0, fix_type, 0, 0, 0, 1, 1, 1, 1, satellites)


def test_height_is_counted_from_home(bench):
    assert bench.state.height is None
    bench.take(home_at(-0.5))
    assert bench.state.height is None
    position(bench, 2.5)
    assert bench.state.height == -0.5
    assert bench.state.home == (10.0, 47.3977418, 8.5455939, 488.0, -0.5)
    for bad in (math.nan, math.inf):
        bench.take(home_at(bad))
    assert (bench.state.height, bench.stats.non_finite) == (-0.5, 2)
    assert bench.stats.non_finite_at == {"HOME_POSITION": 10.0}


def test_gps_that_was_good_is_missed(bench):
    assert bench.take(gps_fix(2)).gps_fault is None
    assert not bench.state.gps_was_good
    assert bench.take(gps_fix(3)).gps_fault is None
    assert bench.take(gps_fix(2)).gps_fault == "GPS position lost"
    assert bench.take(gps_fix(4, satellites=255)).gps_fault is None
    assert bench.state.gps.satellites is None
    bench.now += 5.0
    assert bench.state.gps_fault is None
    bench.now += 0.1
    assert bench.state.gps_fault == "GPS is not reported any more"


def test_what_decides_about_arming_is_not_older_than_five_seconds(bench):
    assert bench.state.readiness == (None, None, False, False)
    bench.take(dialect.MAVLink_estimator_status_message(0, 0x33F, 0, 0, 0, 0, 0, 0, 0, 0))
    bench.take(sys_status(0, 0, 0x10000000))
    bench.take(home_at(0.0))
    position(bench, 2.5)
    assert bench.state.readiness == (True, 0x33F, True, True)
    bench.now += 5.1
    assert bench.state.readiness == (None, None, False, True)


def test_resets_of_the_estimate_are_counted_by_the_autopilot(bench):
    assert bench.state.reset_counter is None
    message = dialect.MAVLink_odometry_message(
        0, 1, 1, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0, 0, 0, 0, [0] * 21, [0] * 21, reset_counter=7
    )
    assert bench.take(message).reset_counter == 7


@pytest.mark.parametrize(
    ("told", "state"), [(0, (False, False)), (1, (True, False)), (2, (False, True))]
)
def test_a_vehicle_flies_only_if_the_autopilot_says_so(bench, told, state):
    assert (bench.state.landed, bench.state.flying) == (False, False)
    bench.take(dialect.MAVLink_extended_sys_state_message(0, told))
    assert (bench.state.landed, bench.state.flying) == state


def test_a_thrust_that_is_none_is_passed_over(bench):
    def target(thrust):
        q = [1.0, 0.0, 0.0, 0.0]
        return dialect.MAVLink_attitude_target_message(5000, 0, q, 0, 0, 0, thrust)

    for good in (0.0, 0.25, 1.0):
        assert bench.take(target(good)).attitude_target_thrust == (10.0, good)
    for bad in (-0.1, 1.1, math.nan, math.nan):
        assert bench.take(target(bad)).attitude_target_thrust == (10.0, 1.0)
    assert bench.stats.non_finite_at == {"ATTITUDE_TARGET": 10.0}
    assert bench.stats.non_finite == 2


def test_another_battery_is_not_ours(bench):
    cells = [4100] + [65535] * 9
    bench.take(dialect.MAVLink_battery_status_message(1, 0, 0, 0, cells, -1, -1, -1, 55))
    assert bench.state.battery is None
    unknown = [65535] * 10
    bench.take(dialect.MAVLink_battery_status_message(0, 0, 0, 0, unknown, -1, -1, -1, -1))
    assert bench.state.battery[:3] == (10.0, None, None)


def test_of_another_vehicle_only_the_heartbeat_is_kept(bench):
    bench.take(px4_heartbeat(0x00060000, 129))
    bench.take(development.MAVLink_current_mode_message(0, 0x03040000, 0x03040000))
    bench.take(sys_status(15800, 73, 0x10000000))
    bench.take(home_at(0.0))
    bench.take(gps_fix(3))
    position(bench, 2.5)
    bench.state.forget()
    state = bench.state
    assert (state.mode, state.armed) == ("OFFBOARD", True)
    assert (state.position, state.battery, state.home, state.gps) == (None, None, None, None)
    assert (state.position_count, state.arming_count, state.gps_was_good) == (0, 0, False)
    assert state.readiness == (None, None, False, False)


def global_position(latitude, longitude):
    return dialect.MAVLink_global_position_int_message(0, latitude, longitude, 0, 0, 0, 0, 0, 0)


def test_a_place_is_known_once_it_is_not_all_zeros(bench):
    assert bench.take(global_position(0, 0)).global_position is None
    state = bench.take(global_position(473977418, 85455939))
    assert state.global_position == (10.0, 47.3977418, 8.5455939)
    estimator = dialect.MAVLink_estimator_status_message(0, 0x33F, 0, 0, 0, 0, 0, 0, 0, 0)
    assert bench.take(estimator).estimator == (10.0, 0x33F)


def text(words, number=0, chunk=0, severity=4):
    return dialect.MAVLink_statustext_message(severity, words, number, chunk)


def test_texts_lose_their_tab_and_long_ones_are_joined(bench):
    bench.take(text(b"Armed by external command\t"))
    bench.take(text(b"a" * 50, 7, 0))
    bench.take(text(b"b" * 50, 7, 1))
    bench.take(text(b"c\t", 7, 2))
    words = [entry.text for entry in bench.state.texts]
    assert words == ["Armed by external command", "a" * 50 + "b" * 50 + "c"]


def test_a_text_without_its_end_is_given_when_the_next_begins(bench):
    bench.take(text(b"a" * 50, 7, 0))
    bench.take(text(b"next"))
    bench.take(text(b"d" * 50, 8, 0))
    bench.take(text(b"e" * 50, 9, 0))
    bench.take(text(b"", 9, 1))
    words = [entry.text for entry in bench.state.texts]
    assert words == ["a" * 50, "next", "d" * 50, "e" * 50]


def test_a_malformed_message_is_counted(bench):
    heard = []
    bench.dispatcher.subscribe("STATUSTEXT", heard.append)
    bench.dispatcher.dispatch(253, b"\x04" + b"\xff" * 50)
    assert len(heard) == 1  # undecodable letters are replaced, not refused
    assert decode(253, b"\x04" + b"\xff" * 50).severity == 4
