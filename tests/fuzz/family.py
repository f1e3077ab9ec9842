"""What the autopilots' modes are called on the wire."""

from typing import NamedTuple

from companion.mavlink.messages import CRC_EXTRA

BRAKE = 17
TOLD_AT_ONCE = 436 in CRC_EXTRA
"""Whether the program listens to CURRENT_MODE, by which PX4 tells a mode at once."""
HOME_ALTITUDE = 500.0
"""Above mean sea level, m."""


class Family(NamedTuple):
    """Modes by what they are to a flight, and some that are none of ours."""

    autopilot: int
    takeoff: int
    ready: int
    offboard: int
    land: int
    foreign: tuple[int, ...]

    @property
    def is_ardupilot(self) -> bool:
        """Whether GUIDED is take-off and offboard at once."""
        return self.autopilot == 3

    @property
    def tells_mode(self) -> bool:
        """Whether CURRENT_MODE of it counts."""
        return TOLD_AT_ONCE and not self.is_ardupilot

    @property
    def ours(self) -> set[int]:
        """Modes that a flight may be in."""
        hold = {BRAKE} if self.is_ardupilot else set()
        return {self.takeoff, self.ready, self.offboard, self.land} | hold


PX4 = Family(12, 0x02040000, 0x03040000, 0x00060000, 0x06040000, (0x00030000, 0x05040000, 99))
ARDUPILOT = Family(3, 4, 4, 4, 9, (0, 5, 6, 250))
