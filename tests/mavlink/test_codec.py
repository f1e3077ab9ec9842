"""The codec against pymavlink, byte for byte, in both directions."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from pymavlink.dialects.v20 import development

from companion.attitude import BodyRates
from companion.mavlink.codec import (
    SetpointEncoder,
    decode_attitude,
    decode_beacon,
    encode_system_time,
)
from companion.mavlink.errors import InvalidSetpoint, UnknownMessage
from companion.mavlink.messages import CRC_EXTRA, MESSAGE_IDS, decode, encode, message_id
from tests.mavlink.fakes import attitude

float32 = st.floats(width=32, allow_nan=False, allow_infinity=False)
uint32 = st.integers(0, 2**32 - 1)


def payload_of(message):
    message.pack(dialect.MAVLink(None))
    return bytes(message.get_payload())


def encoder(*, signed=False):
    return SetpointEncoder(1, 191, 3, 1, signed=signed)


@given(
    uint32, st.tuples(float32, float32, float32), st.floats(0.0, 1.0, width=32), st.integers(0, 255)
)
@settings(deadline=None)
def test_setpoint_is_pymavlinks_byte_for_byte(time_boot_ms, rates, thrust, sequence):
    mav = dialect.MAVLink(None, 1, 191)
    mav.seq = sequence
    expected = dialect.MAVLink_set_attitude_target_message(
        time_boot_ms, 3, 1, 128, [1.0, 0.0, 0.0, 0.0], *rates, thrust
    ).pack(mav)
    assert encoder().frame(sequence, time_boot_ms, BodyRates(*rates), thrust) == expected


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e39, -1e39])
@pytest.mark.parametrize("place", range(4))
def test_nothing_that_is_not_finite_gets_out(bad, place):
    values = [0.1, 0.2, 0.3, 0.5]
    values[place] = bad
    with pytest.raises(InvalidSetpoint, match="must be finite"):
        encoder().frame(0, 4, BodyRates(*values[:3]), values[3])


@pytest.mark.parametrize("thrust", [-1e-9, 1.0000001, -1.0, 1.5])
def test_thrust_outside_its_range_is_refused(thrust):
    with pytest.raises(InvalidSetpoint, match="thrust"):
        encoder().frame(0, 4, BodyRates(0.0, 0.0, 0.0), thrust)


@pytest.mark.parametrize("stamp", [-1, 2**32])
def test_a_time_stamp_the_wire_cannot_hold_is_refused(stamp):
    with pytest.raises(InvalidSetpoint, match="time_boot_ms"):
        encoder().frame(0, stamp, BodyRates(0.0, 0.0, 0.0), 0.5)


@given(st.floats(), st.floats(), st.floats(), st.floats(), uint32)
@settings(max_examples=500, deadline=None)
def test_whatever_goes_in_only_finite_values_come_out(roll, pitch, yaw, thrust, stamp):
    try:
        frame = encoder().frame(0, stamp, BodyRates(roll, pitch, yaw), thrust)
    except InvalidSetpoint:
        return
    fields = struct.unpack_from("<8f", frame, 14)
    assert all(math.isfinite(field) for field in fields)
    assert 0.0 <= fields[7] <= 1.0
    assert frame[10 + 38] == 128


@given(uint32, st.lists(float32, min_size=7, max_size=7))
@settings(deadline=None)
def test_attitude_reads_what_pymavlink_wrote(time_boot_ms, values):
    decoded = decode_attitude(payload_of(attitude(time_boot_ms, *values)))
    assert decoded == (time_boot_ms, tuple(values[:4]), BodyRates(*values[4:]))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(7))
def test_an_attitude_with_one_bad_number_is_none(bad, place):
    values = [1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3]
    values[place] = bad
    assert decode_attitude(payload_of(attitude(4, *values))) is None


def test_opposite_infinities_do_not_cancel():
    assert decode_attitude(payload_of(attitude(4, math.inf, -math.inf, 0, 0, 0, 0, 0))) is None


def test_truncated_and_extended_attitudes_are_read():
    message = attitude(4, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    payload = payload_of(message)
    assert len(payload) == 8  # all after q1 is zero and cut
    level = (4, (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0))
    assert decode_attitude(payload) == level
    assert decode_attitude(payload.ljust(48, b"\0") + b"\x01\x02") == level


@pytest.mark.parametrize("name", sorted(MESSAGE_IDS.keys() - {"CURRENT_MODE"}))
def test_every_message_is_decoded_as_pymavlink_does(name):
    kind = dialect.mavlink_map[MESSAGE_IDS[name]]
    size = kind.unpacker.size
    payload = bytes((7 * index + 1) % 120 for index in range(size)).rstrip(b"\0")
    ours = decode(kind.id, payload)
    message_again = decode(kind.id, encode(ours))
    sender = dialect.MAVLink(None, 1, 1)
    theirs = dialect.MAVLink(None).decode(bytearray(ours.pack(sender)))
    assert ours.to_dict() == theirs.to_dict() == message_again.to_dict()


def test_current_mode_is_decoded_though_the_dialect_lacks_it():
    kind = development.MAVLink_current_mode_message
    told = kind(standard_mode=3, custom_mode=0x00060000, intended_custom_mode=0x06040000)
    assert message_id("CURRENT_MODE") == kind.id
    assert CRC_EXTRA[kind.id] == bytes([kind.crc_extra])
    ours = decode(kind.id, payload_of(told))
    fields = ours.get_type(), ours.standard_mode, ours.custom_mode, ours.intended_custom_mode
    assert fields == ("CURRENT_MODE", 3, 0x00060000, 0x06040000)
    assert decode(kind.id, b"\x01").custom_mode == 1  # trailing zeros are cut


def test_system_time_is_the_lockstep_answer():
    assert encode_system_time(123456).rstrip(b"\0") == payload_of(
        dialect.MAVLink_system_time_message(0, 123456)
    )
    assert decode_beacon(encode_system_time(123456).rstrip(b"\0")) == 123456
    assert decode_beacon(b"\1" + encode_system_time(123456)[1:]) is None


def test_unknown_names_are_told():
    with pytest.raises(UnknownMessage, match="ATITUDE"):
        message_id("ATITUDE")
