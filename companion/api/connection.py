"""Connect a program to a vehicle, and run it."""

import asyncio
from collections.abc import AsyncGenerator, Coroutine, Mapping
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from companion.api.ctrl_c import on_ctrl_c
from companion.api.flight_loop import FlightLoop, flight_loop
from companion.api.program import (
    ProgramPlan,
    failure_text,
    flight_ended,
    mark_error_retrieved,
)
from companion.api.state import ConnectedFlight, NewestState
from companion.api.vehicle import Vehicle
from companion.config import Config
from companion.config.files import changed, load
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.flight.observer import Observer, SilentObserver, decline_landing
from companion.flight.phases import HAND_BACK
from companion.flight.session import Session
from companion.mavlink import lockstep, loop
from companion.recording.folder import flight_folder, make_named_folder
from companion.safety.actions import FlightEnded

T = TypeVar("T")

Configuration = Config | Path | str | Mapping[str, Mapping[str, Any]]
"""A configuration, the path of its file, or the keys by section that differ from the defaults."""


@asynccontextmanager
async def connect(
    config: Configuration,
    *,
    endpoint: str | None = None,
    arm: bool | None = None,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    folder: Path | str | None = None,
    observer: Observer | None = None,
) -> AsyncGenerator[Vehicle, None]:
    """Connect, run the preflight checks, and yield the vehicle; the flight is recorded meanwhile.

    The flight runs in a thread of its own; in lockstep it runs in the program's thread. When the
    block ends in the air, the vehicle is handed back: the autopilot holds it.

    Args:
        config: configuration of the flight, the path of its file, or the keys by section that
            differ from the defaults.
        endpoint: replaces `link.endpoint`.
        arm: replaces `flight.arm`. True: `Vehicle.take_off` arms. False: the pilot arms.
        changes: other keys to change, by section, such as `{"limits": {"max_tilt_deg": 20}}`.
        folder: folder for the records of this flight; None: a new one in `recording.directory`.
        observer: receives phases and events in the flight's thread; it must return at once.

    Raises:
        ConfigError: the configuration is wrong, or the folder holds a flight.
        FlightEnded: the vehicle did not pass the checks, or the flight ended early.
        LinkError: the link could not be opened; nothing was sent.
        OSError: the folder cannot be written; nothing was sent.
        RealtimeError: the system refused a required `realtime` setting; nothing was sent.
    """
    flown_config = as_config(config)
    overrides: dict[str, dict[str, Any]] = {
        "link": {} if endpoint is None else {"endpoint": endpoint},
        "flight": {} if arm is None else {"arm": arm},
    }
    flown_config = changed(changed(flown_config, changes or {}, "changes"), overrides, "connect")
    flown_folder = (
        flight_folder(flown_config.recording.directory)
        if folder is None
        else make_named_folder(Path(folder))
    )
    async with connect_configured(flown_config, flown_folder, observer) as vehicle:
        yield vehicle


def as_config(config: Configuration) -> Config:
    """Load the file, or add the defaults to the given keys; return a `Config` unchanged.

    Raises:
        ConfigError: the configuration is wrong.
        TypeError: `config` is not a `Configuration`.
    """
    if isinstance(config, Config):
        return config
    if isinstance(config, Mapping):
        return changed(Config(), config, "the configuration")
    if not isinstance(config, Path | str):
        raise TypeError(f"config must be a Config, a path or a dict of sections, not {config!r}")
    return load(Path(config))


@asynccontextmanager
async def connect_configured(
    config: Config,
    folder: Path | None,
    observer: Observer | None = None,
    environment: Environment = THIS_COMPUTER,
) -> AsyncGenerator[Vehicle, None]:
    """Like `connect`, with a complete configuration; without a folder nothing is recorded."""
    loop, cancelled_while_waiting = flight_loop(), False
    try:
        session, program = await loop.start(_make_session(config, folder, observer, environment))
        loop.register_end(partial(_end_lost_flight, session, program))
        flight = loop.start(_fly(session, program))
        flight.add_done_callback(mark_error_retrieved)
        try:
            with on_ctrl_c(loop, session.interrupt):
                async with _connected_vehicle(loop, session, program, flight) as vehicle:
                    yield vehicle
        finally:
            cancelled_while_waiting = True  # stays true if the wait is cancelled
            await asyncio.wait({flight})
            cancelled_while_waiting = False
        flight.result()
    finally:
        loop.close(wait=not cancelled_while_waiting)


@asynccontextmanager
async def _connected_vehicle(
    loop: FlightLoop, session: Session, program: ProgramPlan, flight: asyncio.Future[None]
) -> AsyncGenerator[Vehicle, None]:
    """The vehicle after the preflight checks; at the end of the block the flight ends."""
    try:
        connected = await loop.start(_wait_connected(loop, program))
    except asyncio.CancelledError:
        if not await loop.start(_interrupt(session, "the program was cancelled")):
            flight.cancel()
        raise
    try:
        yield Vehicle(connected)
    except BaseException as error:
        reason = failure_text("the program", error)
        with suppress(FlightEnded):
            await asyncio.shield(loop.start(_end_failed(session, program, reason)))
        raise
    await asyncio.shield(loop.start(_end_flight(program)))


def run(main: Coroutine[Any, Any, T], *, in_lockstep: bool = False) -> T:
    """Like `asyncio.run`, in the event loop that a flight needs.

    Unless `in_lockstep`, the garbage collector ignores all objects that exist already.

    Args:
        main: the program.
        in_lockstep: run on the vehicle's time, for a vehicle in lockstep (`link.lockstep`).

    Raises:
        RuntimeError: an event loop runs already, as in a notebook.
        ValueError: `main` is no coroutine.
    """
    if not asyncio.iscoroutine(main):
        raise ValueError(f"a coroutine was expected, as in companion.run(main()), not {main!r}")
    running_loop: asyncio.AbstractEventLoop | None = None
    with suppress(RuntimeError):
        running_loop = asyncio.get_running_loop()
    if running_loop is not None:
        main.close()
        raise RuntimeError(
            "an event loop runs here already, as in a notebook: "
            "write `await main()` instead of `companion.run(main())`"
        )
    return (lockstep.run if in_lockstep else loop.run)(main)


# The coroutines below run in the flight's loop.


async def _make_session(
    config: Config, folder: Path | None, observer: Observer | None, environment: Environment
) -> tuple[Session, ProgramPlan]:
    program = ProgramPlan()
    observer = observer or SilentObserver()
    session = Session(config, folder, observer, decline_landing, program, environment)
    program.interrupt = session.interrupt
    program.end_reason = lambda: session.end_reason
    return session, program


async def _fly(session: Session, program: ProgramPlan) -> None:
    """Fly, and tell the program why the flight has ended."""
    try:
        summary = await session.fly()
    except Exception as error:
        program.end(error)
        raise
    finally:
        program.finished.set()
    program.summary = summary
    program.end(flight_ended(summary.result))


async def _wait_connected(loop: FlightLoop, program: ProgramPlan) -> ConnectedFlight:
    context = await asyncio.shield(program.connected)
    return ConnectedFlight(program, context, NewestState(context, loop), loop)


async def _interrupt(session: Session, reason: str) -> bool:
    return session.interrupt(reason)


async def _end_failed(session: Session, program: ProgramPlan, reason: str) -> None:
    """End the flight after the program failed; `reason` becomes the result of the flight."""
    if program.is_over or program.end_error is not None:
        session.note(reason)
    else:
        program.interrupt(reason)


async def _end_flight(program: ProgramPlan) -> None:
    """End the flight: hand back in the air; on the ground leave the vehicle as it is."""
    if program.has_requests:
        program.interrupt("the program ended before its request was completed")
    elif not program.is_over:
        await program.request(
            lambda context: (HAND_BACK,) if context.loop.offboard_active else (), ends_flight=True
        )


async def _end_lost_flight(session: Session, program: ProgramPlan) -> None:
    """Hand the vehicle back if the program ended in flight; wait for the end of the flight."""
    if not program.finished.is_set() and session.interrupt("the program ended in flight"):
        await program.finished.wait()
