"""Reads a campaign file, and the configuration and the trajectories that it names."""

import tempfile
from collections.abc import Mapping
from itertools import chain, count
from pathlib import Path
from typing import Any, get_args

from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import (
    FAULT,
    FAULT_AFTER,
    FAULT_FACTORS,
    FAULT_PHASE,
    MANEUVERS,
    NO_FAULT,
    TRAJECTORY,
    CampaignFile,
    FaultPhase,
)
from companion.campaign.keys import check_key, replace_unchecked, with_keys
from companion.campaign.swept import SweptValues
from companion.config import Config, trajectory_file
from companion.config.file_kinds import FileKind, require_kind
from companion.config.files import load as load_config
from companion.files import yaml_file
from companion.files.yaml_file import ConfigError, nearest_place, validated
from companion.flight.flown_config import copy_trajectory
from companion.testing.settings import mock_with_defaults

TRAJECTORIES_FOLDER = "trajectories"
"""Folder of the copied trajectory files, in the folder of a campaign."""


def load(path: Path) -> Campaign:
    """Read a campaign file, and check all keys in it.

    The values of each case are checked by `Campaign.cases`.

    Raises:
        ConfigError: a file cannot be read, or holds an unknown key or a bad value.
    """
    return _CampaignReader(path).campaign()


class _CampaignReader:
    """Reads one campaign file."""

    def __init__(self, path: Path) -> None:
        self._path, self._folder = path, path.parent
        contents = yaml_file.read(path, CampaignFile)
        require_kind(path, contents.keys, FileKind.CAMPAIGN)
        self._places = contents.places
        self._file = validated(contents.keys, str(path), CampaignFile, contents.places)
        self._files: dict[str, str] = {}
        self._copied_paths: dict[Path, Path] = {}

    def campaign(self) -> Campaign:
        """Check all keys, collect the trajectory files, and return the campaign."""
        file, base = self._file, self._base()
        for key in file.set:
            check_key(key, base, self._place_text("set", key))
        for name, swept in file.sweep.items():
            for key in () if name in FAULT_FACTORS else swept.changed_keys(name):
                check_key(key, base, self._place_text("sweep", name))
        for key in () if file.tune is None else file.tune.search:
            check_key(key, base, self._place_text("tune", "search", key))
        self._check_faults()
        changes = dict(file.set)
        named_keys = file.swept_keys | changes.keys()
        if TRAJECTORY in named_keys and MANEUVERS not in named_keys:
            changes[MANEUVERS] = ("trajectory",)
        if isinstance(changes.get(TRAJECTORY), str):
            changes[TRAJECTORY] = self._folder / changes[TRAJECTORY]
        try:
            base = with_keys(base, changes)
        except ConfigError as error:
            raise ConfigError(f"{self._path}: {error}") from error
        base = self._flyable_config(base)
        sweep = {name: self._with_copied_files(name, swept) for name, swept in file.sweep.items()}
        file = file.model_copy(update={"sweep": sweep, "set": {}})
        return Campaign(file, base, self._files, str(self._path))

    def _place_text(self, *key_path: str) -> str:
        """File, line and section of a key, for messages; `key_path` are the parts of its path."""
        return (
            f"{nearest_place(key_path, self._places, str(self._path))}: {'.'.join(key_path[:-1])}"
        )

    def _base(self) -> Config:
        given_config = self._file.config
        if isinstance(given_config, Mapping):
            config = validated(dict(given_config), f"{self._path}: config", Config)
            path = config.flight.trajectory
            if path is None:
                return config
            return replace_unchecked(config, flight={"trajectory": self._folder / path})
        return load_config(self._folder / given_config)

    def _flyable_config(self, base: Config) -> Config:
        """The base configuration with `flight.arm: true` and the path of the copied trajectory."""
        if base.link.backend != "direct":
            raise ConfigError(f"{self._path}: link.backend must be direct in a campaign")
        if base.link.signing_key_file is not None or (base.mock or {}).get("signing"):
            raise ConfigError(
                f"{self._path}: campaigns fly without signing: take out link.signing_key_file and "
                "mock.signing"
            )
        path = base.flight.trajectory
        copied_path = None if path is None else self._copy_trajectory(path)
        return replace_unchecked(base, flight={"arm": True, "trajectory": copied_path})

    def _with_copied_files(self, name: str, swept: SweptValues) -> SweptValues:
        """The factor, with each path of a trajectory file replaced by the path of its copy."""
        if TRAJECTORY not in swept.changed_keys(name):
            return swept
        listed_values = swept.values or swept.choice or ()
        if not (listed_values and all(isinstance(value, str) for value in listed_values)):
            raise ConfigError(f"{self._path}: sweep.{name}: each value must be a path")
        copied_paths = tuple(
            str(self._copy_trajectory(self._folder / value)) for value in listed_values
        )
        return swept.model_copy(update={swept.kind: copied_paths})

    def _copy_trajectory(self, path: Path) -> Path:
        """Add a trajectory file, and the CSV table that it names, to the campaign's files.

        Returns:
            path of the copy in the campaign's folder.
        """
        if path in self._copied_paths:
            return self._copied_paths[path]
        trajectory_file.read(path)
        used_stems = {name.parts[1] for name in self._copied_paths.values()}
        numbered_stems = (f"{path.stem}-{number}" for number in count(2))
        stem = next(stem for stem in chain([path.stem], numbered_stems) if stem not in used_stems)
        with tempfile.TemporaryDirectory(prefix="companion-campaign-") as folder:
            copy_folder = Path(folder) / stem
            name = copy_trajectory(path, copy_folder)
            for copied_file in sorted(copy_folder.iterdir()):
                self._files[f"{TRAJECTORIES_FOLDER}/{stem}/{copied_file.name}"] = (
                    copied_file.read_text("utf-8")
                )
        copied_path = Path(TRAJECTORIES_FOLDER, stem, name)
        self._copied_paths[path] = copied_path
        return copied_path

    def _check_faults(self) -> None:
        file, name = self._file, self._path
        for scenario, scenario_section in file.faults.items():
            for fault in scenario_section.inject:
                if fault.keys() & {"at_s", "after_offboard_s"}:
                    raise ConfigError(
                        f"{name}: faults.{scenario}: phase and after_s say when the fault begins; "
                        "take out at_s and after_offboard_s"
                    )
            try:
                mock_with_defaults({"faults": scenario_section.inject})
            except ConfigError as error:
                raise ConfigError(f"{name}: faults.{scenario}: {error}") from error
        self._check_names(FAULT, (NO_FAULT, *file.faults))
        self._check_names(FAULT_PHASE, get_args(FaultPhase))
        for key in (FAULT_PHASE, FAULT_AFTER):
            if key in file.sweep and FAULT not in file.sweep:
                raise ConfigError(f"{name}: sweep.{key} needs sweep.{FAULT}")
        after_factor = file.sweep.get(FAULT_AFTER)
        if after_factor is not None and not after_factor.is_number:
            raise ConfigError(f"{name}: sweep.{FAULT_AFTER}: each value must be a number")

    def _check_names(self, key: str, known_names: tuple[str, ...]) -> None:
        """Check that a fault factor, if it is swept, lists only known names."""
        swept = self._file.sweep.get(key)
        if swept is None:
            return
        if not (listed_values := swept.values or swept.choice):
            raise ConfigError(f"{self._path}: sweep.{key}: give a list of names")
        for name in listed_values:
            if name not in known_names:
                raise ConfigError(
                    f"{self._path}: sweep.{key}: there is no {name!r:.60}; known: "
                    f"{', '.join(known_names)}"
                )


def resolved_keys(campaign: Campaign) -> dict[str, Any]:
    """The content of the campaign's file with the whole configuration and all defaults."""
    campaign_keys = campaign.file.model_dump(mode="json")
    if campaign.file.tune is None:
        del campaign_keys["tune"]  # a section without keys would be read as an empty one
    campaign_keys["config"] = campaign.base.model_dump(mode="json")
    return campaign_keys
