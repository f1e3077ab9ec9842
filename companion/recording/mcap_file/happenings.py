"""What a recorded flight tells in words: phases, events, alarms, and changes of values."""

from typing import Any, NamedTuple


class Phase(NamedTuple):
    """A phase of the flight.

    Attributes:
        time: when it began, s since the flight began.
        name: shown to the user.
        waits_for: the condition that ends it.
    """

    time: float
    name: str
    waits_for: str


class Event(NamedTuple):
    """Something that happened, in words.

    Attributes:
        time: s since the flight began.
        text: as the user saw it.
        level: 2 information, 3 warning, 4 error (foxglove_msgs/msg/Log).
        source: "flight", "safety", "autopilot" or "phase".
    """

    time: float
    text: str
    level: int
    source: str


class AlarmChange(NamedTuple):
    """A safety monitor raised its alarm, or its alarm is over.

    Attributes:
        time: s since the flight began.
        raised: false: it is over.
        monitor: its name, as in `companion.safety.table`.
        reason: what was wrong; empty when it is over.
        action: what the flight does about it, in words.
    """

    time: float
    raised: bool
    monitor: str
    reason: str
    action: str


class ValuesChange(NamedTuple):
    """Values of the configuration begin to change.

    Attributes:
        time: on our clock, s.
        at_once: whether they are not slewed.
        values: the new ones, by section and key.
    """

    time: float
    at_once: bool
    values: dict[str, dict[str, Any]]
