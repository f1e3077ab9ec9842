"""The slow checks of a requested change of configuration values, before the flight's own checks.

The helper process runs these checks, so that they do not delay the flight.
"""

from pathlib import Path
from typing import Any

from companion.config import Config
from companion.config.in_flight import Values, changed_in_flight
from companion.config.known_drag import KnownDrag, drag_before_connecting
from companion.control.retuning import reason_against_changes
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.flight.change_bounds import require_moderate_change
from companion.flight.maneuver_checks import require_still_flyable
from companion.flight.maneuvers import configured_maneuvers
from companion.guidance import ManeuverSequence
from companion.tuning import stability

_LEAST_GAIN_MARGIN_DB, _LEAST_PHASE_MARGIN_DEG = 4.0, 20.0
"""Smallest gain margin, dB, and phase margin, degrees, that a change may leave. If a margin was
smaller when the flight began, the limit is that margin."""
_ROUNDING = 1e-3
"""Relative error of computed margins that is ignored."""


class ChangeChecks:
    """Checks requested changes of values against the configuration of the flight.

    Attributes:
        start_config: the configuration with which the flight began.
        current_config: the configuration after the newest change.
    """

    def __init__(self, start_config: Config, *, flies_maneuvers: bool) -> None:
        self.start_config = self.current_config = start_config
        self._drag = drag_before_connecting(start_config)
        self._maneuvers: ManeuverSequence | None = None
        self._maneuvers_error: ConfigError | None = None
        try:
            if flies_maneuvers:
                self._maneuvers = configured_maneuvers(start_config, self._drag)
        except ConfigError as error:  # a file has changed since the flight read it
            self._maneuvers_error = error

    def note_drag(self, message: dict[str, Any]) -> None:
        """Note the drag of this vehicle, from a message of the flight.

        Until this message comes, the drag of the vehicle flown last is assumed.
        """
        drag, source = message["drag"], message["source"]
        self._drag = KnownDrag(
            None if drag is None else Drag(*drag), None if source is None else Path(source)
        )

    def check(self, values: Values, name: str) -> None:
        """Check new values: types and ranges, size of the change, stability margins, maneuvers.

        Args:
            values: the new values, by section and key.
            name: who or what requests them, such as the edited file; error messages name it.

        Raises:
            ConfigError: a check fails, a key must not change in flight, no key may change with
                the planner or guidance of this flight, or the maneuvers of this flight could not
                be loaded.
        """
        wanted = changed_in_flight(self.start_config, self.current_config, values, name)
        reason = reason_against_changes(self.start_config)
        if reason is not None:
            raise ConfigError(f"{name}: {reason}")
        try:
            require_moderate_change(self.current_config, wanted, name)
            _require_margins(self.start_config, wanted, name)
        except (ValueError, ArithmeticError) as error:
            raise ConfigError(f"{name}: {error}") from error
        if self._maneuvers_error is not None:
            raise ConfigError(
                f"{name}: the maneuvers of this flight could not be loaded: {self._maneuvers_error}"
            )
        if self._maneuvers is not None:
            require_still_flyable(wanted, self._maneuvers, self._drag)


def _require_margins(start: Config, wanted: Config, name: str) -> None:
    """Check the stability margins of the control loop with the `wanted` configuration."""
    before, after = stability(start), stability(wanted)
    if not after.stable:
        raise ConfigError(f"{name}: with these values the control loop is unstable")
    gain_db = min(_LEAST_GAIN_MARGIN_DB, before.gain_db) if before.stable else _LEAST_GAIN_MARGIN_DB
    phase_deg = (
        min(_LEAST_PHASE_MARGIN_DEG, before.phase_deg) if before.stable else _LEAST_PHASE_MARGIN_DEG
    )
    tolerance = 1.0 - _ROUNDING
    if not (after.gain_db >= tolerance * gain_db and after.phase_deg >= tolerance * phase_deg):
        raise ConfigError(
            f"{name}: with these values the control loop would have margins of only "
            f"{after.sentence()}; a change in flight must leave at least {gain_db:.1f} dB and "
            f"{phase_deg:.0f}°"
        )
