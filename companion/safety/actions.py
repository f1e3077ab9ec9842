"""The actions that a breach leads to, and the exits by which a flight can end early."""

from enum import Enum


class Action(Enum):
    """The actions by rising severity; the value is the word in YAML."""

    WARN = "warn"
    """Report the breach once and fly on."""
    HOLD = "hold"
    """Give up the maneuver and hold here, still in offboard."""
    HAND_BACK = "hand_back"
    """Ask the autopilot to hold, and leave it holding."""
    LAND = "land"
    """Hand back, and ask the autopilot to land."""
    RELEASE = "release"
    """Stop sending: the pilot or the autopilot's failsafe flies the vehicle."""

    @property
    def severity(self) -> int:
        """Rank of the action; 0 is the mildest."""
        return list(Action).index(self)


class Exit(Enum):
    """What the flight does with the vehicle when a phase fails; the value is shown to the user."""

    LEAVE = "leaving the vehicle as it is"
    DISARM = "disarming"
    HOLD = "handing back: asking the autopilot to hold"
    LAND = "handing back: asking the autopilot to land"
    RELEASE = "releasing control: the vehicle is left to its pilot and its autopilot"


EXITS = {
    Action.HAND_BACK: Exit.HOLD,
    Action.LAND: Exit.LAND,
    Action.RELEASE: Exit.RELEASE,
}
"""The exit for each action that ends a flight."""


class FlightEnded(Exception):  # noqa: N818 - it is how every flight that stops early ends
    """Ends the flight before its maneuvers do.

    Attributes:
        reason: shown to the user.
        exit: what the flight does with the vehicle; None: what the running phase says.
    """

    def __init__(self, reason: str, exit: Exit | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.exit = exit


def internal(error: Exception) -> str:
    """The message for an unexpected exception in our own code."""
    return f"internal error: {error!r}"
