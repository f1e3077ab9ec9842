"""A small vehicle in virtual time: it flies by rates and by its own modes, and tells of it.

It shares no code with the bundled one: pymavlink, and a point mass that turns as it is told.
"""

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from tests.fuzz.family import BRAKE, HOME_ALTITUDE, PX4, Family
from tests.fuzz.messages import BUILDERS, KINDS

G = 9.80665
HOVER = 0.5
STEP = 0.025
"""Of its physics and its attitude, s."""
_PARAMETERS = {
    "COM_OF_LOSS_T": 1.0,
    "GUID_TIMEOUT": 1.0,
    "GUID_OPTIONS": 8.0,
    "ATC_ANGLE_BOOST": 0.0,
}
"""It has no others."""
_LOSS_S = 1.0
"""As these say."""


class Vehicle:
    """State, commands and telemetry of one vehicle.

    Args:
        family: whose manners it has.

    Attributes:
        say: takes each message that it sends.
    """

    def __init__(self, family: Family) -> None:
        self.family = family
        self.say: Callable[[Any], None] = lambda _: None
        self.mode = family.ready
        self.armed = self.by_rates = False
        self.acks: dict[int, int] = {}
        self.position, self.velocity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.q = [1.0, 0.0, 0.0, 0.0]
        self.rates, self.thrust = (0.0, 0.0, 0.0), 0.0
        self.boot_s = 20.0
        self._goal = 0.0
        self.rising = False
        self._down_for = 0.0
        self._silent_for = 0.0

    @property
    def height(self) -> float:
        """Above the ground, m."""
        return -self.position[2]

    # --- time

    def step(self) -> None:
        """Live for `STEP`."""
        self.boot_s += STEP
        self._silent_for += STEP
        if self.flies_by_rates() and self._silent_for > _LOSS_S:
            self.by_rates, self.mode = False, BRAKE if self.family.is_ardupilot else PX4.ready
        if self.flies_by_rates():
            self._turn()
        else:
            self._steer()
        for axis in range(3):
            self.position[axis] += STEP * self.velocity[axis]
        if self.position[2] >= 0.0 and self.velocity[2] >= 0.0:
            self.position[2], self.velocity = 0.0, [0.0, 0.0, 0.0]
        self._land()

    def flies_by_rates(self) -> bool:
        """Whether it obeys setpoints."""
        if self.family.is_ardupilot:
            return self.by_rates
        return self.armed and self.mode == PX4.offboard

    def _turn(self) -> None:
        """Turn by the rates, and accelerate by the thrust along the body's axis."""
        w, x, y, z = self.q
        p, q, r = (0.5 * STEP * rate for rate in self.rates)
        turned = [
            w - p * x - q * y - r * z,
            x + p * w + r * y - q * z,
            y + q * w - r * x + p * z,
            z + r * w + q * x - p * y,
        ]
        size = sum(part * part for part in turned) ** 0.5
        w, x, y, z = self.q = [part / size for part in turned]
        lift = -G * self.thrust / HOVER
        axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        for k in range(3):
            self.velocity[k] += STEP * (lift * axis[k] + (G if k == 2 else 0.0))

    def _steer(self) -> None:
        """Its own modes: level, and up, down or still."""
        self.q = [1.0, 0.0, 0.0, 0.0]
        self.rates = (0.0, 0.0, 0.0)
        climb = 0.0
        if self.armed and self.rising:
            climb = min(2.5, 3.0 * (self._goal - self.height))
            if self._goal - self.height < 0.1:
                self.rising, climb = False, 0.0
                if self.mode == PX4.takeoff:
                    self.mode = PX4.ready
        elif self.mode == self.family.land and self.height > 0.0:
            climb = -1.5
        self.velocity = [0.0, 0.0, -climb]

    def _land(self) -> None:
        down = self.armed and self.mode == self.family.land and self.height <= 0.0
        self._down_for = self._down_for + STEP if down else 0.0
        if self._down_for > 1.0:
            self.armed = self.by_rates = False

    # --- what it hears

    def hear(self, message: Any) -> None:
        """Obey what the companion sends."""
        match message.get_type():
            case "SET_ATTITUDE_TARGET":
                self._silent_for = 0.0
                rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
                self.rates, self.thrust = rates, message.thrust
                guided = self.family.is_ardupilot and self.mode == 4
                if guided and self.armed and self.height > 0.5:
                    self.by_rates, self.rising = True, False
            case "COMMAND_LONG":
                self._command(message)
            case "PARAM_REQUEST_READ":
                self._parameter(str(message.param_id))
            case "TIMESYNC" if message.tc1 == 0:
                self.say(dialect.MAVLink_timesync_message(int(self.boot_s * 1e9), message.ts1))

    def _parameter(self, name: str) -> None:
        if name not in _PARAMETERS:
            self.say(dialect.MAVLink_param_error_message(1, 191, name.encode(), -1, 1))
            return
        self.say(dialect.MAVLink_param_value_message(name.encode(), _PARAMETERS[name], 9, 9, 0))

    def _command(self, message: Any) -> None:
        number = message.command
        result = self.acks.get(number)
        if result is None:
            result = self._obey(number, message)
        self.say(dialect.MAVLink_command_ack_message(number, result))

    def _obey(self, number: int, message: Any) -> int:
        match number:
            case dialect.MAV_CMD_REQUEST_MESSAGE:
                told = self.tell(int(message.param1))
                if told is None:
                    return 2
                self.say(told)
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM:
                if not message.param1 and self.height > 0.1:
                    return 2
                self.armed = bool(message.param1)
            case dialect.MAV_CMD_DO_SET_MODE:
                return self._enter(message)
            case dialect.MAV_CMD_NAV_TAKEOFF:
                if not self.armed:
                    return 2
                above = 0.0 if self.family.is_ardupilot else HOME_ALTITUDE
                self._goal, self.rising = message.param7 - above, True
                self.mode = self.family.takeoff
            case dialect.MAV_CMD_NAV_LAND:
                self.mode = self.family.land
        return 0

    def _enter(self, message: Any) -> int:
        if self.family.is_ardupilot:
            mode = int(message.param2)
        else:
            mode = int(message.param2) << 16 | int(message.param3) << 24
            if mode == PX4.offboard and self._silent_for > 0.5:
                return 1
        if mode != self.mode:
            self.by_rates = self.rising = False
        self.mode = mode
        return 0

    # --- what it says

    def tell(self, number: int) -> Any:
        """The newest of a message that it is asked for."""
        known = KINDS.get(number)
        if number == dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            return dialect.MAVLink_autopilot_version_message(
                0xFFFF, 0x01100000, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 7
            )
        build = BUILDERS.get(known.msgname if known else "")
        return build and build(self)

    def message(self, name: str) -> Any:
        """A message of its telemetry, as it would send it now."""
        return BUILDERS[name](self)
