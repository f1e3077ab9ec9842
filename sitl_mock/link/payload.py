"""Payloads of pymavlink's message classes: message to bytes and back.

Field order, `struct` layout and CRC_EXTRA are pymavlink's. pymavlink's ``pack`` and ``decode`` take
about twice as long, because they compute for every frame what depends only on the class.
"""

from collections.abc import Callable, Iterable
from functools import cache
from itertools import accumulate, chain
from operator import attrgetter, itemgetter
from typing import Any

Message = Any
"""A pymavlink message object; the generated classes have no usable types."""


def pack(message: Message) -> bytes:
    """Return the payload of a message, with its trailing zeros."""
    message_class: Any = type(message)
    payload: bytes = message_class.unpacker.pack(*_wire_values(message_class)(message))
    return payload


def unpack(message_class: Any, payload: bytes) -> Message:
    """Return the message of a class with this payload.

    Missing bytes are zero (MAVLink 2 truncates them); bytes after the last known field are ignored.
    """
    layout = message_class.unpacker
    size = layout.size
    return message_class(
        *_arguments(message_class)(layout.unpack(payload.ljust(size, b"\0")[:size]))
    )


@cache
def _wire_values(message_class: Any) -> Callable[[Message], Iterable[Any]]:
    """Return the function that lists the field values of a message class in wire order."""
    names = message_class.ordered_fieldnames
    text_fields = _text_fields(message_class)
    fields = attrgetter(*(f"_{name}_raw" if name in text_fields else name for name in names))
    if len(names) == 1:
        return lambda message: (fields(message),)
    array_flags = [
        bool(length) and name not in text_fields
        for name, length in zip(names, message_class.array_lengths, strict=True)
    ]
    if not any(array_flags):
        return fields
    if sum(array_flags) == 1:
        array_index = array_flags.index(True)

        def flattened_values(message: Message) -> Iterable[Any]:
            values = fields(message)
            return (*values[:array_index], *values[array_index], *values[array_index + 1 :])

        return flattened_values
    return lambda message: chain.from_iterable(
        value if is_array else (value,)
        for value, is_array in zip(fields(message), array_flags, strict=True)
    )


@cache
def _arguments(message_class: Any) -> Callable[[tuple[Any, ...]], Iterable[Any]]:
    """Return the function that turns values in wire order into constructor arguments."""
    lengths = message_class.lengths
    starts = (0, *accumulate(lengths))
    if sum(lengths) == len(lengths) > 1 and not _text_fields(message_class):
        return itemgetter(*message_class.orders)
    value_selectors = [
        starts[order] if lengths[order] == 1 else slice(starts[order], starts[order + 1])
        for order in message_class.orders
    ]
    text_indices = [message_class.fieldnames.index(name) for name in _text_fields(message_class)]

    def arguments(values: tuple[Any, ...]) -> Iterable[Any]:
        selected_values = [
            list(values[selector]) if isinstance(selector, slice) else values[selector]
            for selector in value_selectors
        ]
        for index in text_indices:
            selected_values[index] = selected_values[index].rstrip(b"\0")
        return selected_values

    return arguments


def _text_fields(message_class: Any) -> set[str]:
    """Return the names of the text fields of a message class."""
    return {
        name
        for name, type_ in zip(message_class.fieldnames, message_class.fieldtypes, strict=True)
        if type_ == "char"
    }
