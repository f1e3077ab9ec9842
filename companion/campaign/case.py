"""One case of a campaign: its factors, the resulting configuration, and its fault."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from companion.campaign.swept import Value
from companion.config import Config


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault scenario of one flight.

    Attributes:
        name: name of the scenario.
        inject: entries as in `mock.faults`.
        phase: phase of the flight in which the faults begin.
        after: time from the beginning of the phase to the faults, s.
        ends: permitted endings; see `FaultScenario.ends`.
    """

    name: str
    inject: tuple[Mapping[str, Any], ...]
    phase: str
    after: float
    ends: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Case:
    """One case, ready to be flown in any process on any computer.

    Attributes:
        index: number in the campaign, from 0.
        seed: seed of noise and gusts.
        factors: value of each swept key, as the results hold it.
        config: configuration of the program, and in its section `mock` that of the mock vehicle. If
            a trajectory is flown, `flight.trajectory` is a key of `files`.
        fault: fault scenario; None: no fault.
        files: the text of each file that the flight reads, by its path in the campaign's folder.
        flight_s: longest flight, s of vehicle time.
    """

    index: int
    seed: int
    factors: Mapping[str, Value]
    config: Config
    fault: Fault | None
    files: Mapping[str, str]
    flight_s: float

    @property
    def mock(self) -> Mapping[str, Any]:
        """The complete section `mock`, the seed of this case included."""
        return self.config.mock or {}

    def described(self) -> str:
        """Number and factors of the case, for messages."""
        factors = ", ".join(f"{key} = {_value_text(value)}" for key, value in self.factors.items())
        return f"case {self.index}" + (f" ({factors})" if factors else "")


def _value_text(value: Value) -> str:
    if value is None:
        return "null"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
