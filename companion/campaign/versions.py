"""The software versions that a result depends on, and their comparison between processes."""

import hashlib
import platform
from collections.abc import Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from companion.files.yaml_file import ConfigError

Versions = dict[str, str]
"""Version by name: of the program, its source, Python, NumPy, numba and SciPy."""

_PACKAGE = "mavlink-companion"
_PACKAGES = ("numpy", "numba", "scipy")
_SOURCE_FOLDERS = ("companion", "sitl_mock")
_UNUSED_BY_CASES = ("cli", "report", "live", "bench", "study", "replay", "mavsdk_link.py")
"""Parts of `companion` that no case runs; changing them does not change the results."""
_DIGEST_LENGTH = 12


class VersionError(ConfigError):
    """Two processes of a campaign, or this process and a campaign's folder, differ in versions."""


@cache
def versions() -> Versions:
    """The versions of this process."""
    program_versions = {
        "companion": _version(_PACKAGE),
        "source": source_digest(),
        "python": platform.python_version(),
    }
    return program_versions | {name: _version(name) for name in _PACKAGES}


def source_digest() -> str:
    """The first `_DIGEST_LENGTH` hex digits of the SHA-256 of all code that cases may run."""
    sha256 = hashlib.sha256()
    base = Path(__file__).parents[2]
    for path in _sources(base):
        sha256.update(path.relative_to(base).as_posix().encode() + b"\0")
        sha256.update(path.read_bytes() + b"\0")
    return sha256.hexdigest()[:_DIGEST_LENGTH]


def _sources(base: Path) -> Iterator[Path]:
    for root in _SOURCE_FOLDERS:
        for path in sorted((base / root).rglob("*.py")):
            parts = path.relative_to(base).parts
            if not (parts[0] == _SOURCE_FOLDERS[0] and parts[1] in _UNUSED_BY_CASES):
                yield path


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def difference(our_versions: Versions, other_versions: Versions) -> str:
    """The differences between two sets of versions, as text; empty if they are equal."""
    labels = {"source": "the source of companion", "python": "Python"}
    return ", ".join(
        f"{labels.get(name, name)} {other_versions.get(name, 'unknown')} instead of "
        f"{our_versions.get(name, 'unknown')}"
        for name in our_versions | other_versions
        if other_versions.get(name) != our_versions.get(name)
    )


def require_equal(our_versions: Versions, other_versions: Versions, other_process: str) -> None:
    """Refuse another process with different versions; `other_process` names it in the message.

    Raises:
        VersionError: says what differs.
    """
    differences = difference(our_versions, other_versions)
    if differences:
        raise VersionError(
            f"{other_process} has {differences}: results of two versions must not be mixed, so "
            "install the same version there"
        )


def as_versions(data: Any) -> Versions:
    """Convert versions from JSON or from another process; all become text."""
    return {str(name): str(value) for name, value in data.items()} if isinstance(data, dict) else {}
