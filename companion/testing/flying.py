"""Flies a configuration against a mock vehicle in memory."""

import asyncio
from collections.abc import AsyncGenerator, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

from companion.api.connection import Configuration, as_config, connect_configured
from companion.api.vehicle import Vehicle
from companion.config import Config
from companion.config.files import changed
from companion.files.yaml_file import ConfigError
from companion.flight.environment import Environment
from companion.flight.flight import AskLanding
from companion.flight.observer import Observer, SilentObserver, decline_landing
from companion.flight.session import Session
from companion.realtime import no_garbage_collection
from companion.recording.measurements.summary import Summary
from companion.testing.vehicle import MockVehicle
from companion.testing.virtual_loop import VirtualClock, VirtualEventLoop
from companion.testing.wire import open_wire, wire_to

T = TypeVar("T")


class UnhandledError(RuntimeError):
    """A task or callback of the program failed, and the program did not handle the error."""


def run(vehicle: MockVehicle, main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine on the vehicle's clock, like `asyncio.run` on the wall clock.

    Inside it, `Link(settings, opener=open_wire)` opens the companion link; `settings.lockstep` must
    match the vehicle.

    Raises:
        KeyboardInterrupt: Ctrl-C came, even if the flight then ended and returned.
        UnhandledError: a task or callback failed, and the error was not handled.
        ValueError: `main` is no coroutine.
    """
    unhandled: list[dict[str, Any]] = []

    def make_loop() -> VirtualEventLoop:
        clock = VirtualClock(vehicle.time)
        return VirtualEventLoop(clock, wire_to(vehicle, clock))

    if not asyncio.iscoroutine(main):
        raise ValueError(f"a coroutine was expected, as in run(vehicle, main()), not {main!r}")
    # Garbage collection costs 7 % of a flight's time.
    with no_garbage_collection(), asyncio.Runner(loop_factory=make_loop) as runner:
        runner.get_loop().set_exception_handler(lambda _, context: unhandled.append(context))
        result = runner.run(_result_unless_interrupted(main))
    if unhandled:
        raise UnhandledError(unhandled[0]["message"]) from unhandled[0].get("exception")
    return result


async def _result_unless_interrupted(main: Coroutine[Any, Any, T]) -> T:
    """Return the result of `main`; raise CancelledError if Ctrl-C came meanwhile.

    After Ctrl-C a flight ends and returns normally. Without CancelledError, a campaign or a test
    would go on with the next flight. `asyncio.Runner` converts CancelledError to KeyboardInterrupt.
    """
    result = await main
    task = asyncio.current_task()
    if task is not None and task.cancelling():
        raise asyncio.CancelledError
    return result


def _loop_time_ns() -> int:
    return round(asyncio.get_running_loop().time() * 1e9)


environment = Environment(open_wire, _loop_time_ns, realtime=False)
"""Environment of a flight inside `run`; latencies are 0: time stands still while code runs."""


def session(
    config: Configuration,
    vehicle: MockVehicle,
    folder: Path | str | None = None,
    observer: Observer | None = None,
    ask_landing: AskLanding | None = None,
) -> Session:
    """A session to be flown inside `run`; the arguments are those of `fly`.

    `link.endpoint` and `realtime` have no effect, and `link.lockstep` is set to match the vehicle.
    `Session.interrupt` acts like Ctrl-C, and `Session.leave` like a second Ctrl-C.

    Raises:
        ConfigError: the configuration is wrong.
    """
    flown_config = config_in_memory(config, vehicle)
    return Session(
        flown_config,
        _make_folder(folder),
        observer or SilentObserver(),
        ask_landing or decline_landing,
        environment=environment,
    )


def fly(
    config: Configuration,
    vehicle: MockVehicle,
    folder: Path | str | None = None,
    observer: Observer | None = None,
    ask_landing: AskLanding | None = None,
) -> Summary:
    """Fly once in vehicle time, like `companion fly`.

    Args:
        config: configuration of the flight.
        vehicle: the vehicle that is flown; it keeps its state after the flight.
        folder: folder for the files of the flight; None: nothing is written.
        observer: receives phases and events as they happen.
        ask_landing: asks the user after an interrupt whether to land; by default the answer is no.

    Returns:
        The content of `companion fly --json`, as an object.

    Raises:
        ConfigError: the configuration is wrong, or a maneuver cannot be flown.
        LinkError: the link cannot do what the configuration demands.
        OSError: the folder cannot be written.
        UnhandledError: a task or callback failed, and the error was not handled.
    """
    return run(vehicle, session(config, vehicle, folder, observer, ask_landing).fly())


@asynccontextmanager
async def connect(
    config: Configuration,
    vehicle: MockVehicle,
    folder: Path | str | None = None,
    observer: Observer | None = None,
) -> AsyncGenerator[Vehicle, None]:
    """Like `companion.connect`, for a mock vehicle in memory, inside `run`.

    `vehicle` was passed to `run`; the other arguments are those of `fly`.

    Raises:
        ConfigError: the configuration is wrong.
        FlightEnded, LinkError, OSError: see `companion.connect`.
        RuntimeError: this function was called outside `run`.
    """
    if not isinstance(asyncio.get_running_loop(), VirtualEventLoop):
        raise RuntimeError(
            "call `connect` inside `run(vehicle, main())`: it needs the event loop of `run`"
        )
    flown_config = config_in_memory(config, vehicle)
    async with connect_configured(
        flown_config, _make_folder(folder), observer, environment
    ) as connected:
        yield connected


def _make_folder(folder: Path | str | None) -> Path | None:
    """The folder of a flight, made if it does not exist."""
    if folder is None:
        return None
    path = Path(folder)
    path.mkdir(parents=True, exist_ok=True)
    return path


def config_in_memory(configuration: Configuration, vehicle: MockVehicle) -> Config:
    """The configuration for a mock vehicle in this process; lockstep is set to match the vehicle.

    Raises:
        ConfigError: the configuration is wrong, or its link cannot reach a mock vehicle in this
            process.
    """
    config = as_config(configuration)
    if config.link.backend != "direct":
        raise ConfigError(
            f"link.backend {config.link.backend} cannot reach a mock vehicle in this process; "
            "set it to direct"
        )
    if config.link.lockstep != vehicle.in_lockstep:
        return changed(config, {"link": {"lockstep": vehicle.in_lockstep}}, "the vehicle")
    return config
