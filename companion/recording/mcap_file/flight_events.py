"""The text messages of a recorded flight: phases, events, alarms, and changes of values."""

from typing import Any, NamedTuple


class Phase(NamedTuple):
    """A phase of the flight."""

    time: float
    """Beginning of the phase, s since the flight began."""
    name: str
    waits_for: str
    """Condition that ends the phase."""


class Event(NamedTuple):
    """An event, in words."""

    time: float
    """Time since the flight began, s."""
    text: str
    level: int
    """As in foxglove_msgs/msg/Log: 2 (information), 3 (warning) or 4 (error). A recorded flight has
    3 for the source "safety", else 2. A `.tlog` has the autopilot's severity."""
    source: str
    """"flight", "safety", "autopilot" or "phase"."""


class AlarmChange(NamedTuple):
    """A safety monitor raised or ended its alarm."""

    time: float
    """Time since the flight began, s."""
    raised: bool
    """True: the alarm was raised. False: it ended."""
    monitor: str
    """Name of the monitor in `companion.safety.table`."""
    reason: str
    """Description of the breach; empty when the alarm ended."""
    action: str
    """Safety action that the alarm causes, in words; empty when the alarm ended."""


class ValuesChange(NamedTuple):
    """A change of configuration values in flight, recorded when the change begins."""

    time: float
    """Time on our clock, s."""
    at_once: bool
    """Whether the values change at once, without slewing."""
    values: dict[str, dict[str, Any]]
    """New values, by section and key."""
