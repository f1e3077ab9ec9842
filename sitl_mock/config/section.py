"""What every section of the configuration has in common."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class Section(BaseModel):
    """Base of every configuration section: unknown keys are refused, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def meaning(words: Mapping[str, object], value: object, what: str) -> object:
    """Return what a word stands for, and anything else as it is.

    Raises:
        ValueError: the word is not known.
    """
    if not isinstance(value, str):
        return value
    if value not in words:
        raise ValueError(f"known {what} are {', '.join(words)}")
    return words[value]
