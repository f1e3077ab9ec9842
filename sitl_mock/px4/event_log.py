"""PX4's announcements: events with sequence numbers, which it resends on request, and texts.

Source: the MAVLink events interface; intervals and flags as recorded.
"""

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.state import State
from sitl_mock.link.event_messages import (
    CURRENT_EVENT_SEQUENCE,
    EVENT,
    RESPONSE_EVENT_ERROR,
    Layout,
)
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link
from sitl_mock.px4.events import PX4_EVENTS

_MAX_KEPT_EVENTS = 20
"""Number of events that can be requested again."""
_SEQUENCE_PERIOD_US = 3_000_000
"""Period of CURRENT_EVENT_SEQUENCE."""
_SEQUENCE_RESET_FLAG = 1
"""Value of MAV_EVENT_CURRENT_SEQUENCE_FLAGS before the first event: the sequence restarts."""
_ERROR_UNAVAILABLE = 0
"""Value of MAV_EVENT_ERROR_REASON: the event is not available."""


class _SentEvent(NamedTuple):
    """An event that was sent: its sequence number, and the payload of its EVENT."""

    sequence: int
    payload: bytes


class EventLog:
    """Sends events on all links.

    Args:
        state: the autopilot's state, which gives the vehicle time.
    """

    def __init__(self, state: State, links: list[Link]) -> None:
        self._state = state
        self._links = links
        self._sent_events: deque[_SentEvent] = deque(maxlen=_MAX_KEPT_EVENTS)
        self._latest_sequence = 0
        self._sequence_sent_us = 0

    def send(
        self,
        event_id: int,
        severity: int,
        internal_severity: int | None = None,
        arguments: bytes = b"",
    ) -> None:
        """Send a new event.

        Args:
            event_id: see `sitl_mock.px4.events.event_id`.
            severity: MAV_SEVERITY for the user; 8 = for programs only.
            internal_severity: MAV_SEVERITY for the vehicle's log; None = the same.
            arguments: packed arguments.
        """
        is_first = not self._sent_events
        self._latest_sequence = (self._latest_sequence + 1) & 0xFFFF
        if is_first:
            self._send_sequence(_SEQUENCE_RESET_FLAG)
        log_levels = (severity if internal_severity is None else internal_severity) << 4 | severity
        payload = EVENT.payload.pack(
            event_id,
            self._state.stamp_us // 1000,
            self._latest_sequence,
            0,
            0,
            log_levels,
            arguments,
        )
        self._sent_events.append(_SentEvent(self._latest_sequence, payload))
        for link in self._links:
            _send(link, EVENT, payload)

    def step(self) -> None:
        """Send the latest sequence number periodically, so that receivers notice lost events."""
        if self._state.time_us - self._sequence_sent_us >= _SEQUENCE_PERIOD_US:
            self._send_sequence(0 if self._sent_events else _SEQUENCE_RESET_FLAG)

    def answer_request(self, request: Message, link: Link) -> None:
        """Answer a REQUEST_EVENT: resend each event, or refuse it with a reason.

        If the request is for more events than the log holds, one refusal covers the oldest ones.
        """
        first, last = request.first_sequence, request.last_sequence
        count = (last - first & 0xFFFF) + 1
        if count > _MAX_KEPT_EVENTS:
            self._refuse(first, request, link)
            first = last - _MAX_KEPT_EVENTS + 1
        payloads = {sent.sequence: sent.payload for sent in self._sent_events}
        for unwrapped_sequence in range(first, first + min(count, _MAX_KEPT_EVENTS)):
            sequence = unwrapped_sequence & 0xFFFF
            if sequence in payloads:
                _send(link, EVENT, payloads[sequence])
            else:
                self._refuse(sequence, request, link)

    def _refuse(self, sequence: int, request: Message, link: Link) -> None:
        other_sequences = (sent.sequence for sent in self._sent_events if sent.sequence != sequence)
        oldest = min(
            other_sequences,
            key=lambda other: other - sequence & 0xFFFF,
            default=self._latest_sequence,
        )
        payload = RESPONSE_EVENT_ERROR.payload.pack(
            sequence,
            oldest,
            request.get_srcSystem(),
            request.get_srcComponent(),
            _ERROR_UNAVAILABLE,
        )
        _send(link, RESPONSE_EVENT_ERROR, payload)

    def _send_sequence(self, flags: int) -> None:
        self._sequence_sent_us = self._state.time_us
        payload = CURRENT_EVENT_SEQUENCE.payload.pack(self._latest_sequence, flags)
        for link in self._links:
            _send(link, CURRENT_EVENT_SEQUENCE, payload)


def _send(link: Link, layout: Layout, payload: bytes) -> None:
    link.send_raw(layout.message_id, layout.crc_extra, payload)


class Announcer:
    """Announces events: as EVENT on all links, as text on those with a ground station."""

    def __init__(self, links: Iterable[Link], events: EventLog) -> None:
        self._links = list(links)
        self._events = events
        self._text_id = 0

    def __call__(self, kind: EventKind, detail: str, arguments: bytes = b"") -> None:
        """Announce an event.

        `detail`: replaces the placeholder in the event's text. `arguments`: packed arguments that
        replace the constant ones of the event.
        """
        event = PX4_EVENTS[kind]
        if event.event_id:
            self._events.send(
                event.event_id,
                event.severity,
                event.internal_severity,
                arguments or event.arguments,
            )
        for link in self._links:
            if link.gcs_has_sent:
                link.send_text(event.text.format(detail), event.severity, self._text_id)
        self._text_id = (self._text_id + 1) & 0xFFFF
