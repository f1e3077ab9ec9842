"""What an offboard program of MAVSDK does, for both of its Python packages.

The program connects, reads health and a parameter, arms, takes off, flies every kind of setpoint
and a circle, and lands. `mavsdk_native.py` and `mavsdk_grpc_program.py` fill it in.
"""

import asyncio
import json
import math
import sys
import time

RADIUS = SPEED = 5.0
RAMP = 3.0
_HOW = {"ground": "from_ground", "loses": "loses", "circle": "only_circle"}


async def first(stream, condition):
    async for item in stream:
        if condition(item):
            return item
    raise RuntimeError("the stream ended")


def on_circle(now, start, speed=SPEED):
    """Position, velocity and acceleration NED on a circle that begins at rest at `start`."""
    rate = speed / RADIUS
    if now < RAMP:
        angle, turning, change = 0.5 * rate * now**2 / RAMP, rate * now / RAMP, rate / RAMP
    else:
        angle, turning, change = rate * (now - 0.5 * RAMP), rate, 0.0
    c, s = math.cos(angle), math.sin(angle)
    return (
        (start[0] - RADIUS + RADIUS * c, start[1] + RADIUS * s, start[2]),
        (-RADIUS * turning * s, RADIUS * turning * c, 0.0),
        (-RADIUS * (turning**2 * c + change * s), RADIUS * (change * c - turning**2 * s), 0.0),
    )


class Program:
    """One package's way to say each thing; places and speeds NED, m and m/s.

    Attributes:
        refusal: the package's exception for a refused command.
        place, speed: the newest by telemetry, or None.
        wanted: (time.monotonic() s, north m, east m) of each setpoint of the circle at full speed.
    """

    place = speed = None

    def __init__(self):
        self.wanted = []

    async def settle(self, wanted, seconds):
        """How far the vehicle is from a place after some seconds."""
        await self.position(*wanted)
        await asyncio.sleep(seconds)
        return math.dist(self.place, wanted)

    async def circle(self, start, seconds):
        """Stream a circle at 50 Hz; RMS distance at full speed as telemetry tells it, m."""
        began, errors = time.monotonic(), []
        while (now := time.monotonic() - began) < seconds:
            wanted, velocity, acceleration = on_circle(now, start)
            await self.position_velocity_acceleration(wanted, velocity, acceleration)
            if now > RAMP + 2.0:
                errors.append(math.dist(self.place, wanted))
                self.wanted.append((began + now, *wanted[:2]))
            await asyncio.sleep(max(0.0, 0.02 - (time.monotonic() - began - now)))
        return math.sqrt(sum(error**2 for error in errors) / len(errors))

    async def ramp(self, start, seconds, speed=1.0):
        """Stream position and velocity along a line to the south; the largest distance, m."""
        began, errors = time.monotonic(), [0.0]
        while (now := time.monotonic() - began) < seconds:
            wanted = (start[0] - speed * now, start[1], start[2])
            await self.position_velocity(wanted, (-speed, 0.0, 0.0))
            if now > 2.0:
                errors.append(math.dist(self.place, wanted))
            await asyncio.sleep(0.02)
        return max(errors)

    async def takes_off(self, height):
        """Whether the autopilot arms and takes off; refused until it is ready."""
        try:
            await self.arm()
            await self.take_off(height)
        except self.refusal:
            return False
        return True

    async def starts_on_ground(self, height):
        """Arm, command a height, and ask for control: the vehicle takes off by itself."""
        while not self.place:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        try:
            await self.arm()
        except self.refusal:
            return False
        await self.position(*self.place[:2], -height)
        await self.start()
        await self.position(*self.place[:2], -height)
        return True

    async def loses_and_regains(self):
        """Another station takes the vehicle; then the program asks for it again."""
        print("TAKE IT", flush=True)
        await self.lost()
        await asyncio.sleep(2.0)
        await self.position(*self.place)
        await self.start()
        await self.position(*self.place)
        return await self.active()

    async def every_kind(self, start, hover, report):
        """Fly every kind of setpoint, and come back."""
        report["position"] = await self.settle((start[0] + 3.0, start[1], start[2]), 5.0)
        await self.velocity(-1.5, 0.0, 0.0)
        await asyncio.sleep(2.5)
        report["velocity"] = self.speed[0]
        await self.velocity_body(0.0, 0.0, 0.0)
        await asyncio.sleep(2.0)
        report["position_velocity"] = await self.ramp(self.place, 4.0)
        await self.velocity_body(0.0, 0.0, 0.0)
        await asyncio.sleep(1.5)
        await self.acceleration(0.5, 0.0, 0.0)
        await asyncio.sleep(2.0)
        report["acceleration"] = self.speed[0]
        await self.attitude(hover)
        await asyncio.sleep(1.0)
        report["back"] = await self.settle(start, 9.0)

    async def fly(self, hover, parameter, *, from_ground=False, loses=False, only_circle=False):
        """Fly; returns what was seen."""
        report = {"armable": await self.armable(), "parameter": await self.parameter(parameter)}
        async with asyncio.timeout(90.0):  # ArduPilot is ready after 40 s
            begin = self.starts_on_ground if from_ground else self.takes_off
            while not await begin(5.0):  # noqa: ASYNC110
                await asyncio.sleep(1.0)
        await self.climbed(4.6)
        await asyncio.sleep(3.0)
        start = self.place
        await self.position(*start)
        began = time.monotonic()
        if not from_ground:
            await self.start()
        report["start_s"] = time.monotonic() - began
        report["active"] = await self.active()
        if only_circle:
            report["back"] = await self.settle(start, 8.0)  # until it is surely in control
        else:
            await self.every_kind(start, hover, report)
        report["circle_rms_m"] = await self.circle(start, 12.0)
        await self.position(*self.place)
        report["still_active"] = await self.active()
        if loses:
            report["regained"] = await self.loses_and_regains()
            report["place"] = await self.settle(self.place, 8.0)
        await self.stop()
        await asyncio.sleep(1.0)
        await self.land()
        report["disarmed"], report["wanted"] = True, self.wanted
        return report


def main(run):
    """Run `run(endpoint, fly)`.

    The arguments are endpoint, hover thrust, parameter, and then some of `ground`, `loses` and
    `circle`.
    """
    endpoint, hover, parameter, *how = sys.argv[1:]

    def fly(program):
        return program.fly(float(hover), parameter, **{_HOW[each]: True for each in how})

    print("REPORT " + json.dumps(asyncio.run(run(endpoint, fly))), flush=True)
