"""Connect a program to a vehicle, and run it."""

import asyncio
from collections.abc import AsyncGenerator, Coroutine, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from companion.api.program import Program, ended_by
from companion.api.vehicle import Vehicle
from companion.config import Config
from companion.config.files import changed, load
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.flight.observer import Observer, Silent, decline_landing
from companion.flight.session import Session
from companion.mavlink import lockstep, loop
from companion.recording.folder import flight_folder
from companion.safety.actions import FlightEnded

T = TypeVar("T")


@asynccontextmanager
async def connect(
    config: Config | Path | str,
    *,
    endpoint: str | None = None,
    arm: bool | None = None,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    folder: Path | None = None,
    observer: Observer | None = None,
) -> AsyncGenerator[Vehicle, None]:
    """Connect, check the vehicle, and give it to the block; record the flight meanwhile.

    When the block ends in the air, the vehicle is handed back: the autopilot holds it.

    Args:
        config: of the flight, or its file.
        endpoint: instead of `link.endpoint`.
        arm: instead of `flight.arm`: whether `Vehicle.take_off` arms, or the pilot does.
        changes: further keys by section, as `{"limits": {"max_tilt_deg": 20}}`.
        folder: an existing folder for the records; None: a new one in `recording.directory`.
        observer: is told of phases and events.

    Raises:
        ConfigError: the configuration is wrong.
        FlightEnded: the vehicle did not pass the checks, or the flight ended early.
        LinkError: the link could not be opened; nothing was sent.
        OSError: the folder cannot be written; nothing was sent.
    """
    told = load(Path(config)) if isinstance(config, Path | str) else config
    own: dict[str, dict[str, Any]] = {"link": {}, "flight": {}}
    if endpoint is not None:
        own["link"]["endpoint"] = endpoint
    if arm is not None:
        own["flight"]["arm"] = arm
    told = changed(changed(told, changes or {}, "changes"), own, "connect")
    async with flying(told, folder or flight_folder(told.recording.directory), observer) as vehicle:
        yield vehicle


@asynccontextmanager
async def flying(
    config: Config,
    folder: Path | None,
    observer: Observer | None = None,
    environment: Environment = THIS_COMPUTER,
) -> AsyncGenerator[Vehicle, None]:
    """As `connect`, with a configuration as it is; without a folder nothing is recorded."""
    program = Program()
    session = Session(config, folder, observer or Silent(), decline_landing, program, environment)
    program.interrupt = session.interrupt
    flight = asyncio.create_task(_fly(session, program))
    try:
        try:
            vehicle = Vehicle(program, await asyncio.shield(program.connected))
        except asyncio.CancelledError:
            if not session.interrupt("the program was cancelled"):
                flight.cancel()
            raise
        try:
            yield vehicle
        except BaseException as error:
            session.note(f"the program raised {error!r}")
            with suppress(FlightEnded):
                await _leave(vehicle, program)
            raise
        await _leave(vehicle, program)
    finally:
        await asyncio.wait({flight})
    flight.result()


def run(main: Coroutine[Any, Any, T], *, in_lockstep: bool = False) -> T:
    """Like `asyncio.run`, on the event loop that answers samples the fastest.

    Args:
        main: the program.
        in_lockstep: in the vehicle's time, for a vehicle in lockstep (`link.lockstep`).
    """
    return (lockstep.run if in_lockstep else loop.run)(main)


async def _leave(vehicle: Vehicle, program: Program) -> None:
    """End the flight, even if the program is cancelled meanwhile."""
    if program.busy:
        program.interrupt("the program ended before what it had asked for")
    elif not program.over:
        await asyncio.shield(asyncio.create_task(vehicle.leave()))


async def _fly(session: Session, program: Program) -> None:
    """Fly, and tell the program why the flight has ended."""
    try:
        summary = await session.fly()
    except Exception as error:
        program.end(error)
        raise
    program.summary = summary
    program.end(ended_by(summary.result))
