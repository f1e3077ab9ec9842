"""The data on the live page: newest state, last half minute, events and values."""

from collections import deque
from typing import Any

from companion.config import Config
from companion.config.in_flight import changeable_keys, differences
from companion.config.reference import ConfigKey, keys
from companion.files.bounded_yaml import dump_value
from companion.live.channel import Message

SHOWN_S = 30.0
"""Time shown in the plots, s."""
_MOST_STATES, _MOST_EVENTS = 400, 200


class PageData:
    """Keeps what the page shows, from the messages of the flight.

    Attributes:
        states: messages `status` of the last `SHOWN_S` seconds, oldest first.
        state_count: number of states since the page began.
        events: the newest events, newest last, each {"time_s", "text"}.
        event_count: number of events since the page began.
        config: the configuration after the newest change.
        start_config: the configuration with which the flight began.
        can_undo: whether a change can be undone.
        end_text: how the flight ended; None: it has not ended.
    """

    def __init__(self, config: Config) -> None:
        self.states: deque[Message] = deque(maxlen=_MOST_STATES)
        self.state_count = 0
        self.events: deque[dict[str, Any]] = deque(maxlen=_MOST_EVENTS)
        self.event_count = 0
        self.config = self.start_config = config
        self.can_undo = False
        self.end_text: str | None = None

    def take(self, message: Message) -> None:
        """Take one message."""
        match message["kind"]:
            case "status":
                self._take_state(message)
            case "event":
                self._add_event(message["time_s"], message["text"])
            case "phase":
                newest = self.states[-1]["time_s"] if self.states else 0.0
                self._add_event(newest, f"phase: {message['name']}")
            case "config":
                self.config = Config.model_validate(message["config"])
                self.can_undo = bool(message["can_undo"])
            case "end":
                self.end_text = str(message["text"])

    def end(self) -> None:
        """Note the end of the flight, if its message `end` was not received."""
        self.end_text = self.end_text or "the program that flew has ended"

    def states_since(self, count: int) -> list[Message]:
        """The states that came after the first `count` states and are still kept."""
        return _newest(self.states, self.state_count - count)

    def events_since(self, count: int) -> list[dict[str, Any]]:
        """The events that came after the first `count` events and are still kept."""
        return _newest(self.events, self.event_count - count)

    def values(self) -> list[ConfigKey]:
        """The keys that may change in flight, with their present values."""
        return [key for key in keys(self.config) if (key.section, key.name) in changeable_keys()]

    def fence(self) -> dict[str, Any]:
        """The fence and the tilt limit in force, for the drawings."""
        limits, safety = self.config.limits, self.config.safety
        return {
            "radius_m": limits.fence_radius_m,
            "polygon_m": [list(corner) for corner in safety.fence_polygon_m],
            "max_tilt_deg": limits.max_tilt_deg,
        }

    def changed_yaml(self) -> str:
        """The values that differ from those at the start, as YAML."""
        lines = ["# Changed in flight; include this file, or copy its keys."]
        section = ""
        for each in differences(self.start_config, self.config):
            if each.section != section:
                section = each.section
                lines.append(f"{section}:")
            lines.append(f"  {each.key}: {dump_value(each.after)}  # was {dump_value(each.before)}")
        return "\n".join(lines) + "\n"

    def _take_state(self, message: Message) -> None:
        state = {key: value for key, value in message.items() if key != "kind"}
        if self.states and state["time_s"] < self.states[-1]["time_s"]:
            self.states.clear()  # the time begins again with the next flight of `serve`
        self.states.append(state)
        self.state_count += 1
        while state["time_s"] - self.states[0]["time_s"] > SHOWN_S:
            self.states.popleft()

    def _add_event(self, time: float, text: str) -> None:
        self.events.append({"time_s": time, "text": text})
        self.event_count += 1


def _newest(entries: deque[dict[str, Any]], count: int) -> list[dict[str, Any]]:
    """The newest `count` entries, or all if fewer are kept."""
    return list(entries)[max(0, len(entries) - count) :]
