"""Fly a square with pymavlink through `companion serve`; on a PX4 itself only the address differs.

First, each in a terminal: `python -m sitl_mock`, `companion serve --config configs/mock-px4.yaml`
(extra `serve`). Run: python examples/pymavlink_offboard.py [udpout:127.0.0.1:14551]
"""

import sys
from math import dist, nan
from typing import Any

from pymavlink import mavutil

link = mavutil.mavlink_connection(sys.argv[1] if len(sys.argv) > 1 else "udpout:127.0.0.1:14551")


def receive(name: str, *command: float) -> Any:
    """Return the next message of this name; send a heartbeat and the COMMAND_LONG each second."""
    for _ in range(10):
        link.mav.heartbeat_send(mavutil.mavlink.MAV_TYPE_GCS, 8, 0, 0, 4)
        if command:
            link.mav.command_long_send(1, 1, command[0], 0, *command[1:], *[0] * (8 - len(command)))
        if message := link.recv_match(type=name, blocking=True, timeout=1.0):
            return message
    sys.exit(f"no {name} within 10 s: does `companion serve` run?")


while receive("COMMAND_ACK", 400, 1).result != 0:  # arming is refused until the vehicle is ready
    receive("HEARTBEAT")
goal = receive("GLOBAL_POSITION_INT").alt / 1e3 + 5.0  # take-off: 5 m up, m above sea level
receive("COMMAND_ACK", 22, 0, 0, 0, nan, nan, nan, goal)
while (start := receive("LOCAL_POSITION_NED")).z > -4.6:
    pass
for north, east in ((0, 0), (3, 0), (3, 3), (0, 3), (0, 0)):
    place = start.x + north, start.y + east, start.z
    link.mav.command_long_send(1, 1, 176, 0, 1, 6, 0, 0, 0, 0, 0)  # OFFBOARD: after the first 5 s
    for _ in range(250):  # positions at 50 Hz
        link.mav.set_position_target_local_ned_send(0, 1, 1, 1, 0x0DF8, *place, *[0] * 8)
        here = receive("LOCAL_POSITION_NED")
    print(f"{dist((here.x, here.y, here.z), place):.2f} m away from ({north}, {east})")
print("landing is accepted:", receive("COMMAND_ACK", 21).result == 0)
