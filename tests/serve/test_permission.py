"""Who may command: this computer, those that sign, those that the configuration trusts."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.mavlink.framing import FrameScanner
from companion.mavlink.signing import Signing
from companion.serve.network.client import Client
from companion.serve.network.permission import Permission, reads_only

KEY = bytes(range(32))


class Somebody(Client):
    def __init__(self, host=None, device=None):
        super().__init__("somebody", host=host, device=device, streaming=False)

    def _flush(self):
        raise AssertionError("nothing is sent here")


def packed(message, *, signed=False):
    mav = dialect.MAVLink(None, 255, 190)
    if signed:
        mav.signing.secret_key, mav.signing.sign_outgoing = KEY, True
        mav.signing.timestamp = Signing(KEY)._stamp_checker.program_date()
    return FrameScanner().feed(message.pack(mav))[0]


def command(number):
    return dialect.MAVLink_command_long_message(1, 1, number, 0, 1, 0, 0, 0, 0, 0, 0)


def ftp(opcode):
    payload = [0] * 251
    payload[3] = opcode
    return dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, payload)


ARM = command(dialect.MAV_CMD_COMPONENT_ARM_DISARM)
READING = [
    dialect.MAVLink_param_request_list_message(1, 1),
    dialect.MAVLink_mission_request_list_message(1, 1),
    dialect.MAVLink_mission_ack_message(1, 1, 0),
    dialect.MAVLink_log_request_data_message(1, 1, 3, 0, 90),
    command(dialect.MAV_CMD_REQUEST_MESSAGE),
    ftp(4),
    ftp(15),
]
COMMANDING = [
    ARM,
    dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL),
    dialect.MAVLink_param_set_message(1, 1, b"X", 1.0, 9),
    dialect.MAVLink_system_time_message(1_700_000_000_000_000, 1000),
    dialect.MAVLink_mission_count_message(1, 1, 2),
    dialect.MAVLink_mission_clear_all_message(1, 1),
    dialect.MAVLink_set_mode_message(1, 1, 4),
    dialect.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8),
    dialect.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0),
    dialect.MAVLink_set_attitude_target_message(0, 1, 1, 128, [1, 0, 0, 0], 0, 0, 0, 0.5),
    dialect.MAVLink_log_erase_message(1, 1),
    ftp(6),
    ftp(8),
]


@pytest.mark.parametrize("message", READING, ids=lambda each: each.get_type())
def test_reading_is_open_to_everybody(message):
    assert reads_only(packed(message))
    assert Permission((), None).refusal(Somebody("192.0.2.7"), packed(message)) is None


@pytest.mark.parametrize("message", COMMANDING, ids=lambda each: each.get_type())
def test_a_stranger_may_not_command(message):
    assert not reads_only(packed(message))
    refusal = Permission((), None).refusal(Somebody("192.0.2.7"), packed(message))
    assert "serve.trusted" in refusal


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.1", "::1"])
def test_this_computer_may_command(host):
    assert Permission((), None).refusal(Somebody(host), packed(ARM)) is None


@pytest.mark.parametrize(
    "client", [Somebody("192.0.2.7"), Somebody("2001:db8::1"), Somebody(device="/dev/ttyUSB1")]
)
def test_whom_the_configuration_trusts_may_command(client):
    permission = Permission(("192.0.2.7", "2001:DB8:0::1", "/dev/ttyUSB1"), None)
    assert permission.refusal(client, packed(ARM)) is None
    assert permission.refusal(Somebody("192.0.2.8"), packed(ARM)) is not None
    assert permission.refusal(Somebody(device="/dev/ttyUSB2"), packed(ARM)) is not None


def test_who_signs_with_the_vehicles_key_may_command():
    signed = packed(ARM, signed=True)
    permission = Permission((), Signing(KEY))
    assert permission.refusal(Somebody("192.0.2.7"), signed) is None
    assert permission.refusal(Somebody("192.0.2.7"), signed) is not None, "a recording"


def test_a_signature_by_another_key_or_without_a_key_of_ours_proves_nothing():
    signed = packed(ARM, signed=True)
    assert Permission((), Signing(bytes(32))).refusal(Somebody("192.0.2.7"), signed) is not None
    assert Permission((), None).refusal(Somebody("192.0.2.7"), signed) is not None
    assert Permission((), Signing(KEY)).refusal(Somebody("192.0.2.7"), packed(ARM)) is not None
