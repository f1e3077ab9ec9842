"""Which messages of clients ask for our mode, and which would starve our control. Pure."""

from math import isfinite

from companion.mavlink.commands import (
    MAV_CMD_DO_SET_MODE,
    MAV_CMD_NAV_LAND,
    MAV_CMD_NAV_RETURN_TO_LAUNCH,
)
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MESSAGE_IDS, decode, dialect
from companion.vehicle.autopilot import Autopilot, ControlEntry

_COMMAND_LONG = dialect.MAVLINK_MSG_ID_COMMAND_LONG
_COMMAND_INT = dialect.MAVLINK_MSG_ID_COMMAND_INT
_SET_MODE = dialect.MAVLINK_MSG_ID_SET_MODE
_REQUEST_DATA_STREAM = dialect.MAVLINK_MSG_ID_REQUEST_DATA_STREAM
_SET_MESSAGE_INTERVAL = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
_LEAVING = MAV_CMD_DO_SET_MODE, MAV_CMD_NAV_LAND, MAV_CMD_NAV_RETURN_TO_LAUNCH
_CUSTOM_MODE = 1
_MESSAGES = frozenset({_COMMAND_LONG, _COMMAND_INT, _SET_MODE, _REQUEST_DATA_STREAM})
"""All messages that are looked at here."""


def asks_for_control(frame: Frame, autopilot: Autopilot) -> bool:
    """Whether a frame commands the mode in which the autopilot obeys setpoints.

    Only where that mode is entered by a command (PX4's OFFBOARD).
    """
    if frame.message_id not in _MESSAGES or autopilot.control_entry is not ControlEntry.BY_COMMAND:
        return False
    if frame.message_id == _SET_MODE:
        custom_mode = decode(frame.message_id, frame.payload).custom_mode
        return bool(custom_mode == autopilot.modes[autopilot.offboard_mode])
    if frame.message_id == _REQUEST_DATA_STREAM:
        return False
    message = decode(frame.message_id, frame.payload)
    wanted = autopilot.set_mode(autopilot.offboard_mode)
    return bool(
        message.command == MAV_CMD_DO_SET_MODE
        and isfinite(message.param1)
        and int(message.param1) & _CUSTOM_MODE
        and (message.param2, message.param3) == (wanted.p2, wanted.p3)
    )


def leaves_control(frame: Frame) -> bool:
    """Whether a frame commands a mode, a landing or a return: its sender gives control up."""
    if frame.message_id == _SET_MODE:
        return True
    if frame.message_id not in (_COMMAND_LONG, _COMMAND_INT):
        return False
    return decode(frame.message_id, frame.payload).command in _LEAVING


def starves_control(frame: Frame, needed: dict[str, float]) -> bool:
    """Whether a frame would make telemetry rarer than control needs it.

    Args:
        frame: of a client.
        needed: rates by message name, Hz.
    """
    if frame.message_id == _REQUEST_DATA_STREAM:
        return True
    if frame.message_id not in (_COMMAND_LONG, _COMMAND_INT):
        return False
    message = decode(frame.message_id, frame.payload)
    if message.command != _SET_MESSAGE_INTERVAL:
        return False
    rates = {MESSAGE_IDS[name]: rate for name, rate in needed.items() if name in MESSAGE_IDS}
    rate = rates.get(int(message.param1)) if isfinite(message.param1) else None
    return rate is not None and not 0.0 < message.param2 <= 1e6 / rate * 1.001
