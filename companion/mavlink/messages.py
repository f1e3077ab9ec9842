"""Messages by name and id, and their payloads decoded and encoded by pymavlink.

pymavlink's dialect holds MAVLink common and ArduPilot's estimator status. The dialect lacks
CURRENT_MODE, which is defined here, and MAVLink's events, whose payloads are passed on undecoded.
"""

import struct
from collections.abc import Callable
from operator import itemgetter
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

from companion.mavlink.errors import UnknownMessage

dialect: Any = ardupilotmega
"""pymavlink's message classes and enumerations."""

Message = Any
"""A decoded pymavlink message: fields as attributes, name by `get_type()`."""

CURRENT_MODE = 436


class CurrentModeMessage:
    """The flight mode, sent at once when it changes. Source: MAVLink's `development` dialect.

    Attributes:
        standard_mode: MAV_STANDARD_MODE; 0 for a mode that is not a standard mode.
        custom_mode: number of the mode, specific to the autopilot.
        intended_custom_mode: the mode that the user commanded last; it differs in a failsafe.
    """

    msgname = "CURRENT_MODE"
    crc_extra = 193
    unpacker = struct.Struct("<IIB")
    lengths = (1, 1, 1)
    orders = (2, 0, 1)

    def __init__(self, standard_mode: int, custom_mode: int, intended_custom_mode: int) -> None:
        self.standard_mode = standard_mode
        self.custom_mode = custom_mode
        self.intended_custom_mode = intended_custom_mode

    def get_type(self) -> str:
        """Name of the message, like pymavlink's `get_type`."""
        return self.msgname


_MESSAGE_CLASSES: dict[int, Any] = {**dialect.mavlink_map, CURRENT_MODE: CurrentModeMessage}

UNDECODED = {"EVENT": 410, "CURRENT_EVENT_SEQUENCE": 411}
"""Ids of messages of MAVLink common that pymavlink lacks; their payloads are not decoded."""

MESSAGE_IDS: dict[str, int] = {
    message_class.msgname: number for number, message_class in _MESSAGE_CLASSES.items()
}
CRC_EXTRA: dict[int, bytes] = {
    **{
        number: bytes([message_class.crc_extra])
        for number, message_class in _MESSAGE_CLASSES.items()
    },
    410: bytes([160]),
    411: bytes([106]),
}


_IN_FIELD_ORDER: dict[int, Callable[[tuple[Any, ...]], tuple[Any, ...]]] = {
    number: itemgetter(*message_class.orders)
    for number, message_class in _MESSAGE_CLASSES.items()
    if len(message_class.orders) > 1
    and set(message_class.lengths) == {1}
    and "s" not in message_class.unpacker.format
}
"""Functions by message id. Each takes a payload's values and returns them in the order of the
constructor's arguments. Messages with arrays or texts are left out.
"""


def message_id(name: str) -> int:
    """Id of a message by its name, such as `ATTITUDE_QUATERNION`.

    Raises:
        UnknownMessage: the dialect has no such message.
    """
    try:
        return MESSAGE_IDS[name]
    except KeyError:
        raise UnknownMessage(
            f"MAVLink has no message {name!r}; names are in capitals, as in HEARTBEAT"
        ) from None


def decode(message_id: int, payload: bytes) -> Message:
    """Build the message object from a payload whose checksum was already checked."""
    message_class = _MESSAGE_CLASSES[message_id]
    size = message_class.unpacker.size
    wire_values = message_class.unpacker.unpack(payload[:size].ljust(size, b"\0"))
    if message_id in _IN_FIELD_ORDER:
        return message_class(*_IN_FIELD_ORDER[message_id](wire_values))
    fields: list[Any] = []  # in the order of the payload
    index = 0
    for length in message_class.lengths:
        value = wire_values[index]
        if isinstance(value, bytes):
            fields.append(value.rstrip(b"\0"))
        else:
            fields.append(value if length == 1 else list(wire_values[index : index + length]))
        index += length
    return message_class(*(fields[order] for order in message_class.orders))


def encode(message: Message) -> bytes:
    """Payload of a pymavlink message."""
    message.pack(_PACKER)
    return bytes(message.get_payload())


_PACKER = dialect.MAVLink(None)
