"""Recognizes clients' messages that request our mode, steer in it, leave it, or reduce telemetry.

All functions are pure.
"""

from math import isfinite

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MESSAGE_IDS, Message, decode, dialect
from companion.serve.network.permission import COMMAND_IDS
from companion.vehicle.autopilot import Autopilot, ControlEntry

_SET_MODE = dialect.MAVLINK_MSG_ID_SET_MODE
_REQUEST_DATA_STREAM = dialect.MAVLINK_MSG_ID_REQUEST_DATA_STREAM
MISSION_ITEMS = dialect.MAVLINK_MSG_ID_MISSION_ITEM, dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT
"""Ids of the messages with one mission item."""
_GUIDED_CURRENT_VALUES = 2, 3
"""Values of a mission item's field `current` that ArduPilot obeys at once: 2 flies to the item's
position, 3 to its height."""
_SET_MESSAGE_INTERVAL = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
_STEERING_COMMANDS = dialect.MAV_CMD_DO_REPOSITION, dialect.MAV_CMD_DO_PAUSE_CONTINUE
_LEAVING_COMMANDS = (
    dialect.MAV_CMD_DO_SET_MODE,
    dialect.MAV_CMD_NAV_LAND,
    dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH,
)
_CUSTOM_MODE_FLAG = 1
_MAIN_MODE_MASK = 0xFF << 16
"""Mask of PX4's main mode in `custom_mode`; OFFBOARD has no sub mode, and PX4 ignores its bits."""


def command_in(frame: Frame) -> Message | None:
    """The COMMAND_LONG or COMMAND_INT in a frame; None for other messages."""
    if frame.message_id not in COMMAND_IDS:
        return None
    return decode(frame.message_id, frame.payload)


def asks_for_control(frame: Frame, autopilot: Autopilot) -> bool:
    """Whether a frame commands the mode in which the autopilot obeys setpoints.

    Always false for an autopilot whose control begins with the first setpoint (ArduPilot). For PX4,
    every form of the command counts: PX4 reads modes as bytes, and accepts NAV_GUIDED_ENABLE.
    """
    if autopilot.control_entry is not ControlEntry.BY_COMMAND:
        return False
    offboard = autopilot.modes[autopilot.offboard_mode] & _MAIN_MODE_MASK
    if frame.message_id == _SET_MODE:
        custom_mode = decode(frame.message_id, frame.payload).custom_mode
        return bool(custom_mode & _MAIN_MODE_MASK == offboard)
    message = command_in(frame)
    if message is None:
        return False
    if message.command == dialect.MAV_CMD_NAV_GUIDED_ENABLE:
        return bool(message.param1 > 0.0)
    return bool(
        message.command == dialect.MAV_CMD_DO_SET_MODE
        and isfinite(message.param1)
        and int(message.param1) & _CUSTOM_MODE_FLAG
        and isfinite(message.param2)
        and int(message.param2) << 16 & _MAIN_MODE_MASK == offboard
    )


def steers_in_our_mode(frame: Frame, autopilot: Autopilot) -> bool:
    """Whether a frame makes the autopilot fly elsewhere without leaving the mode of our setpoints.

    In GUIDED, ArduPilot flies to the position of a DO_REPOSITION or of a single mission item, and
    after DO_PAUSE_CONTINUE it ignores setpoints until the pause ends. These commands would
    work against the client in control. PX4 leaves OFFBOARD for these commands.
    """
    if autopilot.control_entry is not ControlEntry.BY_FIRST_SETPOINT:
        return False
    if frame.message_id in MISSION_ITEMS:
        return decode(frame.message_id, frame.payload).current in _GUIDED_CURRENT_VALUES
    message = command_in(frame)
    return message is not None and message.command in _STEERING_COMMANDS


def leaves_control(frame: Frame, autopilot: Autopilot) -> bool:
    """Whether a frame gives up its sender's control: it commands a mode, a landing or a return.

    A command of the mode in which the autopilot obeys setpoints (OFFBOARD, GUIDED) does not count:
    some programs repeat it while they are in control.
    """
    our_mode = autopilot.modes[autopilot.offboard_mode]
    if frame.message_id == _SET_MODE:
        return bool(decode(frame.message_id, frame.payload).custom_mode != our_mode)
    message = command_in(frame)
    if message is None or message.command not in _LEAVING_COMMANDS:
        return False
    return bool(message.command != dialect.MAV_CMD_DO_SET_MODE or message.param2 != our_mode)


def reduces_telemetry(frame: Frame, needed: dict[str, float]) -> bool:
    """Whether a frame could reduce telemetry below the rates `needed`, Hz by message name."""
    if frame.message_id == _REQUEST_DATA_STREAM:
        return True
    message = command_in(frame)
    if message is None or message.command != _SET_MESSAGE_INTERVAL:
        return False
    rates = {MESSAGE_IDS[name]: rate for name, rate in needed.items() if name in MESSAGE_IDS}
    rate = rates.get(int(message.param1)) if isfinite(message.param1) else None
    return rate is not None and not 0.0 < message.param2 <= 1e6 / rate * 1.001
