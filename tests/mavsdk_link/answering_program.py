"""Answers each sample by way of MAVSDK, and gets into the trouble it is told on standard input."""

import asyncio
import ctypes
import sys
import time

from companion.attitude import BodyRates
from companion.mavlink import loop as link_loop
from companion.mavlink.settings import LinkSettings
from companion.mavsdk_link import MavsdkLink

TROUBLES = {
    "frozen loop": lambda: time.sleep(1.0),
    # PyDLL keeps the interpreter: no other thread of Python runs meanwhile.
    "held interpreter": lambda: ctypes.PyDLL(None).usleep(900_000),
}


async def answer(port: int) -> None:
    async with MavsdkLink(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")) as link:
        await link.wait_connected(20.0)
        await link.set_rates({"ATTITUDE_QUATERNION": 100.0}, window_s=0.1)
        link.on_attitude = lambda sample: link.send_setpoint(
            sample.time_boot_ms, BodyRates(0.1, -0.2, 0.3), 0.4
        )
        while trouble := await asyncio.to_thread(sys.stdin.readline):
            TROUBLES[trouble.strip()]()


if __name__ == "__main__":
    link_loop.run(answer(int(sys.argv[1])))
