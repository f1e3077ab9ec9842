"""OFFBOARD by PX4's measured rules: entry, what counts as a setpoint, loss, failsafe, return."""

from math import acos, degrees, inf, isnan, nan

import pytest
from mock_rig import ACCEPTED, HOVER, TEMPORARILY_REJECTED, Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import decode

OFFBOARD = 0x00060000


def tilt(q):
    _, x, y, _ = q
    return acos(1.0 - 2.0 * (x * x + y * y))


def stream(rig, hz, seconds, **setpoint):
    """Send setpoints at a rate for a while, then stop."""
    end = rig.time + seconds
    while rig.time < end - 1e-6:
        rig.rates(**setpoint)
        rig.run(1.0 / hz)


def test_without_a_stream_offboard_is_entered_on_the_ground_but_does_not_arm():
    rig = Rig()
    assert rig.offboard() == ACCEPTED
    assert rig.arm() == TEMPORARILY_REJECTED
    rig.run(1.0)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (1, OFFBOARD, 0)
    assert any("no offboard signal" in text for text in rig.texts())


def test_without_a_stream_offboard_is_refused_in_the_air():
    rig = Rig()
    rig.take_off()
    assert rig.offboard() == TEMPORARILY_REJECTED
    assert rig.state.mode.name == "LOITER"


def test_stream_first_then_offboard_then_arm():
    rig = Rig()
    rig.each_tick = lambda: rig.rates(thrust=0.0)
    rig.run(1.0)
    assert rig.offboard() == ACCEPTED
    assert rig.arm() == ACCEPTED
    rig.run(1.1)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (129, OFFBOARD, 4)


def test_rates_are_followed_and_echoed_and_not_clipped():
    rig = Rig()
    rig.fly_offboard(height=20.0, roll=20.0)
    rig.run(0.2)
    assert rig.messages("ATTITUDE_TARGET")[-1].body_roll_rate == pytest.approx(20.0)
    assert rig.truth.body_rates[0] > 8.0


def test_thrust_stays_as_it_was_asked_when_tilted():
    rig = Rig()
    rig.fly_offboard(roll=0.5)
    rig.run(0.6)
    assert degrees(tilt(rig.truth.q)) > 10.0
    assert rig.state.command.thrust == pytest.approx(HOVER)


def test_silence_holds_the_last_rates_until_the_loss_is_seen():
    rig = Rig()
    rig.fly_offboard(height=30.0, roll=0.4)
    rig.run(0.1)
    rig.each_tick = None
    stopped = rig.time
    rig.run_until(lambda: rig.state.failsafe, 2.0)
    assert 1.05 <= rig.time - stopped <= 1.12
    assert degrees(tilt(rig.truth.q)) == pytest.approx(26.0, abs=3.0)
    rig.run(1.0)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (157, 0x05040000, 5)


@pytest.mark.parametrize(("action", "mode"), [(0, "RTL"), (1, "RTL"), (4, "LAND"), (5, "LOITER")])
def test_the_action_after_loss_is_a_parameter(action, mode):
    rig = Rig(parameters={"COM_OBL_RC_ACT": action})
    rig.fly_offboard()
    rig.each_tick = None
    rig.run(1.2)
    assert rig.state.mode.name == mode
    assert rig.state.intended_mode.name == "OFFBOARD"
    assert rig.state.failsafe


def test_loss_timeout_is_a_parameter():
    rig = Rig(parameters={"COM_OF_LOSS_T": 0.3})
    rig.fly_offboard()
    rig.each_tick = None
    stopped = rig.time
    rig.run_until(lambda: rig.state.failsafe, 2.0)
    assert 0.35 <= rig.time - stopped <= 0.42


def test_streaming_again_enters_offboard_by_itself_within_54_ms():
    rig = Rig()
    rig.fly_offboard()
    rig.each_tick = None
    rig.run(1.5)
    assert rig.state.mode.name == "RTL"
    rig.each_tick = rig.rates
    resumed = rig.time
    rig.run_until(lambda: rig.state.mode.name == "OFFBOARD", 0.1)
    assert rig.time - resumed <= 0.054
    assert not rig.state.failsafe


def test_an_explicit_mode_ends_that():
    rig = Rig()
    rig.fly_offboard()
    rig.each_tick = None
    rig.run(1.5)
    assert rig.mode(4, 3) == ACCEPTED
    rig.each_tick = rig.rates
    rig.run(2.1)
    assert rig.state.mode.name == "LOITER"
    mode = rig.messages("CURRENT_MODE")[-1]
    assert mode.intended_custom_mode == 0x03040000


def test_current_mode_keeps_the_intended_mode_in_the_failsafe():
    rig = Rig()
    rig.fly_offboard()
    rig.each_tick = None
    rig.run(4.0)
    mode = rig.messages("CURRENT_MODE")[-1]
    assert (mode.custom_mode, mode.intended_custom_mode) == (0x05040000, OFFBOARD)


@pytest.mark.parametrize(("hz", "lost"), [(2.0, False), (1.2, False), (0.9, True)])
def test_proof_of_life(hz, lost):
    rig = Rig()
    rig.fly_offboard(height=10.0)
    rig.each_tick = None
    failed = False

    def watch():
        nonlocal failed
        failed = failed or rig.state.failsafe

    end = rig.time + 5.0
    rig.each_tick = watch
    while rig.time < end:
        rig.rates()
        rig.run(1.0 / hz)
    assert failed == lost


def test_the_failsafe_lands_a_vehicle_whose_program_died():
    rig = Rig()
    rig.fly_offboard(pitch=-0.1)
    rig.run(1.0)
    rig.each_tick = None
    rig.run_until(lambda: not rig.state.armed, 60.0)
    assert rig.truth.on_ground
    assert not rig.truth.crashed
    # As the real one: it is left where its user had put it, and cannot be armed there.
    assert rig.state.mode.name == "OFFBOARD"
    rig.run(0.1)
    assert rig.state.prearm_problem == "no offboard signal"


ACCEPTED_SETPOINTS = {
    "zero quaternion": {"q": (0.0, 0.0, 0.0, 0.0)},
    "NaN quaternion": {"q": (nan, nan, nan, nan)},
    "target 0/0": {"target": (0, 0)},
    "target 1/0": {"target": (1, 0)},
    "yaw rate ignored": {"mask": 128 | 4},
    "NaN rate": {"roll": nan},
    "infinite rate": {"pitch": inf},
    "NaN thrust": {"thrust": nan},
    "negative thrust": {"thrust": -1.0},
    "thrust above one": {"thrust": 1.5},
    "attitude only": {"mask": 7},
    "attitude and rates": {"mask": 0},
}
IGNORED_SETPOINTS = {
    "target system 2": {"target": (2, 1)},
    "target component 191": {"target": (1, 191)},
    "throttle ignored": {"mask": 128 | 64},
    "roll rate ignored": {"mask": 128 | 1},
    "pitch rate ignored": {"mask": 128 | 2},
    "nothing asked": {"mask": 128 | 7},
}


@pytest.mark.parametrize("setpoint", ACCEPTED_SETPOINTS.values(), ids=ACCEPTED_SETPOINTS)
def test_setpoints_that_count(setpoint):
    rig = Rig()
    rig.rates(**setpoint)
    assert rig.simulation.stream.setpoint_count == 1


@pytest.mark.parametrize("setpoint", IGNORED_SETPOINTS.values(), ids=IGNORED_SETPOINTS)
def test_setpoints_that_do_not_count_lose_offboard(setpoint):
    rig = Rig()
    rig.fly_offboard()
    counted = rig.simulation.stream.setpoint_count
    rig.each_tick = lambda: rig.rates(**setpoint)
    rig.run(1.2)
    assert rig.simulation.stream.setpoint_count == counted
    assert rig.state.failsafe


def test_any_source_and_a_version_1_frame_are_accepted():
    rig = Rig()
    mav = dialect.MAVLink(None, srcSystem=77, srcComponent=3)
    message = dialect.MAVLink_set_attitude_target_message(
        0, 1, 1, 128, [1, 0, 0, 0], 0.0, 0.0, 0.0, 0.0
    )
    for each in decode(bytes(message.pack(mav, force_mavlink1=True))):
        rig.simulation.handle(each, rig.simulation.companion)
    assert rig.simulation.stream.setpoint_count == 1


@pytest.mark.parametrize("held", [nan, inf, -inf])
def test_a_rate_that_is_no_number_holds_the_present_one(held):
    rig = Rig()
    rig.fly_offboard(height=30.0, roll=1.0)
    rig.run(0.4)
    rig.each_tick = lambda: rig.rates(roll=held)
    rig.run(0.4)
    assert rig.truth.body_rates[0] == pytest.approx(1.0, abs=0.25)


def test_yaw_rate_ignored_holds_the_present_yaw_rate():
    rig = Rig()
    rig.fly_offboard(height=10.0, yaw=0.5)
    rig.run(2.0)
    before = rig.truth.body_rates[2]
    rig.each_tick = lambda: rig.rates(mask=128 | 4, yaw=0.0)
    rig.run(0.5)
    assert before > 0.35
    assert rig.truth.body_rates[2] == pytest.approx(before, abs=0.15)


@pytest.mark.parametrize("setpoint", [{"thrust": nan}, {"thrust": -1.0}, {"mask": 128 | 32}])
def test_no_thrust_is_free_fall(setpoint):
    rig = Rig()
    rig.fly_offboard(height=30.0, **setpoint)
    rig.run(0.8)
    assert sum(rig.truth.rotor_thrusts) < 0.01
    assert rig.truth.velocity_ned[2] > 4.0


def test_thrust_above_one_is_full_thrust():
    rig = Rig()
    rig.fly_offboard(thrust=1.5)
    rig.run(0.4)
    assert sum(rig.truth.rotor_thrusts) == pytest.approx(19.77, rel=0.05)


def test_attitude_setpoints_are_held():
    rig = Rig()
    q = (0.9961947, 0.0871557, 0.0, 0.0)  # 10 degrees of roll
    rig.fly_offboard(height=10.0, mask=7, q=q)
    rig.run(1.5)
    assert degrees(tilt(rig.truth.q)) == pytest.approx(10.0, abs=0.5)
    assert rig.truth.q[1] > 0.0
    rig.run(1.0)
    assert rig.messages("HEARTBEAT")[-1].base_mode == 145


def test_attitude_and_rates_together_fight():
    rig = Rig()
    rig.take_off(20.0)
    sent = 0

    def every_fifth():
        nonlocal sent
        sent += 1
        if sent % 5 == 0:
            rig.rates(roll=2.0, mask=0)

    rig.each_tick = every_fifth
    rig.run(0.1)
    rig.offboard()
    asked = set()
    for _ in range(50):
        rig.run(0.004)
        asked.add(round(rig.state.command.roll_rate, 3))
    assert 2.0 in asked
    assert min(asked) < 0.5


def test_nan_quaternion_under_attitude_control_kills_it_until_restart():
    rig = Rig()
    rig.fly_offboard(height=10.0, roll=1.0)
    rig.run(0.2)
    rig.each_tick = lambda: rig.rates(mask=7, q=(nan,) * 4)
    rig.run(0.2)
    assert rig.mode(4, 3) == ACCEPTED
    rig.each_tick = None
    rig.run(0.1)
    assert isnan(rig.state.command.roll_rate)
    rig.run_until(lambda: rig.truth.crashed or not rig.state.armed, 60.0)


def test_short_nan_quaternion_is_survived():
    rig = Rig()
    rig.fly_offboard(height=10.0, mask=7, q=(nan,) * 4)
    rig.run(0.1)
    rig.each_tick = None
    rig.mode(4, 3)
    rig.run(3.0)
    assert degrees(tilt(rig.truth.q)) < 2.0


def test_without_forwarding_no_setpoint_counts():
    rig = Rig(parameters={"MAV_FWDEXTSP": 0})
    rig.rates()
    assert rig.simulation.stream.setpoint_count == 0


def test_land_command_from_offboard():
    rig = Rig()
    rig.fly_offboard()
    assert rig.command(dialect.MAV_CMD_NAV_LAND) == ACCEPTED
    rig.run(0.1)
    assert rig.state.mode.name == "LAND"


@pytest.mark.parametrize(("by_loiter", "ends_in"), [(False, "OFFBOARD"), (True, "LOITER")])
def test_a_landing_ends_in_the_mode_that_it_was_asked_in(by_loiter, ends_in):
    """Measured: NAV_LAND straight from OFFBOARD is OFFBOARD again once disarmed, and not ready."""
    rig = Rig(parameters={"MPC_LAND_SPEED": 3.0, "MPC_LAND_CRWL": 1.5})
    rig.fly_offboard(height=3.0)
    rig.each_tick = None
    if by_loiter:
        assert rig.mode(4, 3) == ACCEPTED
    assert rig.command(dialect.MAV_CMD_NAV_LAND) == ACCEPTED
    rig.run_until(lambda: not rig.state.armed, 20.0)
    rig.run(1.5)
    beat = rig.messages("HEARTBEAT")[-1]
    assert rig.state.mode.name == ends_in
    assert (beat.base_mode, beat.system_status) == ((29, 3) if by_loiter else (1, 0))
    assert (rig.state.prearm_problem is None) is by_loiter


def test_thrust_off_after_touchdown_is_a_landing_then_a_disarm():
    rig = Rig()
    rig.fly_offboard(height=3.0)
    rig.each_tick = lambda: rig.rates(thrust=0.44)
    rig.run_until(lambda: rig.truth.on_ground, 20.0)
    rig.each_tick = lambda: rig.rates(thrust=0.0)
    touched = rig.time
    rig.run_until(lambda: rig.state.landed, 3.0)
    assert rig.time - touched == pytest.approx(1.1, abs=0.02)
    rig.run_until(lambda: not rig.state.armed, 3.0)
    assert rig.time - touched == pytest.approx(3.1, abs=0.1)
    assert rig.state.mode.name == "OFFBOARD"


@pytest.mark.parametrize(
    ("mask", "fields", "expected"),
    [
        (0x9F8, (5.0, -3.0, -8.0, 0, 0, 0), (5.0, -3.0, -8.0)),
        (0x9C7, (0, 0, 0, 1.0, 0.0, -0.5), None),
    ],
)
def test_position_and_velocity_setpoints(mask, fields, expected):
    rig = Rig()
    rig.take_off(6.0)
    message = dialect.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, mask, *fields, 0, 0, 0, 0.0, 0.0
    )
    rig.each_tick = lambda: rig.say(message)
    rig.run(0.1)
    assert rig.offboard() == ACCEPTED
    rig.run(12.0)
    if expected:
        assert rig.truth.position_ned == pytest.approx(expected, abs=0.3)
    else:
        assert rig.truth.velocity_ned == pytest.approx((1.0, 0.0, -0.5), abs=0.12)
    assert rig.messages("HEARTBEAT")[-1].base_mode == 145
