"""A policy shaped like a learned one: observations in, body rates out, 50 times a second.

The network here is one linear layer, fitted below to a hand-written controller; use your own
weights instead. The program limits its rates and holds the height; the safety monitors are active.

Run: python examples/learned_policy.py
"""

import asyncio

import numpy as np

from companion.attitude import BodyRates, coefficients
from companion.config.files import load, shipped
from companion.testing import MockVehicle, connect, run

rng = np.random.default_rng(1)
observed = rng.normal(size=(2000, 6)) * (2.0, 2.0, 1.0, 1.0, 0.2, 0.2)  # error, velocity, tilt
wanted = np.clip(0.08 * observed[:, :2] - 0.13 * observed[:, 2:4], -0.35, 0.35) - observed[:, 4:]
weights, *_ = np.linalg.lstsq(observed, 4.0 * wanted[:, ::-1] * (1.0, -1.0), rcond=None)
mock = MockVehicle(config=shipped("mock-px4.yaml"))


async def main() -> None:
    async with connect(load(shipped("mock-px4.yaml")), mock) as vehicle:
        await vehicle.take_off()
        goal = np.add(vehicle.state.position_ned[:2], (3.0, -2.0))
        async with vehicle.control("the policy") as control:
            for _ in range(600):
                state = control.state
                error = goal - state.position_ned[:2]
                seen = np.concatenate((error, state.velocity_ned[:2], coefficients(state.q)))
                roll, pitch = (seen @ weights).tolist()
                control.rotate(BodyRates(roll, pitch, -state.heading))
                await asyncio.sleep(0.02)
        print(f"{np.hypot(*error):.2f} m from the goal")
        await vehicle.land()


run(mock, main())
