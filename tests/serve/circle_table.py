"""The circle of docs/serve.md in memory: `python -m tests.serve.circle_table [SPEED]`.

One program streams a circle of 5 m at 5 m/s, or at SPEED, 50 setpoints a second. Directly means
that `serve` passes the setpoints on (`serve.control: false`), so the mock autopilot flies them
itself.
"""

import math
import sys

from tests.serve.offboard_scene import on_circle
from tests.serve.virtual import (
    ALL,
    POSITION,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    served,
    stream,
)

WINDS = {
    "no wind": {},
    "2 m/s of wind": {"speed_m_s": 2.0, "from_deg": 40.0},
    "2 m/s of wind with gusts (0.7 m/s)": {"speed_m_s": 2.0, "from_deg": 40.0, "gust_m_s": 0.7},
}
_SETTLED = 5.0
_SECONDS = 20.0


def circle_rms(autopilot, *, control, wind, speed=5.0):
    """RMS of the true horizontal distance from the setpoints at the full `speed` (m/s), m."""
    vehicle = mock(autopilot, full_rate=True, wind=WINDS[wind])
    squares = []

    async def scene(session):
        await airborne(session, vehicle, autopilot)
        script = MemoryClient().connect(session)
        start = vehicle.state()["position"]
        await begin(session, script, autopilot, start, control)

        def send(time):
            commanded = on_circle(time, start, speed)
            script.local(ALL, *commanded)
            if time > _SETTLED:
                true = vehicle.state()["position"]
                squares.append(math.dist(true[:2], commanded[0][:2]) ** 2)

        await stream(_SECONDS, send)

    served(vehicle, autopilot, scene, control=control)
    return math.sqrt(sum(squares) / len(squares))


async def begin(session, script, autopilot, start, control):
    """The autopilot follows the script's setpoints, and holds the start."""
    if control:
        await begin_control(session, script, autopilot, lambda _: script.local(ALL, start))
    else:
        await stream(1.0, lambda _: script.local(POSITION, start))
        if autopilot == "px4":
            script.command(176, 1, 6, 0)
        await stream(2.0, lambda _: script.local(POSITION, start))


def main(speed):
    print("| | direct (the autopilot's own control) | through us |\n|---|---|---|")
    for autopilot, name in (("px4", "PX4"), ("ardupilot", "ArduPilot")):
        for wind in WINDS:
            direct, ours = (
                circle_rms(autopilot, control=control, wind=wind, speed=speed)
                for control in (False, True)
            )
            print(f"| {name}, {wind} | {direct:.2f} m | {ours:.2f} m |", flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
