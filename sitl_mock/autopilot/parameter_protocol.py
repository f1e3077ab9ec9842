"""The PARAM protocol on one vehicle: list, read, set, and PX4's hash."""

import struct
from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.parameters import UINT32, Encoding, ParameterRefusedError, ParameterTable
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link

HASH_NAME = "_HASH_CHECK"
_NO_INDEX = -1
_NO_INDEX_UNSIGNED = 65535
_PARAMETERS_PER_SLOT = 4
"""Number of parameters of a list that are sent in one slot."""


class ParameterProtocol:
    """Answers parameter messages."""

    def __init__(self, parameters: ParameterTable, encoding: Encoding) -> None:
        self._parameters = parameters
        self._encoding = encoding
        self._running_lists: dict[str, tuple[Link, int]] = {}

    def request_list(self, _: Message, link: Link) -> None:
        """PARAM_REQUEST_LIST: send every parameter, a few each slot; PX4 sends its hash first."""
        if self._encoding.has_hash:
            self._send_hash(link)
        self._running_lists[link.name] = (link, 0)

    def request_read(self, message: Message, link: Link) -> None:
        """PARAM_REQUEST_READ: send one parameter, by index or, with index -1, by name.

        If the parameter does not exist, send PARAM_ERROR.
        """
        index = message.param_index
        if index == _NO_INDEX:
            name = message.param_id
            if name == HASH_NAME and self._encoding.has_hash:
                self._send_hash(link)
            elif name in self._parameters:
                self._send_alone(name, link)
            else:
                self._refuse(message, link, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            return
        try:
            self._send(self._parameters.name_of(index), index, link)
        except IndexError:
            self._refuse(message, link, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)

    def set(self, message: Message, link: Link) -> None:
        """PARAM_SET: change the value and send the new one, or send PARAM_ERROR.

        A PARAM_SET of PX4's hash is ignored.
        """
        name = message.param_id
        if name == HASH_NAME and self._encoding.has_hash:
            return
        if name not in self._parameters:
            self._refuse(message, link, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            return
        try:
            self._parameters.set(
                name, self._encoding.from_wire(name, message.param_value, message.param_type)
            )
        except ParameterRefusedError:
            self._refuse(message, link, dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
            return
        self._send_alone(name, link)

    def send_changed(self, name: str, links: Iterable[Link]) -> None:
        """Send a parameter that the autopilot itself changed."""
        for link in links:
            self._send_alone(name, link)

    def step(self) -> None:
        """Send the next few parameters of every requested list."""
        if not self._running_lists:
            return
        for key, (link, index) in list(self._running_lists.items()):
            end = min(index + _PARAMETERS_PER_SLOT, len(self._parameters))
            for position in range(index, end):
                self._send(self._parameters.name_of(position), position, link)
            if end == len(self._parameters):
                del self._running_lists[key]
            else:
                self._running_lists[key] = (link, end)

    def _send_alone(self, name: str, link: Link) -> None:
        """Send a parameter that is not part of a list."""
        index = (
            self._parameters.index_of(name) if self._encoding.sends_index else _NO_INDEX_UNSIGNED
        )
        self._send(name, index, link)

    def _send(self, name: str, index: int, link: Link) -> None:
        value, param_type = self._encoding.to_wire(name, self._parameters[name])
        link.send(
            dialect.MAVLink_param_value_message(
                name.encode(), value, param_type, len(self._parameters), index
            )
        )

    def _send_hash(self, link: Link) -> None:
        value = struct.unpack("<f", struct.pack("<I", self._parameters.hash()))[0]
        link.send(
            dialect.MAVLink_param_value_message(
                HASH_NAME.encode(), value, UINT32, len(self._parameters), _NO_INDEX_UNSIGNED
            )
        )

    def _refuse(self, message: Message, link: Link, code: int) -> None:
        link.send(
            dialect.MAVLink_param_error_message(
                message.get_srcSystem(),
                message.get_srcComponent(),
                message.param_id.encode(),
                getattr(message, "param_index", _NO_INDEX),
                code,
            )
        )
