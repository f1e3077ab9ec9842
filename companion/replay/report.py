"""The result of a replay, as sentences and as a table."""

import csv
from collections import Counter
from collections.abc import Sequence
from math import degrees
from pathlib import Path

import numpy as np

from companion.replay.replay import ReplayedSample

_COLUMNS = (
    "received_s",
    "vehicle_time_s",
    *(
        f"{which}_{name}"
        for which in ("recorded", "replayed")
        for name in ("roll_rad_s", "pitch_rad_s", "yaw_rad_s", "thrust", "reason")
    ),
)


def result_lines(
    samples: Sequence[ReplayedSample], start_time: float, *, follows_record: bool
) -> list[str]:
    """Sentences on what is equal and what differs between flight and replay.

    The flight began at the time `start_time` on our clock, s. `follows_record`: see `Replay`.
    """
    recorded_count = sum(each.recorded_setpoint is not None for each in samples)
    differing = [each for each in samples if not each.is_same]
    lines = []
    if follows_record:
        lines.append(
            "Only the control loop is replayed, with the recorded commands of guidance, because"
            " another program or predictive control commanded the flight."
        )
    if not differing:
        lines.append(
            f"identical: all {recorded_count} setpoints are equal to the bit, and all"
            f" {len(samples) - recorded_count} unanswered samples have the same reasons"
        )
        return lines
    lines.append(
        f"The answers to {len(differing)} of {len(samples)} samples differ from those in the"
        f" flight, the first {differing[0].received - start_time:.2f} s after the flight began."
    )
    both_answered = [
        each for each in differing if each.recorded_setpoint and each.replayed_setpoint
    ]
    if both_answered:
        lines.append(_largest_differences(both_answered, start_time))
    return lines + _reason_changes(differing)


def _largest_differences(both_answered: Sequence[ReplayedSample], start_time: float) -> str:
    setpoints = np.array(  # (N, 2, 4)
        [
            [
                (*each.rates, each.thrust)
                for each in (sample.recorded_setpoint, sample.replayed_setpoint)
                if each
            ]
            for sample in both_answered
        ]
    )
    absolute_differences = np.abs(setpoints[:, 1] - setpoints[:, 0])
    differences = []
    for index, name in enumerate(("roll", "pitch", "yaw", "thrust")):
        worst_index = int(absolute_differences[:, index].argmax())
        value = absolute_differences[worst_index, index]
        value_text = f"{value:.4f}" if name == "thrust" else f"{degrees(value):.2f} °/s"
        differences.append(
            f"{name} {value_text} at {both_answered[worst_index].received - start_time:.2f} s"
        )
    return f"{len(both_answered)} setpoints differ, at most by: {', '.join(differences)}."


def _reason_changes(differing: Sequence[ReplayedSample]) -> list[str]:
    """Sentences on samples for which flight and replay differ in more than the setpoint's values.

    Only the flight or only the replay sent a setpoint for the sample, or neither sent one, for
    different reasons.
    """
    changes = Counter(
        (each.recorded_reason, each.replayed_reason)
        for each in differing
        if each.recorded_reason != each.replayed_reason
    )
    return [
        f"{count} samples: {recorded_reason.replace('_', ' ')} in the flight,"
        f" {replayed_reason.replace('_', ' ')} in the replay."
        for (recorded_reason, replayed_reason), count in changes.most_common()
    ]


def write_csv(samples: Sequence[ReplayedSample], path: Path) -> None:
    """Write the setpoints of flight and replay for each sample; an empty field: nothing was sent.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("w", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for each in samples:
            recorded, replayed = (
                [""] * 4 if setpoint is None else [*setpoint.rates, setpoint.thrust]
                for setpoint in (each.recorded_setpoint, each.replayed_setpoint)
            )
            times = each.received, each.vehicle_time
            writer.writerow(
                (*times, *recorded, each.recorded_reason, *replayed, each.replayed_reason)
            )
