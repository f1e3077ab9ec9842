"""ArduCopter in the air: GUIDED's rules, what setpoints do, and how a flight ends."""

from math import cos, degrees, hypot, inf, nan, radians, sin

import numpy as np
import pytest
from ardupilot_rig import BRAKE, FAILED, GUIDED, HOVER, LAND, RTL, THRUST_AS_THRUST, ArduRig
from mock_rig import ACCEPTED
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.attitude_control import body_z
from sitl_mock.link.framing import Framer
from sitl_mock.physics.quaternion import yaw

LEVEL = (1.0, 0.0, 0.0, 0.0)
DRAG = 0.37
NO_BOOST = {**THRUST_AS_THRUST, "ATC_ANGLE_BOOST": 0}


def tilt_deg(rig):
    return degrees(np.arccos(min(1.0, body_z(rig.truth.q)[2])))


def climb(rig):
    return -rig.truth.velocity_ned[2]


def tilted(angle_deg):
    half = radians(angle_deg) / 2.0
    return (cos(half), sin(half), 0.0, 0.0)


def test_a_flight_from_the_ground_to_the_ground_with_its_times_and_flags():
    rig = ArduRig(true_speed=True, parameters=THRUST_AS_THRUST)
    assert rig.switch(GUIDED) == ACCEPTED
    assert rig.start(10.0) == FAILED  # disarmed
    assert rig.arm() == ACCEPTED
    rig.each_tick = lambda: rig.rates(thrust=0.6)
    rig.run(1.0)
    assert rig.truth.on_ground  # setpoints do not take off
    rig.each_tick = None
    assert rig.start(10.0) == ACCEPTED
    began = rig.time
    rig.run(1.9)
    assert rig.truth.on_ground
    rig.run_until(lambda: rig.height > 9.8, 12.0)
    assert rig.time - began == pytest.approx(9.0, abs=0.7)
    rig.run(1.5)
    assert rig.height == pytest.approx(10.0, abs=0.15)
    assert rig.base_mode() == 217
    assert rig.messages("HEARTBEAT")[-1].system_status == 4
    assert rig.start(12.0) == FAILED  # flying
    assert rig.command(400, 0) == FAILED
    assert rig.state.armed
    assert 0.364 < rig.simulation.parameters["MOT_THST_HOVER"] < 0.39  # it learns

    rig.each_tick = lambda: rig.rates(roll=0.1, thrust=HOVER)
    rig.run(1.0)
    assert rig.base_mode() == 209
    assert rig.messages("HEARTBEAT")[-1].custom_mode == GUIDED
    assert rig.switch(BRAKE) == ACCEPTED
    counted = rig.simulation.stream.setpoint_count
    rig.run(3.0)
    assert rig.simulation.stream.setpoint_count == counted  # in BRAKE nobody listens to setpoints
    assert hypot(*rig.truth.velocity_ned) < 0.35
    assert rig.base_mode() == 217
    rig.each_tick = None

    height = rig.height
    assert rig.switch(LAND) == ACCEPTED
    began = rig.time
    rig.run_until(lambda: rig.truth.on_ground, 25.0)
    landed = rig.time
    assert landed - began == pytest.approx(height / 0.5, abs=1.0)
    rig.run_until(lambda: rig.state.landed, 3.0)
    assert rig.time - landed == pytest.approx(1.6, abs=0.2)  # recorded
    rig.run_until(lambda: not rig.state.armed, 1.0)
    assert rig.time - landed == pytest.approx(2.1, abs=0.2)  # recorded
    assert rig.truth.touchdown_speed < 0.7
    aligned = [f"EKF3 IMU{unit} MAG0 in-flight yaw alignment complete" for unit in (0, 1)]
    assert rig.texts()[-4:] == ["Arming motors", *aligned, "Disarming motors"]
    rig.run(1.1)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (89, LAND, 3)


def test_silence_keeps_the_rates_for_3_s_then_level_without_climbing_or_a_word():
    rig = ArduRig(parameters=NO_BOOST)
    rig.fly(3.0, roll=0.02, yaw=0.3)
    rig.each_tick = None
    said = rig.texts()
    rig.run(2.8)
    assert rig.truth.body_rates[2] == pytest.approx(0.3, abs=0.03)
    assert tilt_deg(rig) > 2.5
    rig.run(2.5)
    assert abs(rig.truth.body_rates[2]) < 0.05
    assert tilt_deg(rig) < 0.5
    assert abs(climb(rig)) < 0.1
    assert hypot(*rig.truth.velocity_ned[:2]) > 0.2  # no position is held
    assert rig.state.mode.name == "GUIDED"
    assert rig.base_mode() == 209
    assert rig.texts() == said
    rig.rates(roll=0.5, thrust=HOVER)
    rig.run(0.3)
    assert rig.truth.body_rates[0] == pytest.approx(0.5, abs=0.05)  # it listens again at once


@pytest.fixture(scope="module")
def aloft():
    """One vehicle for the setpoints that it survives; each test leaves it flying."""
    rig = ArduRig(parameters={**THRUST_AS_THRUST, "WPNAV_SPEED_UP": 250.0})
    rig.lift(8.0)
    return rig


def test_without_the_option_thrust_is_a_climb_rate(aloft):
    aloft.simulation.parameters.set("GUID_OPTIONS", 0)
    for thrust, speed in ((0.0, -1.5), (nan, 0.0), (1.0, 2.5), (0.5, 0.0)):
        aloft.each_tick = lambda thrust=thrust: aloft.rates(thrust=thrust)
        aloft.run(1.6)
        assert climb(aloft) == pytest.approx(speed, abs=0.2), thrust
    aloft.each_tick = None
    aloft.simulation.parameters.set("GUID_OPTIONS", 8)


def test_the_angle_boost_divides_by_the_cosine_of_the_tilt(aloft):
    """At 25 degrees, dividing oneself, too: measured -1.05 m/s^2; -0.02 if not."""
    for boost, twice, down in ((1, False, 0.0), (1, True, -1.0), (0, False, 0.9), (0, True, 0.0)):
        aloft.simulation.parameters.set("ATC_ANGLE_BOOST", boost)
        thrust = HOVER / cos(radians(25.0)) if twice else HOVER
        aloft.rates(mask=7, q=tilted(25.0), thrust=thrust)
        aloft.run(1.0)
        assert tilt_deg(aloft) == pytest.approx(25.0, abs=1.0)
        felt = aloft.truth.acceleration_ned[2] + DRAG * aloft.truth.velocity_ned[2]
        assert felt == pytest.approx(down, abs=0.25), (boost, twice)
        assert aloft.switch(BRAKE) == aloft.switch(GUIDED) == ACCEPTED
        aloft.run(0.8)
    aloft.simulation.parameters.set("ATC_ANGLE_BOOST", 1)


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0), (1, 42)])
def test_targets_that_are_obeyed(aloft, target):
    aloft.rates(thrust=HOVER, target=target)
    aloft.run(0.01)
    assert aloft.simulation.commander.obeys_setpoints
    assert aloft.switch(BRAKE) == aloft.switch(GUIDED) == ACCEPTED


@pytest.mark.parametrize(
    ("target", "source"), [((2, 1), (255, 190)), ((1, 1), (1, 1))], ids=["system 2", "from 1/1"]
)
def test_what_is_ignored_in_silence(aloft, target, source):
    mine, aloft.framer = aloft.framer, Framer(*source)
    aloft.rates(thrust=HOVER, target=target)
    aloft.framer = mine
    aloft.run(0.01)
    assert not aloft.simulation.commander.obeys_setpoints


@pytest.mark.parametrize(
    ("mask", "q"),
    [(128 + 64, LEVEL), (128 + 1, LEVEL), (128 + 3, LEVEL), (128 + 4, LEVEL), (0, (0.9, 0, 0, 0)),
     (7, (0.0, 0.0, 0.0, 0.0))],
)  # fmt: skip
def test_what_cannot_be_flown_falls_back_to_holding_the_position(aloft, mask, q):
    aloft.rates(thrust=HOVER)
    aloft.run(0.05)
    assert aloft.simulation.commander.obeys_setpoints
    aloft.rates(thrust=HOVER, mask=mask, q=q)
    aloft.run(0.05)
    assert not aloft.simulation.commander.obeys_setpoints
    assert aloft.state.position_controlled


def test_a_version_1_frame_and_an_attitude_are_obeyed_too(aloft):
    message = dialect.MAVLink_set_attitude_target_message(
        0, 1, 1, 7, tilted(10.0), 0.0, 0.0, 0.0, HOVER
    )
    frame = bytes(message.pack(dialect.MAVLink(None, 255, 190), force_mavlink1=True))
    aloft.say_frame(frame)
    aloft.run(0.8)
    aloft.say_frame(frame)  # the tests before may have left it fast and tilted
    aloft.run(0.8)
    assert tilt_deg(aloft) == pytest.approx(10.0, abs=0.7)
    aloft.rates(mask=7, q=LEVEL, thrust=HOVER)
    aloft.run(0.8)
    assert tilt_deg(aloft) < 1.0


def test_a_rate_that_is_no_number_holds_the_present_one_and_is_told_once(aloft):
    aloft.rates(yaw=0.4, thrust=HOVER)
    aloft.run(0.6)
    for _ in range(2):
        aloft.rates(yaw=nan, thrust=HOVER)
        aloft.run(0.3)
    assert aloft.truth.body_rates[2] == pytest.approx(0.4, abs=0.05)
    assert aloft.texts().count("Internal Errors 0x400") == 1
    assert aloft.switch(BRAKE) == aloft.switch(GUIDED) == ACCEPTED


def test_position_and_velocity_setpoints(aloft):
    def ask(mask, place, velocity):
        aloft.say(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, mask, *place, *velocity, 0, 0, 0, 0, 0
            )
        )

    aloft.run(1.5)
    x, y, z = aloft.truth.position_ned
    ask(0b110111111000, (x + 2.0, y, z), (0, 0, 0))
    aloft.run(4.0)
    assert aloft.truth.position_ned == pytest.approx((x + 2.0, y, z), abs=0.5)
    aloft.each_tick = lambda: ask(0b110111000111, (0, 0, 0), (0.0, 1.0, 0.0))
    aloft.run(2.0)
    aloft.each_tick = None
    assert aloft.truth.velocity_ned[1] == pytest.approx(1.0, abs=0.2)
    assert aloft.base_mode() == 217
    aloft.run(5.0)
    assert hypot(*aloft.truth.velocity_ned) < 0.4  # silence: it stops


def test_a_setpoint_ends_a_take_off_at_once():
    rig = ArduRig(parameters=THRUST_AS_THRUST)
    rig.switch(GUIDED)
    rig.arm()
    rig.start(10.0)
    rig.run_until(lambda: rig.height > 1.0, 6.0)
    rig.rates(thrust=HOVER)
    rig.run(0.02)
    assert rig.simulation.commander.obeys_setpoints
    assert rig.base_mode() == 209


def test_no_number_as_thrust_falls_infinity_is_all_and_an_infinite_rate_runs_away():
    rig = ArduRig(parameters=THRUST_AS_THRUST)
    rig.fly(5.0, thrust=nan)
    rig.run(0.4)
    assert climb(rig) < -3.0
    rig.each_tick = lambda: rig.rates(thrust=inf)
    rig.run(0.6)
    assert climb(rig) > 2.0
    rig.each_tick = lambda: rig.rates(roll=inf, thrust=HOVER)
    rig.run(0.45)
    assert rig.truth.body_rates[0] > 6.0


def test_a_quaternion_of_nan_in_use_ends_the_process():
    rig = ArduRig(parameters=THRUST_AS_THRUST)
    rig.fly(2.0)
    rig.each_tick = None
    rig.rates(q=(nan,) * 4, thrust=HOVER)  # not in use: ignored
    rig.run(0.1)
    assert not rig.state.aborted
    rig.rates(mask=7, q=(nan,) * 4, thrust=HOVER)
    rig.run(0.02)
    assert rig.state.aborted
    heard, where = len(rig.received), rig.truth.position_ned
    rig.heartbeat()
    rig.say(dialect.MAVLink_command_long_message(1, 1, 176, 0, 1, RTL, 0, 0, 0, 0, 0))
    rig.run(1.0)
    assert len(rig.received) == heard
    assert rig.truth.position_ned == where


def test_the_heading_is_aligned_anew_in_each_flight():
    """ardupilot-circle-5ms.tlog and the others: at 2.67 to 2.88 m, told for both units."""
    rig = ArduRig()
    aligned = [f"EKF3 IMU{unit} MAG0 in-flight yaw alignment complete" for unit in (0, 1)]
    for flight in (1, 2):
        assert rig.switch(GUIDED) == ACCEPTED
        assert rig.arm() == ACCEPTED
        assert rig.start(4.0) == ACCEPTED
        rig.run_until(lambda: rig.height > 2.5, 10.0)
        assert [text for text in rig.texts() if text in aligned] == aligned * (flight - 1)
        rig.run_until(lambda: rig.height > 3.2, 10.0)
        assert [text for text in rig.texts() if text in aligned] == aligned * flight
        assert rig.switch(LAND) == ACCEPTED
        rig.run_until(lambda: not rig.state.armed, 30.0)


def test_a_vehicle_that_leans_against_the_wind_lands_where_it_was():
    """Two landings of the real one from a hover in wind of 3 m/s drifted by 0.01 and 0.03 m."""
    rig = ArduRig(wind={"speed_m_s": 6.0, "from_deg": 180.0})
    rig.lift(4.0)
    rig.run(12.0)
    north, east, _ = rig.truth.position_ned
    assert rig.switch(LAND) == ACCEPTED
    farthest = 0.0
    while rig.height > 1.0:
        rig.run(0.1)
        at = rig.truth.position_ned
        farthest = max(farthest, hypot(at[0] - north, at[1] - east))
    assert farthest < 0.15


ATTITUDE_TARGET, SET_MESSAGE_INTERVAL = 83, 511


def test_attitude_target_tells_the_axes_along_which_the_rates_are_taken():
    """At the rate asked for; turned before the body, and along with the estimate when it jumps."""
    rig = ArduRig(parameters=NO_BOOST)
    rig.fly(3.0, yaw=0.5)
    assert rig.command(SET_MESSAGE_INTERVAL, ATTITUDE_TARGET, 5000) == ACCEPTED
    began = rig.time
    rig.run(1.0)
    told = rig.messages("ATTITUDE_TARGET", since=began)
    assert len(told) == pytest.approx(200, abs=5)
    assert told[-1].body_yaw_rate == pytest.approx(0.5)
    lead = yaw(tuple(told[-1].q)) - yaw(rig.truth.q)
    assert 0.5 * 0.08 < lead < 0.5 * 0.2
    rig.simulation.vehicle.estimator.shift(yaw=0.5)
    rig.run(0.02)
    assert yaw(tuple(rig.messages("ATTITUDE_TARGET")[-1].q)) - yaw(rig.truth.q) == pytest.approx(
        lead + 0.5, abs=0.02
    )
