"""Changes of gains, weights and limits in flight: they are checked, slewed, undone and recorded."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from companion.config import Config
from companion.config.in_flight import Difference, Values, changed_in_flight, differences
from companion.config.known_drag import KnownDrag
from companion.control.retuning import Retuning, Slew, loop_settings, reason_against_changes
from companion.files.yaml_file import ConfigError
from companion.flight.change_bounds import require_moderate_change
from companion.recording.recorder import FlightRecorder
from companion.safety.actions import fault_message

_MAX_UNDO_COUNT = 200
"""Number of changes that can be undone; older ones stay in force."""


class ChangeRefusedError(Exception):
    """A change was refused; the message is a sentence for the user."""


class Change(NamedTuple):
    """One change of values in flight."""

    time: float
    """Time when the change began, s of event-loop time."""
    by: str
    """Who made the change, such as "the live page"."""
    keys: tuple[Difference, ...]
    """Changed keys, with the values before and after."""

    def __str__(self) -> str:
        return f"changed by {self.by}: {', '.join(map(str, self.keys))}"

    def as_dict(self, flight_began: float) -> dict[str, Any]:
        """The change for JSON; its time counts from `flight_began`, s of event-loop time."""
        keys = {each.name: [each.before, each.after] for each in self.keys}
        return {"time_s": round(self.time - flight_began, 3), "by": self.by, "keys": keys}


class Changes:
    """Changes the values of a configuration in flight: checks, slews, undoes and records them.

    A change must pass the checks that the configuration passed at the start. A change takes effect
    in small steps, between attitude samples. Monitors, fence and deadman keep their limits.

    Attributes:
        start_config: the configuration before the first change; changes may precede the flight.
        wanted_config: the configuration after the newest change.
        all_changes: all changes, in order.
        config_at_flight_start: the configuration when the flight began; the flight's record
            contains it.
        note: called with each change in words; a flight replaces it while it runs.
        on_change: called with `wanted_config` after each change.
        on_known_drag: called with the known drag of the vehicle, once its hardware id was read;
            some checks of a change need the drag.
    """

    def __init__(self, start_config: Config) -> None:
        self.wanted_config = start_config
        self.all_changes: list[Change] = []
        self.config_at_flight_start = start_config
        self.note: Callable[[str], None] = lambda _: None
        self.on_change: Callable[[Config], None] = lambda _: None
        self.on_known_drag: Callable[[KnownDrag], None] = lambda _: None
        self.start_config = start_config
        self._slew = Slew(start_config)
        self._earlier_configs: list[Config] = []
        self._count_before_flight = 0
        self._retuning: Retuning | None = None
        self._reason_to_refuse: Callable[[Config, Config], str | None] = _refuse_nothing
        self._recorder: FlightRecorder | None = None

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return bool(self._earlier_configs)

    @property
    def changes_in_flight(self) -> tuple[Change, ...]:
        """The changes since the flight began, in order."""
        return tuple(self.all_changes[self._count_before_flight :])

    def begin_flight(self) -> Config:
        """Begin a flight; return the configuration at its start, for its record."""
        self.config_at_flight_start = self.wanted_config
        self._count_before_flight = len(self.all_changes)
        return self.config_at_flight_start

    def change(self, values: Values, by: str) -> str:
        """Begin to change to `values`; return the change in words.

        If another change is still under way, both together must not be too large.

        Raises:
            ChangeRefusedError: a key must not change in flight, a value is not valid, or the change
                is too large. Nothing is changed.
        """
        try:
            wanted = changed_in_flight(self.start_config, self.wanted_config, values, by)
            require_moderate_change(self._slew.settled_config, wanted, by)
            require_moderate_change(self.wanted_config, wanted, by)
        except ConfigError as error:
            raise ChangeRefusedError(str(error)) from error
        except (ValueError, ArithmeticError) as error:
            raise ChangeRefusedError(f"{by}: {error}; nothing has changed") from error
        before = self.wanted_config
        text = self._begin_change(wanted, by)
        self._earlier_configs = [*self._earlier_configs, before][-_MAX_UNDO_COUNT:]
        self.on_change(wanted)
        return text

    def undo(self, by: str) -> str:
        """Begin to return to the values before the newest change; return the change in words.

        Raises:
            ChangeRefusedError: there is nothing to undo, or the change is refused.
        """
        if not self._earlier_configs:
            raise ChangeRefusedError(f"{by}: there is no change to undo")
        text = self._begin_change(self._earlier_configs[-1], by)
        self._earlier_configs.pop()
        self.on_change(self.wanted_config)
        return text

    @contextmanager
    def checked_by(
        self, reason_to_refuse: Callable[[Config, Config], str | None]
    ) -> Iterator[None]:
        """Let `reason_to_refuse` decide on each change and each undo while the `with` block runs.

        Args:
            reason_to_refuse: called with the present configuration and the wanted one; returns why
                the change is refused, as a sentence, or None.
        """
        self._reason_to_refuse = reason_to_refuse
        try:
            yield
        finally:
            self._reason_to_refuse = _refuse_nothing

    @contextmanager
    def applying(
        self, retuning: Retuning, note: Callable[[str], None], recorder: FlightRecorder | None
    ) -> Iterator[None]:
        """Apply changes to the loops while the `with` block runs; apply earlier changes at once.

        Args:
            retuning: applies values to the control loop and to guidance.
            note: shows a change to the user, and records it in words.
            recorder: records the values for a replay, or None.
        """
        self._retuning, self._recorder = retuning, recorder
        if self.wanted_config is not self.start_config:
            self._slew.jump(self.wanted_config)
            retuning.apply(loop_settings(self.wanted_config))
        if self.wanted_config is not self.config_at_flight_start:
            self._record_change(self.config_at_flight_start, at_once=True)
        note_before, self.note = self.note, note
        try:
            with retuning.before_each_step(self.step):
                yield
        finally:
            self._retuning = self._recorder = None
            self._slew.jump(self.wanted_config)
            self.note = note_before

    def step(self, now: float) -> None:
        """Continue a change that is under way; the guidance loop calls this at each step."""
        if self._retuning is None:
            return
        try:
            values = self._slew.step(now)
            if values is not None:
                self._retuning.apply(values)
        except Exception as error:  # the flight goes on with the values it has
            self._slew.stop()
            self.note(fault_message(error))

    def _begin_change(self, wanted: Config, by: str) -> str:
        """Begin to move from the present values to `wanted`.

        Raises:
            ChangeRefusedError: nothing can change in this flight, or the values are equal.
        """
        why_fixed = reason_against_changes(self.start_config)
        if why_fixed is not None:
            raise ChangeRefusedError(f"{by}: {why_fixed}; nothing has changed")
        keys = tuple(differences(self.wanted_config, wanted))
        if not keys:
            raise ChangeRefusedError(
                f"{by}: these are the present values already; nothing has changed"
            )
        refusal = self._reason_to_refuse(self.wanted_config, wanted)
        if refusal is not None:
            raise ChangeRefusedError(f"{by}: {refusal}; nothing has changed")
        try:
            loop_settings(wanted)
        except (ValueError, ArithmeticError) as error:
            raise ChangeRefusedError(f"{by}: {error}; nothing has changed") from error
        now, before = asyncio.get_running_loop().time(), self.wanted_config
        self.wanted_config = wanted
        if self._retuning is None:
            self._slew.jump(wanted)
        else:
            self._slew.begin(wanted, now)
            self._record_change(before, at_once=False)
        change = Change(now, by, keys)
        self.all_changes.append(change)
        self.note(str(change))
        return str(change)

    def _record_change(self, before: Config, *, at_once: bool) -> None:
        """Record for a replay the values in which `wanted_config` differs from `before`."""
        if self._recorder is not None:
            values: dict[str, dict[str, Any]] = {}
            for each in differences(before, self.wanted_config):
                values.setdefault(each.section, {})[each.key] = each.after
            self._recorder.change(values, at_once=at_once)


def _refuse_nothing(_before: Config, _after: Config) -> str | None:
    return None
