"""Plans: which phases a flight runs, in which order."""

from collections.abc import AsyncGenerator
from typing import Protocol

from companion.config import Config
from companion.flight.context import FlightContext
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.phases import Phase, flight_phases, ground_phases
from companion.guidance import ManeuverSequence


class Plan(Protocol):
    """Tells the phases one by one; each is asked for when the one before has ended."""

    @property
    def maneuvers(self) -> ManeuverSequence:
        """The maneuvers known before the flight; the preflight checks judge them."""
        ...

    def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """The phases of the flight; asked for again when the checks must be repeated."""
        ...


class ConfiguredPlan:
    """From the ground through `flight.maneuvers` and back.

    Args:
        config: of the flight.

    Raises:
        ConfigError: a maneuver cannot be flown within the limits and the fence.
    """

    def __init__(self, config: Config) -> None:
        self.maneuvers = configured_maneuvers(config)

    async def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """All phases in order; those after the ground phases depend on the autopilot."""
        for phase in ground_phases(context.config.flight):
            yield phase
        for phase in flight_phases(
            context.config.flight, self.maneuvers.duration, context.link.autopilot
        ):
            yield phase
