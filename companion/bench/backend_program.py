"""Our own way of a sample with `link.backend: mavsdk`: MAVSDK carries it, and sends the setpoint.

MAVSDK stamps setpoints with its own clock, so the sample's stamp goes back in the yaw rate, as in
`companion.bench.mavsdk_program`.
"""

import sys
from math import radians

from companion.attitude import BodyRates
from companion.bench.companion_program import answer
from companion.bench.mavsdk_program import STAMP_MODULUS
from companion.mavlink import LinkSettings
from companion.mavlink import loop as link_loop
from companion.mavsdk_link.link import MavsdkLink

_PATIENCE_S = 30.0


async def fly(port: int) -> None:
    """Answer each sample until killed."""
    async with MavsdkLink(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")) as link:
        await link.wait_connected(_PATIENCE_S)

        def send(time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
            stamped = BodyRates(rates.roll, rates.pitch, radians(time_boot_ms % STAMP_MODULUS))
            return link.send_setpoint(time_boot_ms, stamped, thrust)

        await answer(link, send)


if __name__ == "__main__":
    link_loop.run(fly(int(sys.argv[1])))
