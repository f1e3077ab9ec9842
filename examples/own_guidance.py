"""Guide the vehicle by code of your own: fly a line, then come back by your own feedback.

The program answers each sample of state with an acceleration; the vehicle reaches it with its known
linear response, and checks, limits, fence and monitors stay as in `companion fly`. Here it flies
the mock vehicle in this process. On a real one, `companion.connect("my.yaml")` replaces
`connect(...)` and `companion.run(main())` replaces the last line (docs/python.md).

Run: python examples/own_guidance.py
"""

from math import hypot

from companion.config.files import load, shipped
from companion.testing import MockVehicle, connect, run

PX4 = shipped("mock-px4.yaml")
mock = MockVehicle(config=PX4)


async def main() -> None:
    """Fly 6 m to the north, and come back."""
    async with connect(load(PX4), mock) as vehicle:
        await vehicle.take_off()
        north, east, down = vehicle.state.position_ned
        await vehicle.go_to((north + 6.0, east, down), speed=3.0)
        async with vehicle.control() as control:
            async for state in control.states(seconds=6.0):
                target = north, east, down  # back to where it began, critically damped
                place = zip(target, state.position_ned, state.velocity_ned, strict=True)
                control.accelerate(tuple(2.25 * (to - at) - 3.0 * speed for to, at, speed in place))
        n, e, _ = vehicle.state.position_ned
        print(f"after 6 s it is {hypot(n - north, e - east):.2f} m from where it began")
        await vehicle.land()


run(mock, main())
print(f"landed: {mock.state()['landed']}, setpoints received: {len(mock.setpoints)}")
