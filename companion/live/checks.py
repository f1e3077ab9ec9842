"""The checks of a change that take long: made in the helper process, before the flight's own."""

from typing import Any

from companion.config import Config
from companion.config.in_flight import Values, changed_in_flight
from companion.flight.maneuvers import configured_maneuvers


class ChangeChecks:
    """Knows the configuration of the flight, and checks what somebody wants to change.

    Attributes:
        start: the configuration with which the flight began.
        now: the configuration after the newest change.

    Args:
        start: see above.
        follows: whether the flight flies the maneuvers of its configuration.
    """

    def __init__(self, start: Config, *, follows: bool) -> None:
        self.start = self.now = start
        self._follows = follows

    @staticmethod
    def of(message: dict[str, Any]) -> "ChangeChecks":
        """From the first message of the flight."""
        start = Config.model_validate(message["config"])
        return ChangeChecks(start, follows=bool(message["follows"]))

    def note(self, message: dict[str, Any]) -> None:
        """Take the message that the configuration has changed."""
        self.now = Config.model_validate(message["config"])

    def check(self, values: Values, name: str) -> None:
        """Check new values as the configuration was checked at the start.

        Raises:
            ConfigError: a key must not change in flight, a value is not valid, or the maneuvers
                cannot be flown with them.
        """
        wanted = changed_in_flight(self.start, self.now, values, name)
        if self._follows:
            configured_maneuvers(wanted)
