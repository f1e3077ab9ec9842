"""Checks of our configuration, and of its dead times against those of earlier flights."""

import json
from collections.abc import Iterator
from math import isfinite
from pathlib import Path

from companion.attitude.planner import FIRST_ORDER
from companion.config import Config
from companion.config.guidance import AUTO
from companion.config.suspect_values import suspect_values
from companion.preflight.evidence import Evidence
from companion.preflight.finding import INEFFECTIVE, SAFE, UNSAFE, Finding, Key
from companion.recording.measurements.dead_time import AxisDeadTime, DeadTimes
from companion.vehicle.registry import AUTOPILOTS


def planner(config: Config, _: Evidence) -> Iterator[Finding]:
    """Whether `planner.name: auto` chose first-order, because `vehicle` lacks lag and dead time."""
    name = config.planner_name
    if config.planner.name == AUTO and name == FIRST_ORDER:
        yield Finding(
            Key.PLANNER,
            INEFFECTIVE,
            f"planner.name: auto chose {name}, because `vehicle` gives no lag and dead time",
            "acceleration overshoots, and steps leave their straight line",
            "run `companion identify`, and include what it writes",
            "companion study lag",
        )
    else:
        yield Finding(Key.PLANNER, SAFE, f"{name} is flown", source="planner.name")


def dead_time(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Compare the configured dead times with those of this vehicle's newest flight.

    Only flights with the same planner and gain count. With another gain the vehicle responds
    differently, and an oscillating position hold gives a wrong dead time.
    """
    if not config.vehicle.response_known:
        return
    folder, measured_dead_times = _newest_dead_times(config, evidence.identity.uid)
    if folder is None:
        yield Finding(
            Key.DEAD_TIME,
            SAFE,
            "the dead time with this planner and gain was not measured yet by any flight of this "
            f"vehicle in {config.recording.directory}",
            fix="fly: every flight measures the dead time, and reports it at its end",
            source="summary.json",
        )
        return
    configured_dead_times = {name: axis.dead_time for name, axis in config.vehicle.axes.items()}
    axes = {
        name: AxisDeadTime(measured_dead_times.get(name), value)
        for name, value in configured_dead_times.items()
    }
    warning = DeadTimes(axes).warning()
    if warning is None:
        fact = f"in {folder.name} the dead time was as configured"
        yield Finding(Key.DEAD_TIME, SAFE, fact, source=str(folder))
        return
    fact, _semicolon, fix = warning.partition("; ")
    yield Finding(
        Key.DEAD_TIME,
        INEFFECTIVE,
        f"in {folder.name} the {fact}",
        "the planner predicts the wrong attitude",
        fix,
        str(folder),
    )


def doubtful_values(config: Config, _: Evidence) -> Iterator[Finding]:
    """Values that are probably a mistake, or not measured on this vehicle."""
    for value in suspect_values(config):
        key = value.key if value.key in frozenset(Key) else Key.UNITS
        yield Finding(key, INEFFECTIVE, value.description, value.consequence, value.fix, value.key)


def identified_autopilot(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the response in `vehicle` was identified on a vehicle with this autopilot."""
    identified_on, connected_autopilot = config.vehicle.autopilot, evidence.autopilot.name
    if identified_on is not None and identified_on != connected_autopilot:
        yield Finding(
            Key.IDENTIFIED_ON,
            INEFFECTIVE,
            f"`vehicle` was identified on {identified_on}, and this vehicle flies "
            f"{connected_autopilot}",
            "the planner predicts another vehicle's response: steps bend, and the hold may swing",
            "run `companion identify` on this vehicle, and include the file that it writes",
            "vehicle.autopilot",
        )


def tilt_compensation(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the autopilot can divide thrust by cos(tilt), if the configuration says it does."""
    autopilot = evidence.autopilot
    if config.thrust.autopilot_compensates_tilt and not autopilot.can_compensate_tilt:
        yield Finding(
            Key.TILT_COMPENSATION,
            UNSAFE,
            f"thrust.autopilot_compensates_tilt is true, but {autopilot.name} does not divide "
            "thrust by cos(tilt)",
            "the vehicle sinks when it tilts",
            "set thrust.autopilot_compensates_tilt to false",
            "thrust.autopilot_compensates_tilt",
        )


def unknown_accept_entries(config: Config, _: Evidence) -> Iterator[Finding]:
    """Whether each entry of `flight.accept` names a check that exists."""
    stream_keys = {
        f"{Key.STREAMS}.{name}" for autopilot in AUTOPILOTS for name in autopilot.wanted_rates
    }
    limit_keys = {"link.min_attitude_rate_hz", "link.min_position_rate_hz"}
    parameter_names = {rule.name for autopilot in AUTOPILOTS for rule in autopilot.parameters}
    for name in config.flight.accept:
        if name not in {*Key, *stream_keys, *limit_keys, *parameter_names}:
            yield Finding(
                Key.ACCEPT,
                INEFFECTIVE,
                f"flight.accept names {name!r}, but no check has that name",
                "this entry has no effect",
                "use a name that `companion doctor --json` prints, or remove it",
                "flight.accept",
            )


def _newest_dead_times(config: Config, uid: str | None) -> tuple[Path | None, dict[str, float]]:
    """Folder of the newest comparable flight, and the dead times in s that it measured, by axis.

    A flight is comparable if vehicle (hardware id), planner and gain are the same; all vehicles
    without an id count as the same. None and no dead times: there is no comparable flight.
    """
    comparable_flight = uid, config.planner_name, config.planner.gain_per_s
    for summary in sorted(config.recording.directory.glob("*/summary.json"), reverse=True):
        try:
            flight_summary = json.loads(summary.read_text(encoding="utf-8"))
            if (
                flight_summary.get("vehicle_uid"),
                flight_summary["planner"],
                flight_summary["gain_per_s"],
            ) != comparable_flight:
                continue
            axes = {name: flight_summary["dead_time_s"][name] for name in ("roll", "pitch", "yaw")}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue  # written by another program, or cut off
        dead_times = {
            name: float(value)
            for name, value in axes.items()
            if isinstance(value, int | float) and isfinite(value)
        }
        if dead_times:
            return summary.parent, dead_times
    return None, {}
