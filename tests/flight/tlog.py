"""Reads a recorded flight: only the messages that a test asks for are decoded.

`mavutil` decodes every message, which takes as long as the flight. Each frame of a `.tlog` stands
behind 8 bytes with its time, µs (https://mavlink.io/en/guide/serialization.html).
"""

from pymavlink.dialects.v20 import ardupilotmega as dialect

_HEADER, _CHECKSUM, _SIGNATURE, _STAMP = 10, 2, 13, 8
_MAGIC = 0xFD


def messages(summary, *names):
    """The messages of these names in the flight's `.tlog`, each with its `_timestamp`, s."""
    data = (summary.log / "flight.tlog").read_bytes()
    wanted = {number for number, kind in dialect.mavlink_map.items() if kind.msgname in names}
    parser, at = dialect.MAVLink(None), 0
    while at < len(data):
        begin = at + _STAMP
        assert data[begin] == _MAGIC, f"no frame of MAVLink 2 at byte {begin}"
        length, flags = data[begin + 1], data[begin + 2]
        end = begin + _HEADER + length + _CHECKSUM + _SIGNATURE * (flags & 1)
        if int.from_bytes(data[begin + 7 : begin + _HEADER], "little") in wanted:
            message = parser.decode(bytearray(data[begin:end]))
            message._timestamp = int.from_bytes(data[at:begin], "big") / 1e6
            yield message
        at = end
