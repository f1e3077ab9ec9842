"""Passes messages to their subscribers, decoded or as payloads."""

import logging
from collections.abc import Callable
from typing import TypeVar

from companion.mavlink.messages import UNDECODED, Message, decode, message_id
from companion.mavlink.stats import LinkStats

_LOG = logging.getLogger(__name__)

T = TypeVar("T")
C = TypeVar("C")

Unsubscribe = Callable[[], None]


class MessageDispatcher:
    """Calls the subscribers of a message, synchronously, in the order of their subscription.

    A message without subscribers is not decoded. An exception in a subscriber is reported to
    `on_error`, or logged if that is None, and does not reach other subscribers.
    """

    def __init__(self, stats: LinkStats) -> None:
        self._stats = stats
        self._message_callbacks: dict[int, list[Callable[[Message], None]]] = {}
        self._payload_callbacks: dict[int, list[Callable[[bytes], None]]] = {}
        self.on_error: Callable[[Exception], None] | None = None

    def subscribe(self, name: str, callback: Callable[[Message], None]) -> Unsubscribe:
        """Call `callback` with each decoded message of this name; return how to unsubscribe.

        Raises:
            UnknownMessage: the dialect has no such message.
        """
        return _add(self._message_callbacks, message_id(name), callback)

    def subscribe_raw(self, name: str, callback: Callable[[bytes], None]) -> Unsubscribe:
        """Call `callback` with each payload of this message; return how to unsubscribe.

        The payload is passed as it was sent: MAVLink 2 cuts trailing zeros.

        Raises:
            UnknownMessage: neither the dialect nor `UNDECODED` has such a message.
        """
        return _add(self._payload_callbacks, UNDECODED.get(name) or message_id(name), callback)

    def dispatch(self, message_id: int, payload: bytes) -> None:
        """Pass one message to its subscribers."""
        for raw_callback in tuple(self._payload_callbacks.get(message_id, ())):
            self.guard(raw_callback, payload)
        callbacks = self._message_callbacks.get(message_id)
        if not callbacks:
            return
        try:
            message = decode(message_id, payload)
        except (ValueError, TypeError, UnicodeError):
            self._stats.malformed += 1
            return
        for callback in tuple(callbacks):
            self.guard(callback, message)

    def guard(self, callback: Callable[[T], None], argument: T) -> None:
        """Call `callback(argument)`, and report an exception that it raises."""
        try:
            callback(argument)
        except Exception as error:
            self.report(error)

    def report(self, error: Exception) -> None:
        """Pass an error of a callback to `on_error`, or log it."""
        if self.on_error is None:
            _LOG.error("a callback of the link failed", exc_info=error)
            return
        try:
            self.on_error(error)
        except Exception:
            _LOG.exception("the callback on_error of the link raised an error")


def _add(callbacks_by_id: dict[int, list[C]], message_id: int, callback: C) -> Unsubscribe:
    callbacks = callbacks_by_id.setdefault(message_id, [])
    callbacks.append(callback)

    def unsubscribe() -> None:
        if callback in callbacks:
            callbacks.remove(callback)

    return unsubscribe
