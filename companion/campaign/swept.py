"""The values of a swept key in a campaign file: a list, a range, or a distribution."""

from collections.abc import Sequence
from math import exp, isfinite, log
from statistics import NormalDist
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from companion.files.yaml_file import Section

Value = float | int | str | bool | None
"""A value of a factor, as stored in a row of the results."""
TwoNumbers = tuple[float, float]
KeyName = Annotated[str, Field(max_length=100)]

_DISTRIBUTIONS = ("uniform", "loguniform", "normal", "choice")
_KINDS = ("values", "range", *_DISTRIBUTIONS)
_MOST_VALUES = 1000


class SweptValues(Section):
    """The values of a swept key. A list in place of this section means the same as `values`.

    Exactly one of `values`, `range`, `uniform`, `loguniform`, `normal` and `choice` is given.
    `values` and `range` form a grid: each value is flown with every value of the other grids. The
    other four are distributions: samples of them are flown.
    """

    values: Annotated[tuple[Any, ...], Field(min_length=1, max_length=_MOST_VALUES)] | None = None
    """List of values, each of which is flown."""
    range: TwoNumbers | None = None
    """First and last of `count` values at equal distances."""
    count: Annotated[int, Field(ge=2, le=_MOST_VALUES)] | None = None
    """Number of values of `range`."""
    uniform: TwoNumbers | None = None
    """Uniform distribution between the two values."""
    loguniform: TwoNumbers | None = None
    """Distribution between the two values, uniform in the logarithm."""
    normal: TwoNumbers | None = None
    """Normal distribution: mean and standard deviation."""
    within: TwoNumbers | None = None
    """Bounds of `normal`, which is truncated there."""
    choice: Annotated[tuple[Any, ...], Field(min_length=2, max_length=_MOST_VALUES)] | None = None
    """List of values; each sample is one of these values, all equally likely."""
    times_base: bool = False
    """Whether the values multiply the value of the base configuration, instead of replacing it."""
    keys: Annotated[tuple[KeyName, ...], Field(min_length=1, max_length=20)] | None = None
    """Keys that get the value. null: the key that the factor is named after."""

    @model_validator(mode="before")
    @classmethod
    def _accept_bare_list(cls, value: Any) -> Any:
        if isinstance(value, list | tuple):
            return {"values": value}
        if isinstance(value, dict | cls):
            return value
        raise ValueError("must be a list of values, or a distribution such as {uniform: [0, 8]}")

    @field_validator("values", "choice")
    @classmethod
    def _require_plain_values(cls, values: Sequence[Any] | None) -> Sequence[Any] | None:
        for value in values or ():
            items = value if isinstance(value, list | tuple) else [value]
            if any(isinstance(item, dict | list | tuple) for item in items):
                raise ValueError("each value must be a number, a word, true, false, null or a list")
            if any(isinstance(item, float) and not isfinite(item) for item in items):
                raise ValueError("each number must be finite")
        stored_values = [column_value(value) for value in values or ()]
        if any(
            stored_values.index(value) != position for position, value in enumerate(stored_values)
        ):
            raise ValueError("a value is listed twice")
        return values

    @model_validator(mode="after")
    def _check_consistency(self) -> "SweptValues":
        if sum(getattr(self, kind) is not None for kind in _KINDS) != 1:
            raise ValueError(f"give exactly one of {', '.join(_KINDS)}")
        for kind in ("range", "uniform", "loguniform", "within"):
            bounds = getattr(self, kind)
            if bounds is not None and not bounds[0] < bounds[1]:
                raise ValueError(f"{kind}: the first value must be below the second")
        if self.loguniform is not None and self.loguniform[0] <= 0.0:
            raise ValueError("loguniform: both values must be above 0")
        if self.normal is not None and self.normal[1] <= 0.0:
            raise ValueError("normal: the standard deviation must be above 0")
        if (self.range is None) != (self.count is None):
            raise ValueError("range and count go together, as in {range: [20, 40], count: 5}")
        if self.within is not None and self.normal is None:
            raise ValueError("`within` limits a normal distribution, so give `normal` too")
        if self.times_base and not self.is_number:
            raise ValueError(
                "`times_base` multiplies the base value, so the values must be numbers"
            )
        return self

    @property
    def kind(self) -> str:
        """`values`, `range`, `uniform`, `loguniform`, `normal` or `choice`."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    @property
    def is_sampled(self) -> bool:
        """Whether the values are sampled; otherwise they form a grid."""
        return self.kind in _DISTRIBUTIONS

    @property
    def is_number(self) -> bool:
        """Whether the values are numbers or null."""
        listed_values = self.values or self.choice
        return listed_values is None or all(
            value is None or (isinstance(value, float | int) and not isinstance(value, bool))
            for value in listed_values
        )

    @property
    def is_bool(self) -> bool:
        """Whether all values are true or false."""
        listed_values = self.values or self.choice
        return listed_values is not None and all(isinstance(value, bool) for value in listed_values)

    def changed_keys(self, name: str) -> tuple[str, ...]:
        """The keys that get the value of the factor `name`."""
        return self.keys or (name,)

    def grid(self) -> tuple[Any, ...]:
        """The values of `values` or `range`."""
        if self.range is None:
            return self.values or ()
        (low, high), count = self.range, self.count or 2
        return tuple(low + (high - low) * step / (count - 1) for step in range(count))

    def quantile(self, probability: float) -> Any:
        """Quantile of the distribution at a cumulative probability, 0..1."""
        if self.choice is not None:
            return self.choice[min(int(probability * len(self.choice)), len(self.choice) - 1)]
        if self.normal is not None:
            return _normal_quantile(self.normal, self.within, probability)
        if self.loguniform is not None:
            low, high = map(log, self.loguniform)
            return exp(low + (high - low) * probability)
        low, high = self.uniform or (0.0, 1.0)
        return low + (high - low) * probability

    def description(self) -> dict[str, Any]:
        """Kind and values of the factor, for the metadata of the results."""
        optional_entries = {"count": self.count, "within": self.within}
        return {
            "kind": self.kind,
            "sampled": self.is_sampled,
            self.kind: [column_value(value) for value in getattr(self, self.kind)],
            **{key: value for key, value in optional_entries.items() if value is not None},
            "times_base": self.times_base,
        }


def _normal_quantile(normal: TwoNumbers, within: TwoNumbers | None, probability: float) -> float:
    distribution = NormalDist(*normal)
    low, high = (0.0, 1.0) if within is None else map(distribution.cdf, within)
    probability = min(max(low + (high - low) * probability, 1e-12), 1.0 - 1e-12)
    value = distribution.inv_cdf(probability)
    return value if within is None else min(max(value, within[0]), within[1])


def column_value(value: Any) -> Value:
    """A value as stored in the results: the items of a list are joined by commas."""
    if isinstance(value, list | tuple):
        return ",".join(str(item) for item in value)
    scalar: Value = value
    return scalar
