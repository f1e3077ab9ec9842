"""Parameters, requests, time synchronisation and the small protocols clients expect."""

import struct
import zlib
from math import isnan, nan

import pytest
from mock_rig import ACCEPTED, DENIED, UNSUPPORTED, Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import decode

INT32, REAL32 = 6, 9


def as_int(value):
    return struct.unpack("<i", struct.pack("<f", value))[0]


def read(rig, name, index=-1):
    rig.say(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    return rig.messages("PARAM_VALUE")[-1]


def write(rig, name, value, kind):
    rig.say(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))


def test_the_whole_list_comes_with_every_index_once_and_the_hash():
    rig = Rig()
    rig.say(dialect.MAVLink_param_request_list_message(1, 1))
    rig.run(1.0)
    values = rig.messages("PARAM_VALUE")
    assert values[0].param_id == "_HASH_CHECK"
    listed = values[1:]
    assert [m.param_index for m in listed] == list(range(listed[0].param_count))
    assert len(listed) >= 60
    assert [m.param_id for m in listed] == sorted(m.param_id for m in listed)
    crc = 0xFFFFFFFF
    for m in listed:
        raw = struct.pack("<f", m.param_value)
        crc = zlib.crc32(m.param_id.encode() + raw, crc)
    got = struct.unpack("<I", struct.pack("<f", values[0].param_value))[0]
    assert got == crc ^ 0xFFFFFFFF


def test_an_integer_travels_in_the_bytes_of_the_float():
    rig = Rig()
    value = read(rig, "SYS_AUTOSTART")
    assert (as_int(value.param_value), value.param_type) == (10040, INT32)
    by_index = read(rig, "", value.param_index)
    assert by_index.param_id == "SYS_AUTOSTART"


def test_set_answers_with_the_value_in_force_and_acts():
    rig = Rig()
    write(rig, "MIS_TAKEOFF_ALT", 3.5, REAL32)
    assert rig.messages("PARAM_VALUE")[-1].param_value == 3.5
    write(rig, "COM_OBL_RC_ACT", struct.unpack("<f", struct.pack("<i", 4))[0], INT32)
    assert as_int(rig.messages("PARAM_VALUE")[-1].param_value) == 4
    rig.mode(4, 2)
    rig.arm()
    rig.run_until(lambda: rig.state.mode.name == "LOITER", 15.0)
    assert -rig.truth.position_ned[2] == pytest.approx(3.5, abs=0.4)


@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("NO_SUCH_PARAM", 1.0, REAL32, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST),
        ("MIS_TAKEOFF_ALT", 1.0, INT32, dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("MIS_TAKEOFF_ALT", nan, REAL32, dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("COM_OBL_RC_ACT", 1.0, 1, dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
    ],
)
def test_what_cannot_be_set_is_refused_and_changes_nothing(name, value, kind, error):
    rig = Rig()
    before = dict(rig.simulation.parameters._values)
    write(rig, name, value, kind)
    assert rig.messages("PARAM_ERROR")[-1].error == error
    assert rig.simulation.parameters._values == before


def test_reading_what_does_not_exist():
    rig = Rig()
    rig.say(dialect.MAVLink_param_request_read_message(1, 1, b"NOPE", -1))
    rig.say(dialect.MAVLink_param_request_read_message(1, 1, b"", 30000))
    assert len(rig.messages("PARAM_ERROR")) == 2
    assert rig.messages("PARAM_VALUE") == []


def test_request_message():
    rig = Rig()
    assert rig.command(512, 148) == ACCEPTED
    version = rig.messages("AUTOPILOT_VERSION")[-1]
    assert version.capabilities == 0xE8FF
    assert version.uid.to_bytes(8) == b"ITALDINO"
    assert not any(version.uid2)
    assert rig.command(512, dialect.MAVLINK_MSG_ID_HOME_POSITION) == ACCEPTED
    assert rig.messages("HOME_POSITION")[-1].latitude == 473977433
    assert rig.command(512, 300) == ACCEPTED
    assert rig.command(512, 9999) == DENIED
    assert rig.command(512, nan) == DENIED
    assert rig.command(520, 1) == ACCEPTED


def test_command_int_and_set_mode_are_acknowledged_too():
    rig = Rig()
    rig.say(dialect.MAVLink_command_int_message(1, 1, 0, 176, 0, 0, 1, 4, 3, 0, 0, 0, 0))
    rig.say(dialect.MAVLink_set_mode_message(1, 1, 0x03040000))
    rig.say(dialect.MAVLink_set_mode_message(1, 1, 0x00990000))
    acks = [(m.command, m.result) for m in rig.messages("COMMAND_ACK")]
    assert acks == [(176, ACCEPTED), (176, ACCEPTED), (176, DENIED)]


@pytest.mark.parametrize("target", [(2, 1), (1, 191)])
def test_commands_for_others_are_ignored_in_silence(target):
    rig = Rig()
    rig.say(dialect.MAVLink_command_long_message(*target, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert rig.messages("COMMAND_ACK") == []
    assert not rig.state.armed


@pytest.mark.parametrize("command", [400, 176, 22, 192, 179, 511, 510, 512])
def test_commands_full_of_nan_do_no_harm(command):
    rig = Rig()
    result = rig.command(command, *[nan] * 7)
    assert result in (ACCEPTED, DENIED, UNSUPPORTED, 1)
    assert not rig.state.armed
    rig.run(0.5)


def test_timesync_answers_with_its_nanoseconds_and_asks_too():
    rig = Rig()
    rig.say(dialect.MAVLink_timesync_message(0, 123456789))
    answer = rig.messages("TIMESYNC")[-1]
    assert (answer.tc1, answer.ts1) == (rig.simulation.time_us * 1000, 123456789)
    rig.say(dialect.MAVLink_timesync_message(5, 6))
    assert rig.messages("TIMESYNC")[-1] is answer
    rig.run(1.0)
    asked = [m for m in rig.messages("TIMESYNC") if m.tc1 == 0]
    assert len(asked) >= 9


def test_ping_and_mission_list():
    rig = Rig()
    rig.say(dialect.MAVLink_ping_message(7, 8, 0, 0))
    assert (rig.messages("PING")[-1].seq, rig.messages("PING")[-1].target_system) == (8, 255)
    rig.say(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    assert rig.messages("MISSION_COUNT")[-1].count == 0


def test_only_mavlink_2_leaves_even_for_a_version_1_client():
    rig = Rig()
    link = rig.simulation.companion
    request = dialect.MAVLink_param_request_read_message(1, 1, b"MAV_TYPE", -1)
    version_1 = bytes(request.pack(dialect.MAVLink(None, 255, 190), force_mavlink1=True))
    for message in decode(version_1):
        rig.simulation.handle(message, link)
    for _ in range(25):
        rig.simulation.tick()
    frames = link.take_frames()
    assert len(frames) > 10
    assert {frame[0] for frame in frames} == {0xFD}


def test_telemetry_agrees_with_the_truth():
    rig = Rig(home={"heading_deg": 90.0})
    rig.take_off(4.0)
    rig.run(3.0)
    truth = rig.truth
    last = {name: rig.messages(name)[-1] for name in (
        "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ATTITUDE", "ATTITUDE_QUATERNION", "ODOMETRY",
        "HIGHRES_IMU", "VFR_HUD", "ALTITUDE", "SERVO_OUTPUT_RAW", "ATTITUDE_TARGET",
        "POSITION_TARGET_LOCAL_NED", "ESTIMATOR_STATUS", "VIBRATION", "SYS_STATUS",
    )}  # fmt: skip
    height = -truth.position_ned[2]
    assert -last["LOCAL_POSITION_NED"].z == pytest.approx(height, abs=0.1)
    assert last["GLOBAL_POSITION_INT"].relative_alt / 1e3 == pytest.approx(height, abs=0.1)
    assert last["GLOBAL_POSITION_INT"].alt / 1e3 == pytest.approx(489.4 + height, abs=0.1)
    assert last["GLOBAL_POSITION_INT"].hdg == pytest.approx(9000, abs=100)
    assert last["ATTITUDE"].yaw == pytest.approx(1.5708, abs=0.02)
    assert last["ATTITUDE_QUATERNION"].q1 == pytest.approx(0.7071, abs=0.01)
    assert last["ODOMETRY"].q == pytest.approx(truth.q, abs=0.01)
    assert last["HIGHRES_IMU"].zacc == pytest.approx(-9.8, abs=0.5)
    assert last["HIGHRES_IMU"].abs_pressure == pytest.approx(955.3, abs=0.5)
    assert last["VFR_HUD"].throttle == pytest.approx(49, abs=2)
    assert isnan(last["VFR_HUD"].airspeed)
    assert last["ALTITUDE"].altitude_relative == pytest.approx(height, abs=0.1)
    assert last["SERVO_OUTPUT_RAW"].servo1_raw == pytest.approx(1490, abs=60)
    assert last["ATTITUDE_TARGET"].thrust == pytest.approx(0.49, abs=0.03)
    assert last["POSITION_TARGET_LOCAL_NED"].z == pytest.approx(-4.0, abs=0.5)
    assert last["SYS_STATUS"].onboard_control_sensors_health & 0x10000000


@pytest.mark.parametrize(("kind", "result"), [(0, 0), (255, 0), (7, 3)])
def test_only_known_kinds_of_plan_are_cleared(kind, result):
    rig = Rig()
    rig.say(dialect.MAVLink_mission_clear_all_message(1, 1, kind))
    assert rig.messages("MISSION_ACK")[-1].type == result
    rig.say(dialect.MAVLink_mission_count_message(1, 1, 1, 7))
    assert rig.messages("MISSION_ACK")[-1].type == 3
