"""Repeats one case of a campaign with full recording, and compares it with its stored row."""

from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from companion.campaign import folder, store
from companion.campaign.campaign import Campaign
from companion.campaign.flight import fly_case
from companion.campaign.loading import load
from companion.campaign.versions import difference, versions
from companion.files.yaml_file import ConfigError
from companion.recording.folder import flight_folder

_CASES_FOLDER = "cases"
"""Folder of the recorded flights, in the folder of a campaign."""


class Rerun(NamedTuple):
    """A case that was flown again."""

    folder: Path
    """Folder of the recorded flight."""
    identical: bool
    """Whether the row equals the stored row to the bit. A case that has no stored row yet counts as
    identical."""
    lines: tuple[str, ...]
    """Messages for the user, a line each."""


def rerun(campaign_folder: Path, index: int) -> Rerun:
    """Fly case number `index` again, with full recording, and compare it with its stored row.

    Raises:
        ConfigError: there is no such campaign or case, the case is not a flight, the results are
            damaged, or the folder of the recording cannot be made.
    """
    description = folder.read_description(campaign_folder)
    campaign = load(campaign_folder / folder.CAMPAIGN_FILE_NAME)
    if campaign.file.kind != "flights":
        raise ConfigError(
            f"{campaign_folder}: a campaign of the kind `batch` has no flights to record"
        )
    if not 0 <= index < description.cases:
        raise ConfigError(
            f"{campaign_folder}: its cases are 0 to {description.cases - 1}, not {index}"
        )
    case = campaign.case(next(islice(campaign.planned_cases(), index, None)))
    recording = flight_folder(campaign_folder / _CASES_FOLDER / f"case-{index:05d}")
    row = fly_case(case, recording)
    verdict = "good" if row["ok"] else f"not good: {row['failed_checks'] or row['result']}"
    lines = [f"{case.description()}: {verdict}"]
    if version_differences := difference(description.versions, versions()):
        lines.append(
            f"The campaign was flown by another version: this one has {version_differences}."
        )
    stored_row = _stored_row(campaign_folder, campaign, description, index)
    if stored_row is None:
        return Rerun(recording, True, (*lines, "The campaign has not flown this case yet."))
    changed_columns = [name for name, value in stored_row.items() if row.get(name) != value]
    lines.append(
        f"This flight differs from the campaign's flight in {', '.join(changed_columns)}."
        if changed_columns
        else f"This flight is bit-identical to the campaign's flight: digest {row['digest']}."
    )
    return Rerun(recording, not changed_columns, tuple(lines))


def _stored_row(
    campaign_folder: Path, campaign: Campaign, description: folder.Description, index: int
) -> dict[str, Any] | None:
    """The stored row of a case; None: the case was not flown yet."""
    unit = index // description.unit
    if unit not in store.finished_units(campaign_folder):
        return None
    rows = store.read_unit(campaign_folder, unit).to_pylist()
    return next((row for row in rows if row["case"] == index), None)
