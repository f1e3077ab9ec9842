"""One case of a campaign: its factors, the resulting configuration, and its fault."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from companion.campaign.swept import Value
from companion.config import Config


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault scenario of one flight."""

    name: str
    inject: tuple[Mapping[str, Any], ...]
    """Entries as in `mock.faults`."""
    phase: str
    """Phase of the flight in which the faults begin."""
    after_s: float
    """Time from the beginning of the phase to the faults, s."""
    ends: tuple[str, ...]
    """Permitted endings; see `FaultScenario.ends`."""


@dataclass(frozen=True, slots=True)
class Case:
    """One case, ready to be flown in any process on any computer."""

    index: int
    """Number in the campaign, from 0."""
    seed: int
    """Seed of noise and gusts."""
    factors: Mapping[str, Value]
    """Value of each factor, by its name, as stored in the results."""
    config: Config
    """Configuration of the program, and in its section `mock` that of the mock vehicle. If a
    trajectory is flown, `flight.trajectory` is a key of `files`."""
    fault: Fault | None
    """Fault scenario; None: no fault."""
    files: Mapping[str, str]
    """The text of each file that the flight reads, by its path in the campaign's folder."""
    flight_s: float
    """Longest flight, s of vehicle time."""

    @property
    def mock(self) -> Mapping[str, Any]:
        """The complete section `mock`, the seed of this case included."""
        return self.config.mock or {}

    def description(self) -> str:
        """Number and factors of the case, for messages."""
        factors = ", ".join(f"{key} = {_value_text(value)}" for key, value in self.factors.items())
        return f"case {self.index}" + (f" ({factors})" if factors else "")


def _value_text(value: Value) -> str:
    if value is None:
        return "null"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
