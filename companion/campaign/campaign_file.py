"""The YAML file of a campaign: base configuration, swept keys, faults, limits and search."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, field_validator, model_validator

from companion.campaign.swept import SweptValues
from companion.files.yaml_file import PathKey, Section


def _require_folder_name(name: str) -> str:
    """Return `name`; raise ValueError if it cannot begin the name of a folder."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
        raise ValueError(
            "must begin with a letter or a digit, and contain only letters, digits, `-` and `_`"
        )
    return name


CampaignName = Annotated[
    str, Field(min_length=1, max_length=60), AfterValidator(_require_folder_name)
]
ScenarioName = Annotated[str, Field(min_length=1, max_length=60)]
Ending = Literal["ground", "ok", "landed", "held", "pilot"]
FaultPhase = Literal["stream", "arm", "takeoff", "offboard", "maneuvers", "hand back", "land"]

NO_FAULT = "none"
"""Value of the factor `fault` for a flight without a fault."""
FAULT, FAULT_PHASE, FAULT_AFTER = "fault", "fault.phase", "fault.after_s"
"""Factors: the fault scenario, the phase in which it begins, and its delay in this phase, s."""
FAULT_FACTORS = (FAULT, FAULT_PHASE, FAULT_AFTER)
"""Factors that are not keys of a configuration."""
_DEFAULT_FAULT_DELAYS_S = {
    "stream": 0.0,
    "arm": 0.0,
    "takeoff": 0.8,
    "offboard": 1.3,
    "maneuvers": 0.3,
    "hand back": 0.02,
    "land": 0.3,
}
"""Default of `FaultScenario.after_s` in each phase, s."""
TRAJECTORY, MANEUVERS = "flight.trajectory", "flight.maneuvers"
CASE_NOUNS = {"flights": "flights", "batch": "vehicles"}
"""Plural noun for the cases of each kind of campaign."""


class FaultScenario(Section):
    """Faults of the mock vehicle that begin in a phase of the flight, and the permitted endings."""

    inject: Annotated[tuple[dict[str, Any], ...], Field(min_length=1, max_length=10)]
    """Entries as in `mock.faults`, without `at_s` and `after_offboard_s`. All begin together."""
    phase: FaultPhase = "maneuvers"
    """Phase of the flight in which the faults begin. The faults of a flight without the
    phase `stream` begin in the phase `arm` instead. The factor fault.phase replaces this key."""
    after_s: Annotated[float, Field(ge=0.0, le=3600.0)] | None = None
    """Time from the beginning of the phase to the faults. The factor fault.after_s replaces this
    key. null: 0 s in stream and arm, 0.8 s in takeoff, 1.3 s in offboard, 0.3 s in maneuvers and
    land, 0.02 s in hand back."""
    ends: (
        Annotated[tuple[Ending, ...], Field(min_length=1)]
        | dict[FaultPhase, Annotated[tuple[Ending, ...], Field(min_length=1)]]
    ) = ("ok",)
    """Permitted endings of the flight (docs/safety.md): a list for all phases, or a list for each
    phase. ground: the vehicle never left the ground. ok: the flight ended as without the fault.
    landed: our program landed the vehicle and says why. held: the autopilot still flies the
    vehicle, by our command or by its own failsafe. pilot: the pilot has taken over."""

    def delay(self, phase: str) -> float:
        """Time from the beginning of a phase to the fault, s."""
        return _DEFAULT_FAULT_DELAYS_S[phase] if self.after_s is None else self.after_s

    def endings(self, phase: str) -> tuple[str, ...]:
        """Permitted endings of a flight whose fault begins in `phase`; empty: not limited."""
        if isinstance(self.ends, dict):
            return {str(name): endings for name, endings in self.ends.items()}.get(phase, ())
        return self.ends


class CampaignLimits(Section):
    """Largest size of a campaign, and longest flight.

    A larger campaign is refused before it begins, unless `--yes` accepts any size.
    """

    max_cases: Annotated[int, Field(ge=1, le=100_000_000)] | None = None
    """Largest number of cases. null: 2000 flights, or 100000 vehicles of batch kinematics."""
    max_hours: Annotated[float, Field(gt=0.0, le=10_000.0)] = 4.0
    """Longest estimated duration of the campaign. A campaign with at most two cases for each worker
    is not checked against this limit."""
    flight_s: Annotated[float, Field(ge=1.0, le=36_000.0)] = 600.0
    """Longest flight, s of vehicle time from boot. A longer flight is ended at this
    time, and its `ok` in the results is false."""


class Tune(Section):
    """The search of `companion campaign tune`. Running the campaign ignores this section."""

    search: Annotated[dict[str, SweptValues], Field(min_length=1, max_length=30)]
    """Searched keys of the program: dotted, each with uniform, loguniform or choice."""
    trials: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of candidates that are tried; `--trials` replaces it."""
    envelope_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = 1.0
    """A flight counts as inside the envelope if it reaches its end and its largest true distance
    from the reference (`position_max_m` of the results) is at most this distance. null:
    any distance."""
    inside_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.999
    """Smallest share of the flights that must stay inside the envelope, 0..1."""
    check_samples: Annotated[int, Field(ge=2, le=10_000)] = 8
    """Number of further samples, not used in the search, on which the result is compared with the
    unchanged configuration."""

    @field_validator("search")
    @classmethod
    def _check_search(cls, search: dict[str, SweptValues]) -> dict[str, SweptValues]:
        for key, swept in search.items():
            if not (swept.uniform or swept.loguniform or swept.choice):
                raise ValueError(f"{key}: give uniform, loguniform or choice")
            if swept.times_base or swept.keys:
                raise ValueError(f"{key}: `times_base` and `keys` are allowed only in `sweep`")
            if key.startswith("mock."):
                raise ValueError(
                    f"{key}: keys of the mock vehicle cannot be searched; name keys of the program"
                )
        return search


class CampaignFile(Section):
    """A campaign; the top level of its YAML file."""

    name: CampaignName
    """Name of the campaign, and of its folder."""
    kind: Literal["flights", "batch"] = "flights"
    """flights: whole flights of the program and the mock vehicle on one virtual clock. batch:
    only the attitude kinematics of a vehicle in each case."""
    config: PathKey | dict[str, Any]
    """Base configuration of every case, including its section `mock`. Either the path of a file,
    relative to this file, or the keys themselves."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 1
    """Seed of the samples, and of the noise and gusts of every flight."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 1
    """Number of samples of the distributions. Each is flown at each point of the grid. Without a
    distribution each point of the grid is flown this number of times, with different noise and
    gusts."""
    sampling: Literal["random", "latin-hypercube", "sobol", "grid"] = "latin-hypercube"
    """How the distributions are sampled. latin-hypercube and sobol: by SciPy's qmc; sobol needs a
    power of two. random: independently. grid: `samples` quantiles of each distribution, all
    combined."""
    same_seeds: bool = False
    """true: sample number k has the same noise and gusts at every point of the grid, so that
    planners are compared in the same wind. false: every case has noise and gusts of its own."""
    set: Annotated[dict[str, Any], Field(default_factory=dict, max_length=200)]
    """Keys that differ from `config` in every case, dotted: limits.max_tilt_deg,
    mock.wind.gust_m_s."""
    sweep: Annotated[dict[str, SweptValues], Field(default_factory=dict, max_length=50)]
    """Swept keys, dotted, of the program and of the mock vehicle (`mock.`). The
    factors fault, fault.phase and fault.after_s are possible, too. The values of flight.trajectory
    are paths of files, relative to this file."""
    faults: Annotated[
        dict[ScenarioName, FaultScenario], Field(default_factory=dict, max_length=100)
    ]
    """Fault scenarios by the name that the factor `fault` uses."""
    limits: CampaignLimits = CampaignLimits()
    tune: Tune | None = None
    """What `companion campaign tune` searches; running the campaign ignores it."""

    @field_validator("config", mode="before")
    @classmethod
    def _require_file_or_keys(cls, value: Any) -> Any:
        """Raise one ValueError unless `config` is a path or keys; pydantic would report several."""
        if not isinstance(value, str | Path | dict):
            raise ValueError("must name a file, or hold the keys of a configuration")
        return value

    @model_validator(mode="after")
    def _check_consistency(self) -> "CampaignFile":
        if self.sampling == "sobol" and self.samples & (self.samples - 1):
            next_power_of_two = 1 << self.samples.bit_length()
            raise ValueError(
                "sampling: sobol needs a power of two; set samples to "
                f"{next_power_of_two // 2} or {next_power_of_two}"
            )
        if NO_FAULT in self.faults:
            raise ValueError(
                f"faults: {NO_FAULT} means a flight without a fault; choose another name"
            )
        factors: dict[str, str] = {}
        for name, swept in self.sweep.items():
            for key in swept.changed_keys(name):
                if key in self.set:
                    raise ValueError(f"`{key}` stands in set and in sweep; remove one of them")
                if factors.setdefault(key, name) != name:
                    raise ValueError(
                        f"sweep: `{factors[key]}` and `{name}` both change `{key}`; remove it from "
                        "one of them"
                    )
        if self.kind == "batch" and (self.faults or FAULT in self.sweep):
            raise ValueError("`faults` need `kind: flights`")
        return self

    @property
    def swept_keys(self) -> frozenset[str]:
        """All keys that a factor changes, and the fault factors."""
        return frozenset(
            key for name, swept in self.sweep.items() for key in swept.changed_keys(name)
        )
