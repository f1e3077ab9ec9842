"""The values that are searched, and the candidates with which the search starts."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import Tune
from companion.campaign.case import Case
from companion.campaign.keys import replace_unchecked, with_keys
from companion.campaign.swept import SweptValues
from companion.config import Config
from companion.config.flight import OPEN_LOOP
from companion.config.known_drag import drag_prior
from companion.control.hold_settings import disturbance_bandwidth, hold_weights
from companion.files.yaml_file import ConfigError
from companion.tuning import propose

if TYPE_CHECKING:
    from optuna import Trial

Values = Mapping[str, Any]
"""Value of each searched key."""
_UNSEEN_SEED_OFFSET = 1_000_003
"""Number added to the campaign's seed for the cases that the search does not see."""
_NEARBY_DEVIATION = 0.15
"""Standard deviation of the values around a start, as a share of the range of the key.

With `loguniform` the range is that of the logarithm."""


class StartCandidate(NamedTuple):
    """A candidate with which the search starts."""

    name: str
    """Source of the values, such as `companion tune`."""
    values: Values
    """Values of the searched keys. Optuna draws the value of a missing key."""


def tune_section(campaign: Campaign) -> Tune:
    """Check and return the section `tune` of a campaign.

    Raises:
        ConfigError: the section is missing, the campaign is a batch, a searched key is also swept,
            or no flight follows a reference in closed loop.
    """
    tune = campaign.file.tune
    if tune is None:
        raise ConfigError(
            f"{campaign.file_path}: there is no section `tune` that says what to search"
        )
    if campaign.file.kind != "flights":
        raise ConfigError(f"{campaign.file_path}: `tune` needs `kind: flights`")
    for key in tune.search.keys() & campaign.file.swept_keys:
        raise ConfigError(
            f"{campaign.file_path}: `{key}` is in sweep and in tune.search; remove it from one of "
            "them"
        )
    maneuvers_of_cases = (case.config.flight.maneuvers for case in campaign.cases())
    if all(set(OPEN_LOOP).issuperset(maneuvers) for maneuvers in maneuvers_of_cases):
        raise ConfigError(
            f"{campaign.file_path}: `tune` compares distances from the reference, but the "
            f"maneuvers {', '.join(sorted(OPEN_LOOP))} have no reference; set flight.maneuvers to "
            "[circle] or another maneuver with a reference"
        )
    return tune


def cases(campaign: Campaign, values: Values) -> list[Case]:
    """The cases of a campaign with the values of a candidate.

    Raises:
        ConfigError: a value is refused.
    """
    return list(replace(campaign, base=with_keys(campaign.base, values)).cases())


def unseen_campaign(campaign: Campaign, samples: int) -> Campaign:
    """The campaign with another seed, so that samples, noise and gusts differ from the search's."""
    update = {"seed": campaign.file.seed + _UNSEEN_SEED_OFFSET, "samples": samples}
    return replace(campaign, file=campaign.file.model_copy(update=update))


def suggested_values(trial: "Trial", search: Mapping[str, SweptValues]) -> dict[str, Any]:
    """The values that Optuna suggests for a trial; numbers are rounded to three digits."""
    values: dict[str, Any] = {}
    for key, swept in search.items():
        if swept.choice is not None:
            values[key] = trial.suggest_categorical(key, list(swept.choice))
        else:
            low, high = swept.uniform or swept.loguniform or (0.0, 1.0)
            value = trial.suggest_float(key, low, high, log=swept.loguniform is not None)
            values[key] = min(max(float(f"{value:.3g}"), low), high)
    return values


def start_candidates(
    campaign: Campaign, tune: Tune, learned_config: Config | None = None
) -> Iterator[StartCandidate]:
    """The first candidates: the campaign's configuration, `learned_config`, and a proposal.

    `learned_config` is the configuration with the values that first flights measured; None: no such
    flights. The proposal is that of `companion tune` for `learned_config` or, without it, for the
    campaign's configuration. There is no proposal if the rate loop is not known.
    """
    yield StartCandidate(
        "the configuration",
        clamped_to_search(_present_values(campaign.base, tune.search), tune.search),
    )
    start_config = learned_config or campaign.base
    present_values = _present_values(start_config, tune.search)
    if learned_config is not None:
        yield StartCandidate("a first flight", clamped_to_search(present_values, tune.search))
    try:
        changes = propose(replace_unchecked(start_config, planner={"name": "auto"})).changes
    except ConfigError:
        return  # the rate loop is not known, or the linear analysis does not support the planner
    proposed_values = {
        f"{section}.{key}": value
        for section, keys in changes.items()
        for key, value in keys.items()
    }
    yield StartCandidate(
        "companion tune", clamped_to_search({**present_values, **proposed_values}, tune.search)
    )


def candidates_near(
    start: StartCandidate, search: Mapping[str, SweptValues], count: int, seed: int
) -> Iterator[StartCandidate]:
    """Candidates around a start: each number is moved by a normally distributed share of its range.

    The optimum is likelier near a reasonable start than elsewhere in the ranges.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        moved_values = dict(start.values)
        for key, value in start.values.items():
            swept = search[key]
            if swept.loguniform is not None:
                low, high = swept.loguniform
                moved_values[key] = value * (high / low) ** rng.normal(0.0, _NEARBY_DEVIATION)
            elif swept.uniform is not None:
                low, high = swept.uniform
                moved_values[key] = value + (high - low) * rng.normal(0.0, _NEARBY_DEVIATION)
        yield StartCandidate(f"near {start.name}", clamped_to_search(moved_values, search))


def _present_values(config: Config, keys: Collection[str]) -> dict[str, Any]:
    """The values of keys in a configuration; for a null key, the value that the program derives.

    A null key without a derived value is left out.
    """
    weights, drag = hold_weights(config), drag_prior(config).drag
    derived_values = {
        "guidance.position_weight_per_s4": weights.position,
        "guidance.velocity_weight_per_s2": weights.velocity,
        "guidance.disturbance_bandwidth_rad_s": disturbance_bandwidth(config),
        "guidance.drag_per_s": drag.linear,
        "guidance.quadratic_drag_per_m": drag.quadratic,
        "thrust.lag_ms": 1e3 * config.thrust.lag,
    }
    configured_by_key = configured_values(config, keys)
    return {
        key: value
        for key in keys
        if (value := configured_by_key.get(key, derived_values.get(key))) is not None
    }


def configured_values(config: Config, keys: Iterable[str]) -> dict[str, Any]:
    """The values of dotted keys in a configuration; keys that are null are left out."""
    values = {}
    for key in keys:
        section, _, name = key.partition(".")
        value = getattr(getattr(config, section), name)
        if value is not None:
            values[key] = value
    return values


def clamped_to_search(values: Values, search: Mapping[str, SweptValues]) -> dict[str, Any]:
    """Values clamped to the ranges of the search.

    Keys that are not searched are left out, and so are values that are not among a key's choices.
    """
    clamped_values: dict[str, Any] = {}
    for key, value in values.items():
        swept = search.get(key)
        if swept is None or (swept.choice is not None and value not in swept.choice):
            continue
        search_range = swept.uniform or swept.loguniform
        clamped_values[key] = value
        if search_range is not None:
            clamped_values[key] = min(max(float(value), search_range[0]), search_range[1])
    return clamped_values
