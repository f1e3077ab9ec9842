"""A second path for positions: it stands between the mock and the program, in vehicle time."""

from collections import deque

_ATTITUDE_QUATERNION, _LOCAL_POSITION_NED = 31, 32
_OVERHEAD = 12


class PositionRelay:
    """Passes all datagrams on; positions as `way` says.

    Attributes:
        way: "at once"; "late": by `delay_ms`; "twice": at once and late; "standing": the last one
            that came by another way, again and again.
        delay_ms: by the vehicle's clock, as its attitudes tell it.
    """

    def __init__(self, vehicle, way="at once", delay_ms=0):
        self.way, self.delay_ms = way, delay_ms
        self._held, self._last = deque(), None
        vehicle.to_companion = lambda data: [self._from_vehicle(data)]

    def _from_vehicle(self, data):
        """What to send now that these frames (of MAVLink 2, unsigned) came in one datagram."""
        sent = b""
        while data:
            end = _OVERHEAD + data[1]
            frame, data = data[:end], data[end:]
            message = int.from_bytes(frame[7:10], "little")
            stamp = int.from_bytes(frame[10:-2][:4], "little")  # zeros at the end are left out
            if message == _LOCAL_POSITION_NED:
                sent += self._position(stamp, frame)
                continue
            if message == _ATTITUDE_QUATERNION:
                while self._held and self._held[0][0] <= stamp:
                    sent += self._held.popleft()[1]
            sent += frame
        return sent

    def _position(self, stamp, frame):
        if self.way in ("late", "twice"):
            self._held.append((stamp + self.delay_ms, frame))
        if self.way == "standing":
            return self._last
        if self.way == "late":
            return b""
        self._last = frame
        return frame
