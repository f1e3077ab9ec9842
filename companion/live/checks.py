"""The checks of a change that take long: made in the helper process, before the flight's own."""

from typing import Any

from companion.config import Config
from companion.config.in_flight import Values, changed_in_flight
from companion.control.retuning import fixed_because
from companion.files.yaml_file import ConfigError
from companion.flight.change_bounds import require_moderate
from companion.flight.maneuvers import configured_maneuvers, require_still_flyable
from companion.guidance import ManeuverSequence
from companion.tuning import stability

_LEAST_GAIN_DB, _LEAST_PHASE_DEG = 4.0, 20.0
"""Margins that a change must keep; a loop that began with less must keep what it had."""
_ROUNDING = 1e-3
"""Relative error of computed margins that is ignored."""


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
        self._flown: ManeuverSequence | None = None
        self._unknown: ConfigError | None = None
        try:
            self._flown = configured_maneuvers(start) if follows else None
        except ConfigError as error:  # a file has changed since the flight read it
            self._unknown = error

    @staticmethod
    def of(message: dict[str, Any]) -> "ChangeChecks":
        """From the first message of the flight."""
        start = Config.model_validate(message["config"])
        return ChangeChecks(start, follows=bool(message["follows"]))

    def note(self, message: dict[str, Any]) -> None:
        """Take the message that the configuration has changed."""
        self.now = Config.model_validate(message["config"])

    def check(self, values: Values, name: str) -> None:
        """Check new values: the rules between keys, their size, stability, and the maneuvers.

        Raises:
            ConfigError: a key must not change in flight, a value is not valid, the change is too
                large, the control loop would lose its margins, or the maneuvers cannot be flown.
        """
        wanted = changed_in_flight(self.start, self.now, values, name)
        fixed = fixed_because(self.start)
        if fixed is not None:
            raise ConfigError(f"{name}: {fixed}")
        try:
            require_moderate(self.now, wanted, name)
            _require_margins(self.start, wanted, name)
        except (ValueError, ArithmeticError) as error:
            raise ConfigError(f"{name}: {error}") from error
        if self._unknown is not None:
            raise ConfigError(
                f"{name}: the maneuvers of this flight are not known: {self._unknown}"
            )
        if self._flown is not None:
            require_still_flyable(wanted, self._flown)


def _require_margins(start: Config, wanted: Config, name: str) -> None:
    """Check the stability margins of the control loop, computed for the believed vehicle.

    Raises:
        ConfigError: the loop is unstable, or has less margin than it needs.
    """
    before, after = stability(start), stability(wanted)
    if not after.stable:
        raise ConfigError(f"{name}: with these values the control loop is unstable")
    gain_db = min(_LEAST_GAIN_DB, before.gain_db) if before.stable else _LEAST_GAIN_DB
    phase_deg = min(_LEAST_PHASE_DEG, before.phase_deg) if before.stable else _LEAST_PHASE_DEG
    kept = 1.0 - _ROUNDING
    if not (after.gain_db >= kept * gain_db and after.phase_deg >= kept * phase_deg):
        raise ConfigError(
            f"{name}: with these values the control loop keeps margins of {after.sentence()} only; "
            f"a change in flight must keep {gain_db:.1f} dB and {phase_deg:.0f}°"
        )
