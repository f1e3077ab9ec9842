"""Source and target of a frame. Reference: "Routing" of the MAVLink guide."""

import struct
from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.mavlink.messages import dialect


class Address(NamedTuple):
    """A system id and a component id; in a target, 0 means all systems or all components."""

    system: int
    component: int


EVERYBODY = Address(0, 0)


def source_of(frame: Frame) -> Address:
    """The system and component that sent a frame."""
    return Address(frame.system, frame.component)


def target_of(frame: Frame) -> Address:
    """The target of a frame; `EVERYBODY` for a message without target or of unknown id.

    MAVLink 2 cuts trailing zeros off a payload, so a missing field is 0.
    """
    system_at, component_at = _TARGET_FIELDS.get(frame.message_id, (None, None))
    if system_at is None:
        return EVERYBODY
    payload, length = frame.payload, len(frame.payload)
    system = payload[system_at] if system_at < length else 0
    if system == 0 or component_at is None or component_at >= length:
        return Address(system, 0)
    return Address(system, payload[component_at])


def _target_fields() -> dict[int, tuple[int, int | None]]:
    """Offsets of target system and component in the payload, by message id."""
    fields_by_id: dict[int, tuple[int, int | None]] = {}
    for message_id, message_class in dialect.mavlink_map.items():
        offsets, offset = {}, 0
        for name, code, count in zip(
            message_class.ordered_fieldnames,
            message_class.native_format.decode()[1:],
            message_class.array_lengths,
            strict=True,
        ):
            offsets[name] = offset
            offset += struct.calcsize(f"<{code}") * max(1, count)
        is_manual_control = message_id == dialect.MAVLINK_MSG_ID_MANUAL_CONTROL
        system_at = offsets.get("target" if is_manual_control else "target_system")
        if system_at is not None:
            fields_by_id[message_id] = system_at, offsets.get("target_component")
    return fields_by_id


_TARGET_FIELDS = _target_fields()
