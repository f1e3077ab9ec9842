"""Records reference and position at each guidance step, and which maneuver or source is flown."""

from collections.abc import Callable
from math import nan
from typing import NamedTuple

from companion.control.flown_source import FlownSource
from companion.guidance.reference import Reference, VehicleMotion
from companion.guidance.source import ManeuverSource
from companion.recording.trace import FlightTrace


class FlownPart(NamedTuple):
    """The maneuver that is flown now, or the source that another program commands."""

    name: str
    """Name to show to the user."""
    elapsed: float
    """Time since the maneuver or source began, s."""
    duration: float | None
    """Duration of the maneuver, s; None: a source, which decides itself when it ends."""
    part: object
    """The maneuver or the source itself."""


def flown_part(flown_source: FlownSource, now: float) -> FlownPart | None:
    """The maneuver or source that is flown at `now` (s of event-loop time); None: neither is."""
    source, begun_at = flown_source.source, flown_source.begun_at
    if source is None or begun_at is None or source.finished(now):
        return None
    if not isinstance(source, ManeuverSource):
        return FlownPart(source.name, now - begun_at, None, source)
    maneuver, elapsed = source.maneuvers.part_at(now - begun_at)
    return FlownPart(maneuver.name, elapsed, maneuver.duration, maneuver)


class TrackingRecord:
    """Writes reference, position, and the beginning of each maneuver to the trace.

    Args:
        trace: the trace of the flight.
        flown_source: the source that guidance flies.

    Attributes:
        note: called with a message for each maneuver that begins.
    """

    def __init__(self, trace: FlightTrace, flown_source: FlownSource) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._trace = trace
        self._flown_source = flown_source
        self._recorded_part: object = None

    def add(
        self, now: float, vehicle_time: float, reference: Reference, motion: VehicleMotion
    ) -> None:
        """Record one step of guidance.

        Args:
            now: event-loop time, s.
            vehicle_time: the same time on the vehicle's clock, s.
            reference: reference at this time.
            motion: motion of the vehicle at this time.
        """
        flown = flown_part(self._flown_source, now)
        part = None if flown is None else flown.part
        if part is not self._recorded_part:
            self._recorded_part = part
            name = None if flown is None else flown.name
            self._trace.begin_maneuver(now, vehicle_time, name)
            if name is not None:
                self.note(f"maneuver: {name}")
        north, east, down = reference.position_ned
        if not reference.holds_position:
            north = east = nan  # only the height is a reference
        if not reference.holds_height:
            down = nan
        self._trace.add_tracking(vehicle_time, (north, east, down), motion.position_ned)
