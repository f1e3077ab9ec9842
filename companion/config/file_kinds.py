"""Recognises a YAML file of the wrong kind, and names the command that takes it."""

from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path

from companion.config.root import Config
from companion.files.yaml_file import ConfigError


class FileKind(Enum):
    """The kinds of YAML files; each value is the name in messages."""

    CONFIG = "a configuration"
    TRAJECTORY = "a trajectory file"
    CAMPAIGN = "a campaign file"


CAMPAIGN_KEYS = (
    "name", "kind", "config", "seed", "samples", "sampling", "same_seeds", "set", "sweep", "faults",
    "limits", "tune",
)  # fmt: skip
"""The keys of a campaign file, copied: `companion.campaign` may not be imported here."""
TRAJECTORY_KEYS = ("hover", "line", "circle", "helix", "figure_eight", "waypoints", "csv")
"""The keys of a trajectory file, copied: `trajectory_file` imports this module."""
_KEYS: Mapping[FileKind, Iterable[str]] = {
    FileKind.CONFIG: Config.model_fields,
    FileKind.TRAJECTORY: TRAJECTORY_KEYS,
    FileKind.CAMPAIGN: CAMPAIGN_KEYS,
}
_USES: Mapping[FileKind, str] = {
    FileKind.CONFIG: "`companion fly --config` flies it, and the key `config` of a campaign file "
    "names it",
    FileKind.TRAJECTORY: "`companion fly --trajectory` flies it",
    FileKind.CAMPAIGN: "`companion campaign run` flies it, and its key `config` names the "
    "configuration",
}


def require_kind(path: Path | str, keys: Iterable[str], wanted_kind: FileKind) -> None:
    """Refuse a file whose top-level keys fit another kind of file better.

    Raises:
        ConfigError: the file is of another kind; the message names what takes such a file.
    """
    given_keys = set(keys)
    match_counts = {
        kind: len(given_keys.intersection(kind_keys)) for kind, kind_keys in _KEYS.items()
    }
    likely_kind = max(match_counts, key=lambda kind: (match_counts[kind], kind is wanted_kind))
    if likely_kind is not wanted_kind:
        raise ConfigError(
            f"{path} is {likely_kind.value}, not {wanted_kind.value}; {_USES[likely_kind]}"
        )
