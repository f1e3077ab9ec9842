"""The folder of a campaign: created, resumed, and locked against a second process."""

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from companion.campaign import store
from companion.campaign.campaign import Campaign
from companion.campaign.loading import resolved_keys
from companion.campaign.versions import VersionError, Versions, as_versions, difference, versions
from companion.files import bounded_yaml
from companion.files.bounded_file import FileRefusedError, read_text
from companion.files.bounded_yaml import YamlError
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError

CAMPAIGNS_FOLDER = Path("runs", "campaigns")
"""Folder of the campaigns' folders, relative to the working folder."""
CAMPAIGN_FILE_NAME = "campaign.yaml"
"""Name of the file in a campaign's folder that holds the configuration and all defaults."""
_DESCRIPTION, _LOCK = "campaign.json", ".lock"
_LARGEST_FILE_BYTES = 1_000_000
_SIZE_LIMITS = ("max_cases", "max_hours")  # keys of the section `limits`


@dataclass(frozen=True)
class Description:
    """Description of a campaign: the content of `campaign.json`."""

    name: str
    kind: str
    """"flights" or "batch"."""
    seed: int
    cases: int
    unit: int
    """Number of cases in each unit of work; the last unit may have fewer."""
    case_s: float | None
    """Wall time of a case, measured before the campaign began, s; None: not measured."""
    versions: Versions
    """Versions of the program and of the packages that the results depend on."""
    began: str
    """Time at which the folder was made, ISO 8601, UTC."""


def describe(campaign: Campaign, unit_size: int, seconds_per_case: float | None) -> Description:
    """The description of a campaign that begins now, with `unit_size` cases in a unit of work."""
    file, time_text = campaign.file, datetime.now(UTC).isoformat(timespec="seconds")
    cases = campaign.number_of_cases
    return Description(
        file.name, file.kind, file.seed, cases, unit_size, seconds_per_case, versions(), time_text
    )


def new_path(campaign: Campaign) -> Path:
    """The path of a new folder, named after the campaign and the present time in UTC."""
    time_text = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    return CAMPAIGNS_FOLDER / f"{campaign.file.name}-{time_text}"


def make(folder: Path, campaign: Campaign, description: Description) -> None:
    """Make and fill the folder of a new campaign.

    Raises:
        ConfigError: the folder cannot be written, or holds files already.
    """
    try:
        if folder.exists() and any(path.name != _LOCK for path in folder.iterdir()):
            raise ConfigError(
                f"{folder}: holds files, but no campaign; name another folder with --out, or empty "
                "this one"
            )
        (folder / store.RESULTS_FOLDER).mkdir(parents=True, exist_ok=True)
        for name, text in campaign.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_whole(folder / name, text)
        write_whole(folder / CAMPAIGN_FILE_NAME, bounded_yaml.dump(resolved_keys(campaign)))
        write_whole(folder / _DESCRIPTION, json.dumps(asdict(description), indent=2) + "\n")
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written: {error.strerror}") from error


def holds_campaign(folder: Path) -> bool:
    """Whether the folder holds a campaign."""
    return (folder / _DESCRIPTION).is_file()


def read_description(folder: Path) -> Description:
    """Read the description in the folder of a campaign.

    Raises:
        ConfigError: there is no description, or it is damaged.
    """
    path = folder / _DESCRIPTION
    try:
        values = json.loads(read_text(path, _LARGEST_FILE_BYTES))
        description = Description(**{**values, "versions": as_versions(values["versions"])})
        # `range` refuses everything but whole numbers, and an empty one is false.
        if not (range(description.cases) and range(description.unit)):
            raise ValueError  # the message below names the file
    except FileRefusedError as error:
        raise ConfigError(f"{folder}: no campaign was begun here: {error}") from error
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise ConfigError(
            f"{path} is damaged; start the campaign again with another --out"
        ) from error
    return description


def resume(folder: Path, campaign: Campaign) -> Description:
    """Check that the folder holds this campaign, begun by this version; return its description.

    Raises:
        ConfigError: the folder holds another campaign, or a file in it is damaged.
        VersionError: the campaign was begun by another version.
    """
    description = read_description(folder)
    _require_same_campaign(folder, campaign)
    if differences := difference(description.versions, versions()):
        raise VersionError(
            f"{folder} was begun by another version: this one has {differences}. Results of two "
            "versions must not be mixed: continue with the version that began it, or start again "
            "with another --out"
        )
    return description


def _require_same_campaign(folder: Path, campaign: Campaign) -> None:
    """Refuse a folder with another campaign; only the limits on the campaign's size may differ."""
    path = folder / CAMPAIGN_FILE_NAME
    try:
        stored_keys = bounded_yaml.parse(read_text(path, _LARGEST_FILE_BYTES))
        # Written and parsed like the file, so that tuples are lists here, too.
        new_keys = bounded_yaml.parse(bounded_yaml.dump(resolved_keys(campaign)))
    except (FileRefusedError, YamlError) as error:
        raise ConfigError(f"{path}: {error}") from error
    if not isinstance(stored_keys, Mapping):
        raise ConfigError(f"{path} is damaged; start the campaign again with another --out")
    changed_keys = [
        key
        for key in new_keys
        if _without_size_limits(stored_keys, key) != _without_size_limits(new_keys, key)
    ]
    changed_files = [
        name for name, text in campaign.files.items() if _text_or_none(folder / name) != text
    ]
    if changed_keys or changed_files:
        raise ConfigError(
            f"{folder} holds another campaign: {', '.join((*changed_keys, *changed_files))} differ;"
            " name another folder with --out"
        )


def _without_size_limits(data: Mapping[str, Any], key: str) -> Any:
    """The value of a key of a campaign file, without `max_cases` and `max_hours` in `limits`."""
    value = data.get(key)
    if key == "limits" and isinstance(value, Mapping):
        return {name: limit for name, limit in value.items() if name not in _SIZE_LIMITS}
    return value


def _text_or_none(path: Path) -> str | None:
    """The text of a file; None: it cannot be read."""
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return None


@contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Lock the folder, so that no other process runs the same campaign.

    Raises:
        ConfigError: another process has locked the folder, or the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written: {error.strerror}") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ConfigError(f"{folder}: another process runs this campaign") from error
        yield
    finally:
        os.close(descriptor)
