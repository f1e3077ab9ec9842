"""The actions that a breach causes, and the ways in which a flight can end early."""

from enum import Enum

from companion.user_code import UserCodeError

DISARMED_IN_FLIGHT = "the vehicle disarmed in flight"
"""Reason of the end if somebody else disarmed the vehicle in the air."""

ARMED_UNKNOWN = "no heartbeat from the vehicle, so whether it is armed is not known any more"
"""Reason of the end if no heartbeat tells any more whether the vehicle is armed."""


class Action(Enum):
    """The actions by rising severity; the value is the word used in messages and in YAML.

    LISTEN and RELEASE cannot be configured.
    """

    WARN = "warn"
    """Report the breach once and fly on."""
    HOLD = "hold"
    """Abort the maneuver, brake, and hold where the vehicle has stopped, still in offboard.

    `SafetyLadder` describes what follows the hold.
    """
    HAND_BACK = "hand_back"
    """Command the autopilot to hold, and end offboard control."""
    LAND = "land"
    """Command the autopilot to land, and end offboard control."""
    LISTEN = "listen"
    """Stop sending setpoints; if the vehicle is heard again and still obeys us, command a hold.

    A vehicle that was already commanded to land is commanded to land again."""
    RELEASE = "release"
    """Stop sending setpoints: the pilot or the autopilot's failsafe flies the vehicle."""

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
    LISTEN = (
        "releasing control, and listening: if the vehicle is heard again and nobody else controls "
        "it, it is asked to hold or to land"
    )
    RELEASE = "releasing control: the vehicle is left to its pilot and its autopilot"

    @property
    def sends_setpoints(self) -> bool:
        """Whether setpoints may be sent until the exit is over."""
        return self not in (Exit.LISTEN, Exit.RELEASE)


class StreamEffect(Enum):
    """How a breach that ends control changes the sending of setpoints, before the exit begins."""

    CONTINUES = "continues"
    """Setpoints are sent until the autopilot obeys the exit's command, such as to land."""
    ENDS_WITH_ZERO_RATES = "ends"
    """A setpoint of zero body rates is sent last, because later ones would not arrive in time."""
    STOPS_AT_ONCE = "stops"
    """No more setpoint is sent, because the data for another setpoint cannot be trusted."""


EXIT_OF_ACTION = {
    Action.HAND_BACK: Exit.HOLD,
    Action.LAND: Exit.LAND,
    Action.LISTEN: Exit.LISTEN,
    Action.RELEASE: Exit.RELEASE,
}
"""The exit of each action that ends a flight."""


class FlightEnded(Exception):  # noqa: N818 - it is how every flight that stops early ends
    """Raised to end the flight before the end of its maneuvers.

    Attributes:
        reason: why the flight ended, shown to the user.
        exit: what the flight does with the vehicle; None: the exit of the running phase.
    """

    def __init__(self, reason: str, exit: Exit | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.exit = exit

    @property
    def result(self) -> str:
        """The result of the flight in its summary."""
        return self.reason


class ControlReleased(FlightEnded):
    """The client in control commanded another mode: the usual end under `companion serve`."""

    @property
    def result(self) -> str:
        """The result of the flight in its summary: the flight ended normally."""
        return "ok"


def fault_message(error: Exception, exit_: Exit = Exit.LEAVE) -> str:
    """The message for an unexpected exception: a fault of this program or of user code.

    `exit_`: what the flight does with the vehicle after the exception.
    """
    if not isinstance(error, UserCodeError):
        return f"internal error: {error!r}"
    handed_back = exit_ in (Exit.HOLD, Exit.LAND)
    return f"{error}; the vehicle is handed back" if handed_back else str(error)
