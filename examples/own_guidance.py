"""Your own guidance as a coroutine: chase a moving point in wind, by accelerations alone.

This code commands an acceleration at each attitude sample; the vehicle follows with its known
linear response. If this code stalls or raises, the program holds the vehicle and hands it back. On
a real vehicle: `companion.connect("configs/px4.yaml")` and `companion.run`.

Run: python examples/own_guidance.py
"""

from math import cos, hypot, sin

from companion.config.files import load, shipped
from companion.testing import MockVehicle, connect, run

PX4 = shipped("mock-px4.yaml")
mock = MockVehicle(config=PX4, wind={"speed_m_s": 3.0, "from_deg": 90.0})
POSITION_GAIN, VELOCITY_GAIN = 2.0, 2.6  # 1/s², 1/s
RADIUS, TURN = 3.0, 0.4  # m, rad/s: the point moves at 1.2 m/s


async def main() -> None:
    async with connect(load(PX4), mock) as vehicle:
        await vehicle.take_off()
        begin = vehicle.state
        n0, e0, down = begin.position_ned
        async with vehicle.control() as control:
            async for state in control.states(seconds=12.0):
                t = state.time - begin.time
                c, s = RADIUS * cos(TURN * t), RADIUS * sin(TURN * t)
                (n, e, d), (vn, ve, vd) = state.position_ned, state.velocity_ned
                n_off, e_off, d_off = n0 + c - n, e0 + s - e, down - d
                north = POSITION_GAIN * n_off + VELOCITY_GAIN * (-TURN * s - vn) - TURN**2 * c
                east = POSITION_GAIN * e_off + VELOCITY_GAIN * (TURN * c - ve) - TURN**2 * s
                control.accelerate((north, east, POSITION_GAIN * d_off - VELOCITY_GAIN * vd))
        print(f"{hypot(n_off, e_off):.2f} m behind the point, {abs(d_off):.2f} m in height")
        await vehicle.land()


run(mock, main())
print(f"landed: {not mock.state()['armed']}")
