"""The text messages of a recorded flight: phases, events, alarms, and changes of values."""

from typing import Any, NamedTuple


class Phase(NamedTuple):
    """A phase of the flight.

    Attributes:
        time: its beginning, s since the flight began.
        name: shown to the user.
        waits_for: the condition that ends it.
    """

    time: float
    name: str
    waits_for: str


class Event(NamedTuple):
    """An event, in words.

    Attributes:
        time: time since the flight began, s.
        text: text as shown to the user.
        level: as in foxglove_msgs/msg/Log: 2 (information), 3 (warning) or 4 (error). A recorded
            flight has 3 for the source "safety", else 2. A `.tlog` has the autopilot's severity.
        source: "flight", "safety", "autopilot" or "phase".
    """

    time: float
    text: str
    level: int
    source: str


class AlarmChange(NamedTuple):
    """A safety monitor raised or ended its alarm.

    Attributes:
        time: time since the flight began, s.
        raised: true: the alarm was raised. False: it ended.
        monitor: name of the monitor in `companion.safety.table`.
        reason: description of the breach; empty when the alarm ended.
        action: action of the flight, in words; empty when the alarm ended.
    """

    time: float
    raised: bool
    monitor: str
    reason: str
    action: str


class ValuesChange(NamedTuple):
    """A change of values of the configuration begins.

    Attributes:
        time: time on our clock, s.
        at_once: whether the values change at once, without slewing.
        values: new values, by section and key.
    """

    time: float
    at_once: bool
    values: dict[str, dict[str, Any]]
