"""The mission protocol: upload, download and clearing of plans. No plan is flown.

Source: "Mission Protocol" of the MAVLink guide.
"""

from collections.abc import Callable
from typing import NamedTuple

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link

_ACCEPTED = dialect.MAV_MISSION_ACCEPTED
_PLAN_TYPES = range(3)
"""MAV_MISSION_TYPE of mission, fence and rally points."""
_MAX_ITEMS = 1000
"""Largest number of items in a plan."""


class _Upload(NamedTuple):
    """A plan that is being uploaded: its sender, and its items so far."""

    mission_type: int
    item_count: int
    sender: tuple[int, int]
    items: list[Message]


class MissionProtocol:
    """Keeps one plan of each type, and returns it unchanged."""

    def __init__(self) -> None:
        self.plans: dict[int, list[Message]] = {mission_type: [] for mission_type in _PLAN_TYPES}
        self._upload: _Upload | None = None
        self.handlers: dict[str, Callable[[Message, Link], None]] = {
            "MISSION_REQUEST_LIST": self._send_count,
            "MISSION_REQUEST_INT": self._send_item,
            "MISSION_REQUEST": self._send_item,
            "MISSION_COUNT": self._begin_upload,
            "MISSION_ITEM_INT": self._receive_item,
            "MISSION_CLEAR_ALL": self._clear,
        }

    def _send_count(self, message: Message, link: Link) -> None:
        count = len(self.plans.get(message.mission_type, ()))
        link.send(
            dialect.MAVLink_mission_count_message(*_sender(message), count, message.mission_type)
        )

    def _send_item(self, message: Message, link: Link) -> None:
        plan = self.plans.get(message.mission_type, [])
        if message.seq >= len(plan):
            _acknowledge(message, link, dialect.MAV_MISSION_INVALID_SEQUENCE)
            return
        item = plan[message.seq]
        fields = {name: getattr(item, name) for name in item.get_fieldnames()}
        fields["target_system"], fields["target_component"] = _sender(message)
        link.send(dialect.MAVLink_mission_item_int_message(**fields))

    def _begin_upload(self, message: Message, link: Link) -> None:
        if message.mission_type not in self.plans:
            _acknowledge(message, link, dialect.MAV_MISSION_UNSUPPORTED)
        elif message.count > _MAX_ITEMS:
            _acknowledge(message, link, dialect.MAV_MISSION_NO_SPACE)
        elif message.count == 0:
            self.plans[message.mission_type] = []
            _acknowledge(message, link, _ACCEPTED)
        else:
            self._upload = _Upload(message.mission_type, message.count, _sender(message), [])
            self._request_item(link, self._upload)

    def _receive_item(self, message: Message, link: Link) -> None:
        upload = self._upload
        if upload is None or upload.sender != _sender(message):
            _acknowledge(message, link, dialect.MAV_MISSION_ERROR)
            return
        if message.seq != len(upload.items):
            self._request_item(link, upload)
            return
        upload.items.append(message)
        if len(upload.items) < upload.item_count:
            self._request_item(link, upload)
            return
        self.plans[upload.mission_type], self._upload = upload.items, None
        _acknowledge(message, link, _ACCEPTED)

    @staticmethod
    def _request_item(link: Link, upload: _Upload) -> None:
        sequence, mission_type = len(upload.items), upload.mission_type
        link.send(
            dialect.MAVLink_mission_request_int_message(*upload.sender, sequence, mission_type)
        )

    def _clear(self, message: Message, link: Link) -> None:
        clears_all = message.mission_type == dialect.MAV_MISSION_TYPE_ALL
        plan_types = _PLAN_TYPES if clears_all else self.plans.keys() & {message.mission_type}
        for mission_type in plan_types:
            self.plans[mission_type] = []
        result = _ACCEPTED if plan_types else dialect.MAV_MISSION_UNSUPPORTED
        _acknowledge(message, link, result)


def _sender(message: Message) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()


def _acknowledge(message: Message, link: Link, result: int) -> None:
    link.send(dialect.MAVLink_mission_ack_message(*_sender(message), result, message.mission_type))
