"""Survey a field in lanes: one smooth trajectory through all corners, checked before it is flown.

On a real vehicle: `connect("configs/px4.yaml")` and `run` of `companion`, not `companion.testing`.

Run: python examples/waypoint_survey.py
"""

import numpy as np

from companion.config.files import load, shipped
from companion.files.yaml_file import ConfigError
from companion.guidance.trajectory import waypoints
from companion.testing import MockVehicle, connect, run

LENGTH, LANES, APART, PX4 = 6.0, 3, 2.0, shipped("mock-px4.yaml")  # m
mock = MockVehicle(config=PX4)
corners = [(LENGTH, 0.0, 0.0)]
for lane in range(1, LANES):
    begin, end = (LENGTH, 0.0) if lane % 2 else (0.0, LENGTH)
    corners += [(begin, APART * lane, 0.0), (end, APART * lane, 0.0)]


async def main() -> None:
    async with connect(load(PX4), mock) as vehicle:
        await vehicle.take_off()
        home = vehicle.state.position_ned
        for speed in (12.0, 3.0):
            survey = waypoints(corners, speed, acceleration=speed)
            try:
                await vehicle.follow(survey)
                print(f"{len(corners)} corners in {survey.duration:.0f} s at up to {speed:g} m/s")
            except ConfigError as refusal:
                print(f"refused: {refusal}")
        await vehicle.go_to(home, speed=4.0)
        left = np.subtract(home, vehicle.state.position_ned)
        print(f"back, {np.linalg.norm(left):.2f} m from where it began")
        await vehicle.land()


run(mock, main())
