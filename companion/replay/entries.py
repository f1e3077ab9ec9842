"""Reads the recorded inputs of the control loop and the guidance loop, in order.

The inputs are samples, guidance steps, actions of phases, changes of configuration values in
flight, and the autopilot's ATTITUDE_TARGET.
"""

from collections import deque
from collections.abc import Iterator
from math import nan
from typing import Any

from companion.recording.flight_record import FlightRecord, record_errors
from companion.recording.mcap_file.fields import Channel
from companion.recording.mcap_file.flight_events import ValuesChange
from companion.recording.mcap_file.loop_channels import (
    ACTION,
    ATTITUDE_TARGET,
    GUIDANCE,
    INPUT,
    SAMPLE,
    SETPOINT,
    TARGET,
)
from companion.replay.recorded import (
    RecordedAction,
    RecordedSample,
    RecordedStep,
    Row,
    attitude_target,
    recorded_action,
    recorded_sample,
    recorded_step,
)
from companion.vehicle.records import AttitudeTarget

RecordedInput = RecordedSample | RecordedStep | RecordedAction | ValuesChange | AttitudeTarget
"""An input of the loops, with the output that the flight computed from it."""


def recorded_inputs(record: FlightRecord) -> Iterator[RecordedInput]:
    """All inputs of a flight, in the order in which the program took them.

    Raises:
        RecordError: a recorded input is not valid.
    """
    with record_errors(record.folder):
        messages = _Messages(record)
        while (topic := messages.next_topic()) is not None:
            if topic == SAMPLE.topic:
                row = messages.take(SAMPLE)
                answered = row["unanswered"] == 0
                if answered and messages.next_topic() is None:
                    return  # the record was cut off between the sample and its setpoint
                yield recorded_sample(row, messages.take(SETPOINT) if answered else None)
            elif topic == INPUT.topic:
                row = messages.take(INPUT)
                target = messages.take(TARGET) if messages.next_topic() == TARGET.topic else None
                guidance = (
                    messages.take(GUIDANCE) if messages.next_topic() == GUIDANCE.topic else None
                )
                yield recorded_step(row, target, guidance)
            elif topic == ACTION.topic:
                yield recorded_action(messages.take(ACTION))
            elif topic == ATTITUDE_TARGET.topic:
                yield attitude_target(messages.take(ATTITUDE_TARGET))
            elif topic == _CHANGE_TOPIC:
                yield messages.take_next()
            else:  # an output; the sample or the step before it was not recorded
                messages.take_next()


_CHANGE_TOPIC = "/change"
_CHANNELS = (SAMPLE, SETPOINT, INPUT, TARGET, GUIDANCE, ACTION, ATTITUDE_TARGET)


class _Messages:
    """Reads messages of the replayed channels, and changes of values, in the order of the file."""

    def __init__(self, record: FlightRecord) -> None:
        self._rows: dict[str, Iterator[Any]] = {_CHANGE_TOPIC: iter(record.changes)}
        for each in _CHANNELS:
            self._rows[each.topic] = iter(record.rows(each.name).tolist())
        self._topic_order = deque(
            topic for topic in record.content.topic_order if topic in self._rows
        )

    def next_topic(self) -> str | None:
        """Topic of the next message; None at the end."""
        return self._topic_order[0] if self._topic_order else None

    def take_next(self) -> Any:
        """Take the next message: the values of its columns, or a change."""
        return next(self._rows[self._topic_order.popleft()])

    def take(self, channel: Channel) -> Row:
        """Take the next message if it is of `channel`; else take none and return NaN values."""
        if self.next_topic() != channel.topic:
            return dict.fromkeys(channel.columns, nan)
        return dict(zip(channel.columns, self.take_next(), strict=True))
