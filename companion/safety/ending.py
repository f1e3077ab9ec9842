"""How a flight can end before its maneuver does, and what is then done with the vehicle."""

from enum import Enum


class Exit(Enum):
    """What we do with the vehicle when a phase fails; the value is how it is said."""

    LEAVE = "leaving the vehicle as it is"
    DISARM = "disarming"
    HOLD = "handing back: asking the autopilot to hold"
    LAND = "handing back: asking the autopilot to land"
    RELEASE = "letting go: the vehicle is left to its pilot and its autopilot"


class FlightEnded(Exception):  # noqa: N818 - it is how every flight that stops early ends
    """The flight ends here.

    Attributes:
        reason: what the user is told.
        exit: what is done with the vehicle; None leaves it to the phase.
    """

    def __init__(self, reason: str, exit: Exit | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.exit = exit


def internal(error: Exception) -> str:
    """A fault of ours, in words."""
    return f"internal error: {error!r}"
