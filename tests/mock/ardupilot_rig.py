"""The bench of `mock_rig` with ArduCopter on it, in GUIDED ways."""

from typing import Any

from mock_rig import ACCEPTED, Rig
from pymavlink.dialects.v20 import ardupilotmega

STABILIZE, ALT_HOLD, GUIDED, LOITER, RTL, LAND, BRAKE = 0, 2, 4, 5, 6, 9, 17
FAILED = 4
HOVER = 0.364
THRUST_AS_THRUST = {"GUID_OPTIONS": 8}
READY_S = 0.5
QUICK = {"WPNAV_SPEED_UP": 400.0, "WPNAV_ACCEL_Z": 400.0}
"""A quicker take-off than ArduCopter's."""
_parser = ardupilotmega.MAVLink(None)


class ArduRig(Rig):
    """One ArduCopter and a client.

    Unless ``boot`` is off it boots in half a second; unless ``true_speed``, it climbs quickly.
    """

    def __init__(self, *, boot: bool = True, true_speed: bool = False, **settings: Any) -> None:
        if boot:
            settings.setdefault("prearm_delay_s", READY_S)
        if boot and not true_speed:
            settings["parameters"] = {**QUICK, **settings.get("parameters", {})}
        super().__init__(boot=boot, quick=False, autopilot="ardupilot", **settings)

    def _decoded(self, frame: bytes) -> list[Any]:
        return [_parser.decode(bytearray(frame))]

    def texts(self) -> list[str]:
        """Every text said so far, its chunks put together."""
        whole: list[str] = []
        for message in self.messages("STATUSTEXT"):
            if message.chunk_seq:
                whole[-1] += message.text
            else:
                whole.append(message.text)
        return whole

    def switch(self, mode: int) -> int:
        """Send DO_SET_MODE."""
        return self.command(ardupilotmega.MAV_CMD_DO_SET_MODE, 1, mode)

    def start(self, height: float) -> int:
        """Send NAV_TAKEOFF."""
        return self.command(ardupilotmega.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height)

    def lift(self, height: float = 3.0) -> None:
        """Arm in GUIDED, climb, and hold there."""
        assert self.switch(GUIDED) == ACCEPTED
        assert self.arm() == ACCEPTED
        assert self.start(height) == ACCEPTED
        self.run_until(lambda: self.height > height - 0.15, 20.0)
        self.run(0.6)

    def fly(self, height: float = 3.0, **setpoint: Any) -> None:
        """Take off and hand over to a stream of rates that goes on by itself."""
        self.lift(height)
        setpoint.setdefault("thrust", HOVER)
        self.each_tick = lambda: self.rates(**setpoint)
        self.run(0.05)

    @property
    def height(self) -> float:
        return -self.truth.position_ned[2]

    def base_mode(self) -> int:
        """The base_mode of the next heartbeat."""
        before = len(self.messages("HEARTBEAT"))
        self.run_until(lambda: len(self.messages("HEARTBEAT")) > before, 1.1)
        return int(self.messages("HEARTBEAT")[-1].base_mode)
