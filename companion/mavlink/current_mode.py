"""CURRENT_MODE (436), which pymavlink's ArduPilot dialect lacks, as one of its message classes."""

import struct

CURRENT_MODE = 436


class CurrentModeMessage:
    """The flight mode, sent at once when it changes. Source: MAVLink's `development` dialect.

    Attributes:
        standard_mode: MAV_STANDARD_MODE, 0 for a mode that is none of these.
        custom_mode: The mode, in the autopilot's own numbers.
        intended_custom_mode: The mode that the user asked for last; differs in a failsafe.
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
        """Name of the message, as pymavlink's messages tell it."""
        return self.msgname
