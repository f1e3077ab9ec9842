"""Sets parameters: asks for each, writes the old value to an undo file, sets it, reads it back."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from datetime import UTC, datetime
from enum import Enum
from math import isclose
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from companion.files import bounded_yaml
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError, Section
from companion.mavlink.errors import LinkError, ParameterError
from companion.preflight.evidence import Identity
from companion.preflight.finding import Finding, ParameterChange
from companion.vehicle.link import Link

ShortText = Annotated[str, Field(max_length=100)]
LARGEST_FLOAT32 = 3.4028234e38
"""Largest finite 32-bit float, the type of the value in PARAM_SET."""


class UndoContents(Section):
    """Contents of an undo file: the old values and their vehicle."""

    autopilot: ShortText
    """Autopilot of the vehicle, by name."""
    system: Annotated[int, Field(ge=1, le=255)]
    """The vehicle's system id."""
    uid: ShortText | None
    """Hardware id of AUTOPILOT_VERSION; null: not received."""
    time: ShortText
    """Time when `doctor --fix` began to propose changes, UTC."""
    parameters: dict[ShortText, Annotated[float, Field(ge=-LARGEST_FLOAT32, le=LARGEST_FLOAT32)]]
    """Old value of each parameter, in the order in which they were set."""

    def matches_vehicle(self, link: Link, identity: Identity) -> bool:
        """Whether the vehicle on the link is the one whose parameters were changed.

        Hardware ids are compared only if the undo file and the vehicle both have one.
        """
        same_hardware = None in (self.uid, identity.uid) or self.uid == identity.uid
        vehicle = link.autopilot.name, link.settings.target_system
        return same_hardware and (self.autopilot, self.system) == vehicle


class UndoFile:
    """The undo file: stores each parameter's old value before that parameter is set.

    Args:
        directory: folder for the file.

    Attributes:
        path: the file; it does not exist before the first `add`.
    """

    def __init__(self, directory: Path, link: Link, identity: Identity) -> None:
        start_time = datetime.now(UTC)
        self.path = _unused_path(directory, f"doctor-undo-{start_time:%Y-%m-%dT%H-%M-%SZ}")
        self._undo = UndoContents(
            autopilot=link.autopilot.name,
            system=link.settings.target_system,
            uid=identity.uid,
            time=start_time.isoformat(timespec="seconds"),
            parameters={},
        )

    def add(self, parameter: str, old_value: float) -> None:
        """Write a parameter's old value to the file, unless the file already holds one for it.

        Raises:
            ConfigError: the file cannot be written, so no parameter must be set.
        """
        old_values = dict(self._undo.parameters)
        old_values.setdefault(parameter, old_value)
        self._undo = self._undo.model_copy(update={"parameters": old_values})
        text = bounded_yaml.dump(self._undo.model_dump())
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self.path, text)
        except OSError as error:
            raise ConfigError(
                f"recording.directory: the undo file {self.path} cannot be written, so nothing "
                f"more is set: {error.strerror}"
            ) from error


def _unused_path(directory: Path, name: str) -> Path:
    """The path `name`.yaml; a number is added if another run already made a file of this name."""
    path, number = directory / f"{name}.yaml", 1
    while path.exists():
        number += 1
        path = directory / f"{name}-{number}.yaml"
    return path


_FLOAT32_RESOLUTION = 1e-6
"""Relative resolution of a single-precision parameter."""
_MAX_HEARTBEAT_AGE = 3.0
"""Largest age of a heartbeat that still tells whether the vehicle is armed, s."""


class Answer(Enum):
    """The user's answer to a proposed change."""

    YES = "yes"
    NO = "no"
    ALL = "all"
    QUIT = "quit"


AskUser = Callable[[Finding], Awaitable[Answer]]


class ChangeOutcome(NamedTuple):
    """Whether a parameter change was made, and why not."""

    change: ParameterChange
    refusal: str = ""
    """Why the change was not made; empty if it was made."""


class VehicleArmedError(LinkError):
    """The vehicle is armed or may be armed, so no parameter is set."""


async def apply_fixes(
    link: Link,
    findings: Iterable[Finding],
    ask: AskUser,
    undo: UndoFile,
    report: Callable[[ChangeOutcome], None],
) -> None:
    """Propose each change, and make those that the user accepts.

    Args:
        link: link to the vehicle.
        findings: the findings; those without a change are skipped.
        ask: asks the user before each change, until the answer is ALL.
        undo: stores the old value before it is overwritten.
        report: called with the outcome of each accepted change.

    Raises:
        VehicleArmedError: the vehicle is armed or may be armed; nothing more was set.
        ConfigError: the undo file cannot be written; nothing more was set.
        LinkLost: the connection was lost.
    """
    answer = Answer.NO
    for finding in findings:
        change = finding.change
        if change is None:
            continue
        if answer is not Answer.ALL:
            answer = await ask(finding)
        if answer is Answer.QUIT:
            return
        if answer is Answer.NO:
            continue
        require_disarmed(link)
        undo.add(change.parameter, change.old)
        report(await _set_and_read_back(link, change))


async def restore(link: Link, undo: UndoContents, report: Callable[[ChangeOutcome], None]) -> None:
    """Restore the values of the undo file, the last change first.

    `report`: called with the outcome of each parameter.

    Raises:
        VehicleArmedError: the vehicle is armed or may be armed; nothing more was set.
        LinkLost: the connection was lost.
    """
    for parameter, old_value in reversed(undo.parameters.items()):
        require_disarmed(link)
        try:
            present_value = float(await link.read_parameter(parameter))
        except ParameterError as error:
            report(
                ChangeOutcome(
                    ParameterChange(parameter, old_value, old_value, reboot=False), str(error)
                )
            )
            continue
        report(
            await _set_and_read_back(
                link, ParameterChange(parameter, present_value, old_value, reboot=False)
            )
        )


def require_disarmed(link: Link) -> None:
    """Raise unless the vehicle is known to be disarmed.

    Raises:
        VehicleArmedError: the vehicle is armed, or its last heartbeat is too old.
    """
    heartbeat, now = link.state.heartbeat, asyncio.get_running_loop().time()
    if heartbeat is None or now - heartbeat.received > _MAX_HEARTBEAT_AGE:
        raise VehicleArmedError(
            "no heartbeat any more, so it is not known whether the vehicle is armed; "
            "no more parameters are set"
        )
    if heartbeat.armed:
        raise VehicleArmedError(
            "the vehicle is armed, and parameters are set only while it is disarmed; "
            "land and disarm it first"
        )


async def _set_and_read_back(link: Link, change: ParameterChange) -> ChangeOutcome:
    """Set a parameter and read it back. Raises `LinkLost`."""
    try:
        await link.write_parameter(change.parameter, change.new)
        value_read = await link.read_parameter(change.parameter)
    except ParameterError as error:
        return ChangeOutcome(change, str(error))
    if isclose(value_read, change.new, rel_tol=_FLOAT32_RESOLUTION, abs_tol=_FLOAT32_RESOLUTION):
        return ChangeOutcome(change)
    return ChangeOutcome(
        change,
        f"{change.parameter}: {value_read:g} was read back instead of {change.new:g}; "
        "set it with a ground station, and check again",
    )
