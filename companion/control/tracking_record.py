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
    """Time since it began, s."""
    duration: float | None
    """Its duration, s; None: the source decides when it ends."""
    part: object
    """The maneuver or the source itself."""


def flown_part(flown: FlownSource, now: float) -> FlownPart | None:
    """The maneuver or source that is flown at `now` (s of event-loop time); None: neither is."""
    source, begun_at = flown.source, flown.begun_at
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
        flown: the source that guidance flies.

    Attributes:
        note: called with a message for each maneuver that begins.
    """

    def __init__(self, trace: FlightTrace, flown: FlownSource) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._trace = trace
        self._flown = flown
        self._recorded_part: object = None

    def add(
        self, now: float, vehicle_time: float, reference: Reference, motion: VehicleMotion
    ) -> None:
        """Record one step of guidance.

        Args:
            now: s of event-loop time.
            vehicle_time: the same time on the vehicle's clock, s.
            reference: reference at this time.
            motion: motion of the vehicle at this time.
        """
        flown = flown_part(self._flown, now)
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
