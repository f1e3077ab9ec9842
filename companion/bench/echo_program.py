"""The lower bound of latency: echoes each datagram at once, with the size of a setpoint.

The program blocks on its socket, and decodes and computes nothing. Python cannot be faster.
"""

import socket
import sys

_HEADER = bytes([0xFD, 39, 0, 0, 0, 1, 191, 82, 0, 0])  # the header of SET_ATTITUDE_TARGET
_PAYLOAD_END = bytes(35 + 2)  # the rest of its payload, and its checksum
_TIME_BOOT_MS = slice(10, 14)  # bytes of time_boot_ms, in a sample and in a setpoint


def main(port: int) -> None:
    """Answer each datagram until killed; `port`: UDP port to listen on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp_socket:
        udp_socket.bind(("127.0.0.1", port))
        while True:
            data, sender = udp_socket.recvfrom(2048)
            udp_socket.sendto(_HEADER + data[_TIME_BOOT_MS] + _PAYLOAD_END, sender)


if __name__ == "__main__":
    main(int(sys.argv[1]))
