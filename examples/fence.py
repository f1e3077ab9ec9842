"""See the fence hold: your code flies north at 4 m/s, and the program stops it within 8 m.

The fence limits all guidance, your own as well. The program brakes early enough to stop inside and
then lands the vehicle (docs/safety.md). The autopilot's own fence should be larger.

Run: python examples/fence.py
"""

from companion.api import FlightEnded
from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, connect, run

PX4 = shipped("mock-px4.yaml")
mock = MockVehicle(config=PX4)
fenced = changed(load(PX4), {"limits": {"fence_radius_m": 8.0}}, "a small fence")
SPEED, GAIN = 4.0, 2.0  # m/s, 1/s


async def main() -> None:
    async with connect(fenced, mock) as vehicle:
        await vehicle.take_off()
        print(f"control began {vehicle.state.position_ned[0]:z.1f} m north")
        async with vehicle.control() as control:
            async for state in control.states(seconds=20.0):
                north, east, down = state.velocity_ned
                control.accelerate((GAIN * (SPEED - north), -GAIN * east, -GAIN * down))


try:
    run(mock, main())
except FlightEnded as ended:
    print(ended)
state = mock.state()
print(f"landed: {not state['armed']}, {state['position'][0]:.1f} m north")
