"""Fly from Python: connect, take off, follow trajectories, or command from a coroutine.

    async def main() -> None:
        async with companion.connect("configs/mock-px4.yaml", arm=True) as vehicle:
            await vehicle.take_off()
            await vehicle.go_to((5.0, 0.0, -5.0), speed=3.0)
            async with vehicle.control() as control:
                async for state in control.states(seconds=10.0):
                    north, east, _ = state.velocity_ned
                    control.accelerate((-north, -east, 0.0))
            await vehicle.land()

    companion.run(main())

The same checks, limits, fence and safety monitors hold as in `companion fly`. `help(companion)`
lists the names.
"""

# Without `__all__`: see `companion.attitude`.
from companion.api.connection import connect as connect
from companion.api.connection import run as run
from companion.api.control import Control as Control
from companion.api.state import State as State
from companion.api.vehicle import Vehicle as Vehicle
from companion.attitude import Coefficients as Coefficients
from companion.guidance.reference import Reference as Reference
from companion.safety.actions import FlightEnded as FlightEnded
