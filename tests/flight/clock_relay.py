"""Another clock: it stands between the mock and the program and changes the vehicle's stamps."""

from collections import deque

from fastcrc import crc16

from tests.flight.position_relay import PositionRelay

_ATTITUDE_QUATERNION = 31
_CRC_EXTRA = {_ATTITUDE_QUATERNION: 246, 32: 185}  # and LOCAL_POSITION_NED
_OVERHEAD = 12


class ClockRelay(PositionRelay):
    """Passes all datagrams on; attitude and position as told.

    Attributes:
        shift_ms: is added to the stamps; a uint32, as the vehicle's.
        outlier_ms: is added to the stamp of the next attitude alone.
        late_ms: attitudes come so much later, by the vehicle's clock.
    """

    def __init__(self, vehicle):
        super().__init__(vehicle)
        self.shift_ms = self.outlier_ms = self.late_ms = 0
        self._late = deque()

    def _from_vehicle(self, data):
        sent = b""
        while data:
            end = _OVERHEAD + data[1]
            frame, data = data[:end], data[end:]
            message = int.from_bytes(frame[7:10], "little")
            if message in _CRC_EXTRA:
                stamp = int.from_bytes(frame[10:14], "little")
                frame = self._stamped(frame, message, stamp)
                if message == _ATTITUDE_QUATERNION:
                    self._late.append((stamp + self.late_ms, frame))
                    frame = b""
                    while self._late and self._late[0][0] <= stamp:
                        frame += self._late.popleft()[1]
            sent += frame
        return sent

    def _stamped(self, frame, message, stamp):
        shift = self.shift_ms
        if message == _ATTITUDE_QUATERNION:
            shift, self.outlier_ms = shift + self.outlier_ms, 0
        if shift == 0:
            return frame
        told = ((stamp + shift) % 2**32).to_bytes(4, "little")
        body = frame[1:10] + told + frame[14:-2]
        crc = crc16.mcrf4xx(body + bytes([_CRC_EXTRA[message]]))
        return frame[:1] + body + crc.to_bytes(2, "little")
