"""The section `tune` of a campaign's file: which keys are searched, and under which constraint."""

from typing import Annotated

from pydantic import Field, field_validator

from companion.campaign.swept import Swept
from companion.files.yaml_file import Section


class Tune(Section):
    """The search of `companion campaign tune`. Running the campaign ignores this section."""

    search: Annotated[dict[str, Swept], Field(min_length=1, max_length=30)]
    """Searched keys of the program: dotted, each with uniform, loguniform or choice."""
    trials: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of candidates that are tried; `--trials` replaces it."""
    envelope_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = 1.0
    """Largest true distance from the reference (`position_max_m` of the results) for a flight that
    reaches its end to count as inside the envelope. null: every flight that reaches its end counts
    as inside.
    """
    inside_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.999
    """Share of the flights that must stay inside the envelope."""
    check_samples: Annotated[int, Field(ge=2, le=10_000)] = 8
    """Number of samples that the search does not see; on them the result is compared with the
    unchanged configuration."""

    @field_validator("search")
    @classmethod
    def _searchable(cls, search: dict[str, Swept]) -> dict[str, Swept]:
        for key, swept in search.items():
            if not (swept.uniform or swept.loguniform or swept.choice):
                raise ValueError(f"{key}: give uniform, loguniform or choice")
            if swept.times_base or swept.keys:
                raise ValueError(f"{key}: times_base and keys belong to `sweep`")
            if key.startswith("mock."):
                raise ValueError(
                    f"{key}: keys of the mock vehicle cannot be searched; name keys of the program"
                )
        return search
