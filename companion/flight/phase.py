"""One phase of a flight: its work, its timeout, and what its failure leads to."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from companion.flight.context import FlightContext
from companion.safety.actions import Exit
from companion.vehicle.autopilot import Role

Work = Callable[[FlightContext], Coroutine[Any, Any, None]]


@dataclass(frozen=True, slots=True)
class Phase:
    """One phase of a flight."""

    name: str
    """Name, shown to the user."""
    waits_for: str
    """The condition that ends the phase, shown to the user."""
    work: Work
    timeout: float
    """Time after which the phase has failed, s; may be infinite."""
    on_failure: Exit = Exit.LEAVE
    """What the flight does with the vehicle if the phase fails."""
    on_failure_on_ground: Exit | None = None
    """Like `on_failure`, while the vehicle stands on the ground; None: `on_failure`."""
    on_failure_untaken: Exit | None = None
    """Like `on_failure`, before the takeover is commanded; None: `on_failure`."""
    allowed_roles: frozenset[Role] = frozenset()
    """Roles of the allowed modes; any other or unknown mode counts as a takeover by the pilot.
    Empty: any mode is allowed."""
    monitored: bool = False
    """Whether the safety monitors may end the phase. The phases of an exit are not monitored: the
    breach that caused the exit would end them, too."""
    lands: bool = False
    """Whether the vehicle lands in the phase. If it is disarmed and falls, the phase has failed."""

    def exit_on_failure(self, *, standing: bool, taken: bool) -> Exit:
        """What the flight does if the phase fails.

        `standing`: the vehicle stands on the ground. `taken`: its takeover was commanded.
        """
        if self.on_failure_on_ground is not None and standing:
            return self.on_failure_on_ground
        if self.on_failure_untaken is not None and not taken:
            return self.on_failure_untaken
        return self.on_failure
