"""A simple program on pymavlink: a loop with a blocking socket and the same control law.

The program has no offboard-loss checks, no thrust control and no recording.
"""

import socket
import sys

from pymavlink.dialects.v20 import common as dialect

from companion.attitude import Target
from companion.config import Config
from companion.control.inner_loop import planner

_RATES_AND_THRUST = 128  # ATTITUDE_TARGET_TYPEMASK: ignore the attitude
_HOVER_THRUST = 0.5


def main(port: int) -> None:
    """Answer each attitude sample with a setpoint until killed; `port`: UDP port to listen on."""
    law, target, mavlink = planner(Config()), Target(0.1, 0.0, 0.0), dialect.MAVLink(None, 1, 191)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp_socket:
        udp_socket.bind(("127.0.0.1", port))
        while True:
            data, sender = udp_socket.recvfrom(2048)
            for sample in mavlink.parse_buffer(data) or ():
                if sample.get_type() != "ATTITUDE_QUATERNION":
                    continue
                rates = law.rates((sample.q1, sample.q2, sample.q3, sample.q4), target, 0.004)
                setpoint = dialect.MAVLink_set_attitude_target_message(
                    sample.time_boot_ms,
                    1,
                    1,
                    _RATES_AND_THRUST,
                    [1, 0, 0, 0],
                    *rates,
                    _HOVER_THRUST,
                )
                udp_socket.sendto(setpoint.pack(mavlink), sender)


if __name__ == "__main__":
    main(int(sys.argv[1]))
