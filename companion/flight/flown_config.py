"""Writes the configuration and trajectory of a flight to its folder, to fly it again."""

import json
import platform
import shutil
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from companion.config import Config, trajectory_file
from companion.config.files import FILE_KEYS
from companion.config.known_drag import KnownDrag
from companion.config.trajectory_file import is_table
from companion.files import bounded_yaml
from companion.files.write_whole import write_whole
from companion.flight.plan import ConfiguredPlan, Plan

_CONFIG_FILE = "config.yaml"
_TRAJECTORY_FOLDER = "trajectory"
"""Folder for the copies of the trajectory file and of the table that the trajectory file names."""
_TABLE_FILE = "table.csv"


def record(config: Config, folder: Path, *, flies_maneuvers: bool = True) -> None:
    """Write `config.yaml` to the folder of a flight, and copy the trajectory's file there.

    The file contains the keys of included files. Other files, such as a signing key, are not
    copied; they are named by their absolute path.

    `config`: configuration of the flight, whose trajectory was read without error.
    `flies_maneuvers`: whether the flight flies the maneuvers and the trajectory of `config`.

    Raises:
        ConfigError: the trajectory's file has changed and holds no trajectory.
        OSError: a file cannot be read or written.
    """
    data = config.model_dump(mode="json")
    for key_path in FILE_KEYS:
        _make_absolute(data, key_path)
    path = config.flight.trajectory
    if flies_maneuvers and path is not None and "trajectory" in config.flight.maneuvers:
        data["flight"]["trajectory"] = (
            f"{_TRAJECTORY_FOLDER}/{copy_trajectory(path, folder / _TRAJECTORY_FOLDER)}"
        )
    write_whole(folder / _CONFIG_FILE, bounded_yaml.dump(data))


def description(config: Config, plan: Plan, *, real_time: bool) -> dict[str, str]:
    """The metadata "flight" of a recorded flight, without the time when it began."""
    limits, deadman = config.limits, config.deadman
    seed = None if config.mock is None else config.mock.get("seed")
    return {
        "companion": version("mavlink-companion"),
        "python": platform.python_version(),
        "system": platform.platform(),
        "pymavlink": version("pymavlink"),
        "mcap": version("mcap"),
        "plan": "configuration" if isinstance(plan, ConfiguredPlan) else "program",
        "planner": config.planner_name,
        "gain_per_s": repr(config.planner.gain_per_s),
        "deadline_s": repr(deadman.deadline),
        "min_battery": repr(limits.min_battery),
        "max_tilt_rad": repr(limits.max_tilt),
        "max_tilt_rate_rad_s": repr(limits.max_tilt_rate),
        "max_yaw_rate_rad_s": repr(limits.max_yaw_rate),
        "real_time": "yes" if real_time else "no",
        **({} if seed is None else {"seed": str(seed)}),
        **(_assumed_drag(plan.drag) if isinstance(plan, ConfiguredPlan) else {}),
    }


def _assumed_drag(known_drag: KnownDrag) -> dict[str, str]:
    """The drag assumed for the maneuvers, which a replay needs; empty if it was unknown."""
    if known_drag.drag is None:
        return {}
    return {
        "assumed_drag_per_s": repr(known_drag.drag.linear),
        "assumed_quadratic_drag_per_m": repr(known_drag.drag.quadratic),
    }


def flattened(section: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Flatten a configuration: `section.key` -> value as JSON."""
    values: dict[str, str] = {}
    for key, value in section.items():
        if isinstance(value, dict):
            values.update(flattened(value, f"{prefix}{key}."))
        else:
            values[f"{prefix}{key}"] = json.dumps(value)
    return values


def _make_absolute(data: dict[str, Any], key_path: tuple[str, ...]) -> None:
    *sections, key = key_path
    section: Any = data
    for name in sections:
        section = section.get(name) if isinstance(section, dict) else None
    if isinstance(section, dict) and isinstance(section.get(key), str):
        section[key] = str(Path(section[key]).absolute())


def copy_trajectory(path: Path, folder: Path) -> str:
    """Copy a trajectory's file, and the table that it names, to a new folder.

    Returns:
        The name of the copy.

    Raises:
        ConfigError: the file holds no trajectory.
        OSError: a file cannot be read or written.
    """
    folder.mkdir()
    copy = folder / path.name
    shape = None if is_table(path) else trajectory_file.load_shape(path)
    if shape is None or shape.csv is None:
        shutil.copyfile(path, copy)
        return copy.name
    table = shape.csv.file
    # The table lies beside its file now, so the file must name it by its name alone.
    name = _TABLE_FILE if table.name == path.name else table.name
    shutil.copyfile(path.parent / table, folder / name)
    if table == Path(name):
        shutil.copyfile(path, copy)
    else:
        data = shape.model_dump(mode="json", exclude_unset=True)
        data["csv"]["file"] = name
        copy.write_text(bounded_yaml.dump(data), encoding="utf-8")
    return copy.name
