"""A campaign as read from its file: the file's content, the base configuration, and the cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.campaign.campaign_file import (
    FAULT,
    FAULT_AFTER,
    FAULT_FACTORS,
    FAULT_PHASE,
    NO_FAULT,
    TRAJECTORY,
    CampaignFile,
    FaultScenario,
)
from companion.campaign.case import Case, Fault
from companion.campaign.design import PlannedCase, number_of_cases, planned_cases
from companion.campaign.keys import with_keys
from companion.campaign.swept import Value, column_value
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.flight.start_checks import require_solver


@dataclass(frozen=True)
class Campaign:
    """A campaign: what to fly, and the files that the flights read."""

    file: CampaignFile
    """Content of the campaign file. Trajectories in `file.sweep` are paths: keys of `files`."""
    base: Config
    """Configuration that the swept keys change; the keys of `set` are already applied. If
    `base.flight.trajectory` is set, it is a key of `files`."""
    files: Mapping[str, str]
    """The text of each file that a flight reads, by its path in the campaign's folder."""
    file_path: str
    """Path of the campaign file, for messages."""

    @property
    def number_of_cases(self) -> int:
        """Number of cases, computed without building them."""
        return number_of_cases(self.file)

    def planned_cases(self) -> Iterator[PlannedCase]:
        """The factor values and seed of every case, in order."""
        return planned_cases(self.file)

    def cases(self) -> Iterator[Case]:
        """Build all cases, in order.

        Raises:
            ConfigError: a configuration is refused; see `case`.
        """
        return map(self.case, self.planned_cases())

    def case(self, planned_case: PlannedCase) -> Case:
        """Build one case.

        Raises:
            ConfigError: the program or the mock vehicle refuses its configuration; the message
                names the case and the key.
            MissingExtraError: CasADi is not installed, and guidance is predictive.
        """
        factors = {name: _stored_value(name, value) for name, value in planned_case.values.items()}
        changes: dict[str, Any] = {}
        for name, value in planned_case.values.items():
            if name not in FAULT_FACTORS:
                for key in self.file.sweep[name].changed_keys(name):
                    changes[key] = self._new_value(name, key, value)
        try:
            config = with_keys(self.base, changes)
            require_solver(config)
            fault = self._fault(planned_case.values)
        except ConfigError as error:
            case = Case(planned_case.index, planned_case.seed, factors, self.base, None, {}, 0.0)
            raise ConfigError(f"{self.file_path}: {case.description()}: {error}") from error
        return Case(
            planned_case.index,
            planned_case.seed,
            factors,
            config.model_copy(update={"mock": {**(config.mock or {}), "seed": planned_case.seed}}),
            fault,
            self._files_of(config),
            self.file.limits.flight_s,
        )

    def _new_value(self, name: str, key: str, value: Any) -> Any:
        """The new value of a key: `value`, or with `times_base` the base value times `value`."""
        if not self.file.sweep[name].times_base or value is None:
            return value
        base_value = self._base_value(key)
        if isinstance(base_value, bool) or not isinstance(base_value, int | float):
            raise ConfigError(
                f"{self.file_path}: sweep.{name}: times_base needs a number in the base "
                f"configuration, and {key} is {base_value!r:.40}"
            )
        return value * base_value

    def _base_value(self, key: str) -> Any:
        """The value of a dotted key in the base configuration; None if there is no such key."""
        value: Any = self.base  # its section `mock` is complete: `with_keys` made it
        for name in key.split("."):
            value = value.get(name) if isinstance(value, dict) else getattr(value, name, None)
        return value

    def _fault(self, values: Mapping[str, Any]) -> Fault | None:
        name = values.get(FAULT, NO_FAULT)
        if name == NO_FAULT:
            return None
        scenario: FaultScenario = self.file.faults[name]
        phase = values.get(FAULT_PHASE, scenario.phase)
        return Fault(
            name,
            scenario.inject,
            phase,
            float(values.get(FAULT_AFTER, scenario.delay(phase))),
            scenario.endings(phase),
        )

    def _files_of(self, config: Config) -> dict[str, str]:
        """The entries of `files` that a flight with this configuration reads."""
        path = config.flight.trajectory
        if path is None or "trajectory" not in config.flight.maneuvers:
            return {}
        folder = f"{path.parent.as_posix()}/"
        return {name: text for name, text in self.files.items() if name.startswith(folder)}


def _stored_value(name: str, value: Any) -> Value:
    """The value of a factor as stored in the results; a trajectory is stored as its folder's name.

    Each trajectory is copied into a folder named after its file: `circle`, then `circle-2`.
    """
    return Path(value).parent.name if name == TRAJECTORY else column_value(value)
