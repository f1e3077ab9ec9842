"""Companion computer for MAVLink: sends body rates for a linear horizontal acceleration.

    async def main() -> None:
        async with companion.connect("configs/mock-px4.yaml", arm=True) as vehicle:
            await vehicle.take_off()
            await vehicle.go_to((5.0, 0.0, -5.0), speed=3.0)
            await vehicle.land()

    companion.run(main())

Each name below has its own page: `help(companion.connect)`.

Fly from Python
    connect       connects, runs the preflight checks, and gives a `Vehicle`
    run           runs a program, like `asyncio.run`
    Vehicle       take_off, go_to, follow, hold, control, land, hand_back; `state` and `summary`
    Control       what a coroutine commands: accelerate, follow, tilt, rotate
    State         time, position, velocity, attitude, body rates, heading, height
    Reference     desired position, velocity and acceleration
    Coefficients  north, east: horizontal acceleration per specific thrust
    FlightEnded   raised when the flight has ended, so that the program controls nothing

Packages
    companion.attitude, companion.batch, companion.guidance.trajectory, companion.identification,
    companion.testing
"""

from typing import TYPE_CHECKING

# There is no `__all__`, for the reason given in `companion.attitude`. A name is imported only when
# it is used, so that the command line starts quickly.
if TYPE_CHECKING:
    from companion.api import Coefficients as Coefficients
    from companion.api import Control as Control
    from companion.api import FlightEnded as FlightEnded
    from companion.api import Reference as Reference
    from companion.api import State as State
    from companion.api import Vehicle as Vehicle
    from companion.api import connect as connect
    from companion.api import run as run

_PUBLIC_NAMES = (
    "Coefficients",
    "Control",
    "FlightEnded",
    "Reference",
    "State",
    "Vehicle",
    "connect",
    "run",
)


def __getattr__(name: str) -> object:
    """Import one of the public names when a program first uses it."""
    if name not in _PUBLIC_NAMES:
        raise AttributeError(f"module 'companion' has no attribute {name!r}")
    from companion import api  # noqa: PLC0415  takes a quarter of a second

    return getattr(api, name)


def __dir__() -> list[str]:
    """All names, also those not imported yet, so that an interactive Python completes them."""
    return sorted({*globals(), *_PUBLIC_NAMES})
