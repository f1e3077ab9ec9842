"""The undo file: what parameters were before the doctor set them, in YAML for people to read."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from pydantic import Field

from companion.files import bounded_yaml
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError, Section
from companion.preflight.evidence import Identity
from companion.vehicle.link import Link

Word = Annotated[str, Field(max_length=100)]
LARGEST = 3.5e38
"""PARAM_SET carries a 32-bit float."""


class Undo(Section):
    """What to restore, and on which vehicle."""

    autopilot: Word
    """Name of the autopilot's family."""
    system: Annotated[int, Field(ge=1, le=255)]
    """The vehicle's system id."""
    uid: Word | None
    """AUTOPILOT_VERSION's id of the hardware; null: it was not told."""
    time: Word
    """When the first of them was set, UTC."""
    parameters: dict[Word, Annotated[float, Field(ge=-LARGEST, le=LARGEST)]]
    """Old value of each, in the order in which they were set."""

    def meant_for(self, link: Link, identity: Identity) -> bool:
        """Whether this is the vehicle whose parameters were changed."""
        same_hardware = None in (self.uid, identity.uid) or self.uid == identity.uid
        told = self.autopilot, self.system
        return same_hardware and told == (link.autopilot.name, link.settings.target_system)


class UndoFile:
    """Grows by one parameter before each of them is set.

    Args:
        directory: Where it is to be made.
        link: To the vehicle.
        identity: What the vehicle said of itself.
    """

    def __init__(self, directory: Path, link: Link, identity: Identity) -> None:
        began = datetime.now(UTC)
        self.path = _unused(directory, f"doctor-undo-{began:%Y-%m-%dT%H-%M-%SZ}")
        self._undo = Undo(
            autopilot=link.autopilot.name,
            system=link.settings.target_system,
            uid=identity.uid,
            time=began.isoformat(timespec="seconds"),
            parameters={},
        )

    def add(self, parameter: str, old: float) -> None:
        """Note an old value; on the disk, whole, when this returns. The first one counts.

        Raises:
            ConfigError: it cannot be written, so nothing must be set.
        """
        grown = dict(self._undo.parameters)
        grown.setdefault(parameter, old)
        self._undo = self._undo.model_copy(update={"parameters": grown})
        text = bounded_yaml.dump(self._undo.model_dump())
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self.path, text)
        except OSError as error:
            raise ConfigError(
                f"recording.directory: the undo file {self.path} cannot be written, so nothing "
                f"more is set: {error.strerror}"
            ) from error


def _unused(directory: Path, name: str) -> Path:
    """A file that is not there yet: another run may have begun within the same second."""
    path, number = directory / f"{name}.yaml", 1
    while path.exists():
        number += 1
        path = directory / f"{name}-{number}.yaml"
    return path
