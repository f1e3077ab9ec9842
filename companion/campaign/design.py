"""The design of a campaign: every point of the grid, with every sample of the distributions."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.campaign.campaign_file import CampaignFile

_LARGEST_SEED = 2**63 - 1


@dataclass(frozen=True, slots=True)
class PlannedCase:
    """The factor values and the seed of one case; `Campaign.case` builds the case from them."""

    index: int
    """Number of the case, from 0."""
    seed: int
    """Seed of noise and gusts."""
    values: dict[str, Any]
    """Value of each factor as written in the campaign file."""


def number_of_cases(file: CampaignFile) -> int:
    """Number of cases, computed without building them."""
    distributions = sum(swept.is_sampled for swept in file.sweep.values())
    repeats = (
        file.samples**distributions if file.sampling == "grid" and distributions else file.samples
    )
    return repeats * prod(
        len(swept.grid()) for swept in file.sweep.values() if not swept.is_sampled
    )


def few_samples_warning(file: CampaignFile) -> str | None:
    """A warning if `samples` is too small for the distributions; else None."""
    samples = file.samples
    names = [
        name
        for name, swept in file.sweep.items()
        if swept.is_sampled and samples < (2 if swept.choice is None else len(swept.choice))
    ]
    if not names:
        return None
    values = "only one value" if samples == 1 else f"at most {samples} values"
    return (
        f"with samples: {samples} the campaign flies {values} of {', '.join(names)}; raise "
        "samples, or replace the distribution by a list, because every value of a list is flown"
    )


def planned_cases(file: CampaignFile) -> Iterator[PlannedCase]:
    """All cases in order: every point of the grid with the first sample, then with the next.

    A campaign that is stopped has therefore flown all points of the grid about equally often.
    """
    grids = {name: swept.grid() for name, swept in file.sweep.items() if not swept.is_sampled}
    distributions = {name: swept for name, swept in file.sweep.items() if swept.is_sampled}
    grid_points = [
        dict(zip(grids, grid_point, strict=True)) for grid_point in product(*grids.values())
    ]
    index = 0
    for sample_number, probabilities in enumerate(_probabilities(file, len(distributions))):
        drawn_values = {
            name: swept.quantile(float(probability))
            for (name, swept), probability in zip(distributions.items(), probabilities, strict=True)
        }
        for grid_point in grid_points:
            values = {**grid_point, **drawn_values}
            seed = seed_of(file.seed, sample_number if file.same_seeds else index)
            yield PlannedCase(index, seed, {name: values[name] for name in file.sweep})
            index += 1


def seed_of(campaign_seed: int, number: int) -> int:
    """Seed of a case, 0 to 2⁶³ − 1; the same on every computer.

    `number` is the number of the case or, with `same_seeds`, the number of its sample.
    """
    digest = hashlib.sha256(f"{campaign_seed}:{number}".encode()).digest()
    return int.from_bytes(digest[:8], "big") & _LARGEST_SEED


def _probabilities(file: CampaignFile, distribution_count: int) -> NDArray[np.float64]:
    """(n, dimensions): cumulative probability of each sample in each distribution.

    `distribution_count` is the number of distributions. n is `samples`, or samples**dimensions with
    `sampling: grid` and at least one distribution.
    """
    count = file.samples
    if distribution_count == 0:
        return np.empty((count, 0))
    if file.sampling == "random":
        return np.random.default_rng(file.seed).random((count, distribution_count))
    if file.sampling == "grid":
        midpoints = (np.arange(count) + 0.5) / count
        return np.array(list(product(midpoints, repeat=distribution_count)))
    from scipy.stats import qmc  # noqa: PLC0415  takes half a second to import

    sampler = qmc.LatinHypercube if file.sampling == "latin-hypercube" else qmc.Sobol
    probabilities: NDArray[np.float64] = sampler(distribution_count, rng=file.seed).random(count)
    return probabilities
