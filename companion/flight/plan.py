"""Plans: which phases a flight runs, in which order."""

from collections.abc import AsyncGenerator
from functools import partial
from typing import Protocol

from companion.config import Config
from companion.config.known_drag import drag_before_connecting
from companion.flight.context import FlightContext
from companion.flight.control_phases import fly_commanded
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.phase import Phase
from companion.flight.phases import (
    HAND_BACK,
    control_phase,
    flight_phases,
    ground_phases,
    opening_phases,
    takeoff_for_client_phases,
    takeover_phases,
)
from companion.guidance import ManeuverSequence
from companion.guidance.source import Source


class Plan(Protocol):
    """Yields the phases one by one; each is requested when the previous one has ended."""

    @property
    def maneuvers(self) -> ManeuverSequence:
        """The maneuvers known before the flight, for the preflight checks."""

    def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """The phases of the flight; requested again when the checks must be repeated."""


class ConfiguredPlan:
    """The plan of `companion fly`: take off, or take over from the pilot; fly the maneuvers; end.

    Attributes:
        drag: drag assumed for the maneuvers.

    Raises:
        ConfigError: a maneuver cannot be flown within the limits and the fence.
    """

    def __init__(self, config: Config) -> None:
        self.drag = drag_before_connecting(config)
        self.maneuvers = configured_maneuvers(config, self.drag)

    async def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """All phases in order; those after the ground phases depend on the autopilot."""
        config = context.config.flight
        for phase in opening_phases(config) if config.take_over else ground_phases(config):
            yield phase
        for phase in flight_phases(config, self.maneuvers.duration, context.link.autopilot):
            yield phase


class TakeoverPlan:
    """Takes over a vehicle that its autopilot holds in the air, flies references, hands it back.

    The program does not arm. If the checks fail, also those before the takeover, the vehicle is
    left as it is. If the takeover or the source fails, the autopilot is asked to hold. If the
    take-off fails in the air, the autopilot is asked to land.

    Args:
        source: source of references; it decides when control ends.
        from_ground: True: the vehicle stands armed, and the autopilot first takes off to
            `flight.takeoff_height_m`.
    """

    def __init__(self, source: Source, *, from_ground: bool = False) -> None:
        self.maneuvers = ManeuverSequence(())
        self._source, self._from_ground = source, from_ground

    async def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """The phases: checks, take-off if needed, takeover, control, and hand-back."""
        config = context.config.flight
        connect, *_ = ground_phases(config)
        yield connect
        first_phases = takeoff_for_client_phases if self._from_ground else takeover_phases
        for phase in first_phases(config):
            yield phase
        work = partial(fly_commanded, commands=self._source)
        yield control_phase("control", f"{self._source.name} to end its control", work)
        yield HAND_BACK
