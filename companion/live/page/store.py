"""The data on the live page: newest state, last half minute, events and values."""

from collections import deque
from typing import Any

from companion.config import Config
from companion.config.in_flight import changeable, differences
from companion.config.reference import ConfigKey, keys
from companion.files.bounded_yaml import dump_value
from companion.live.channel import Message

SHOWN_S = 30.0
"""Time shown in the plots, s."""
_MOST_FRAMES, _MOST_EVENTS = 400, 200


class Store:
    """Keeps the messages of the flight.

    Attributes:
        frames: states of the last `SHOWN_S` seconds, oldest first.
        count: number of states so far.
        events: the newest events, newest last, each {"time_s", "text"}.
        event_count: number of events so far.
        config: the configuration after the newest change.
        start: the configuration with which the flight began.
        can_undo: whether a change can be undone.
        over: how the flight ended; None: it has not.

    Args:
        config: configuration of the flight.
    """

    def __init__(self, config: Config) -> None:
        self.frames: deque[Message] = deque(maxlen=_MOST_FRAMES)
        self.count = 0
        self.events: deque[dict[str, Any]] = deque(maxlen=_MOST_EVENTS)
        self.event_count = 0
        self.config = self.start = config
        self.can_undo = False
        self.over: str | None = None

    def take(self, message: Message) -> None:
        """Take one message."""
        match message["kind"]:
            case "status":
                self._take_state(message)
            case "event":
                self._add_event(message["time_s"], message["text"])
            case "phase":
                newest = self.frames[-1]["time_s"] if self.frames else 0.0
                self._add_event(newest, f"phase: {message['name']}")
            case "config":
                self.config = Config.model_validate(message["config"])
                self.can_undo = bool(message["can_undo"])
            case "end":
                self.over = str(message["text"])

    def end(self) -> None:
        """Note the end of the flight, if its message `end` was not received."""
        self.over = self.over or "the program that flew has ended"

    def since(self, count: int) -> list[Message]:
        """The states after the first `count` states, as far as they are kept."""
        new = min(self.count - count, len(self.frames))
        return list(self.frames)[len(self.frames) - new :]

    def events_since(self, count: int) -> list[dict[str, Any]]:
        """The events after the first `count` events, as far as they are kept."""
        new = min(self.event_count - count, len(self.events))
        return list(self.events)[len(self.events) - new :]

    def values(self) -> list[ConfigKey]:
        """The keys that may change in flight, with their present values."""
        return [key for key in keys(self.config) if (key.section, key.name) in changeable()]

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
        for each in differences(self.start, self.config):
            if each.section != section:
                section = each.section
                lines.append(f"{section}:")
            lines.append(f"  {each.key}: {dump_value(each.after)}  # was {dump_value(each.before)}")
        return "\n".join(lines) + "\n"

    def _take_state(self, message: Message) -> None:
        state = {key: value for key, value in message.items() if key != "kind"}
        if self.frames and state["time_s"] < self.frames[-1]["time_s"]:
            self.frames.clear()  # the time begins again with the next flight of `serve`
        self.frames.append(state)
        self.count += 1
        while state["time_s"] - self.frames[0]["time_s"] > SHOWN_S:
            self.frames.popleft()

    def _add_event(self, time: float, text: str) -> None:
        self.events.append({"time_s": time, "text": text})
        self.event_count += 1
