"""Judges from the wire what a flight sends, with pymavlink and a clock that knows all."""

from math import hypot, inf, isfinite, radians
from typing import Any

from pymavlink.dialects.v20 import development as dialect

from tests.fuzz.vehicle import Vehicle

_ASKS = {dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAV_CMD_SET_MESSAGE_INTERVAL}
"""Commands that only ask."""
_AGE_SLACK = 0.06
_CLOCK_SLACK = 0.012
"""A vehicle clock may run so much faster or slower, so ages are known no better."""


class Judge:
    """Looks at each frame on its way; what is wrong is kept in `faults`.

    Args:
        vehicle: the truth.
        config: of the flight, as its file says.
    """

    def __init__(self, vehicle: Vehicle, config: dict[str, Any]) -> None:
        self.faults: list[str] = []
        self.setpoints = 0
        self.commands: list[int] = []
        self.over = False
        self._vehicle = vehicle
        limits = config["limits"]
        self._tilt_rate = radians(limits["max_tilt_rate_deg_s"])
        self._yaw_rate = radians(limits["max_yaw_rate_deg_s"])
        self._thrusts = limits["min_thrust"], limits["max_thrust"]
        self._stale = config["deadman"]["telemetry_stale_ms"] * 1e-3
        self._taken_by: str | None = None
        self._armed = False
        self._sample: tuple[int, float, float, float] | None = None
        self._answered = False
        self._answered_stamps: set[int] = set()
        self._newest = -inf
        self._quickest, self._first = inf, inf
        self._parser = dialect.MAVLink(None)

    # --- from the vehicle

    def arrives(self, frame: bytes, made_at: float, now: float) -> None:
        """A frame of the vehicle's is about to be delivered."""
        message = _decoded(self._parser, frame)
        self._sample = None
        if message is None or (message.get_srcSystem(), message.get_srcComponent()) != (1, 1):
            return
        if message.get_type() == "ATTITUDE_QUATERNION":
            self._first = min(self._first, now)
            self._quickest = min(self._quickest, now - made_at)
            self._sample = message.time_boot_ms, now, now - made_at, made_at
            self._answered = False
        elif message.get_type() == "HEARTBEAT":
            self._heartbeat(message)
        elif message.get_type() == "CURRENT_MODE" and self._vehicle.family.tells_mode:
            self._mode(message.custom_mode)

    def clock_set(self) -> None:
        """The vehicle's stamps begin anew."""
        self._answered_stamps.clear()

    def delivered(self) -> None:
        """It was delivered."""
        self._sample = None

    def _heartbeat(self, message: Any) -> None:
        if message.autopilot == self._vehicle.family.autopilot:
            self._armed = bool(message.base_mode & 128)
            self._mode(message.custom_mode)

    def _mode(self, mode: int) -> None:
        """A mode is told: one that is not ours, of an armed vehicle, is somebody's."""
        flying = self._armed and dialect.MAV_CMD_NAV_TAKEOFF in self.commands
        if flying and mode not in self._vehicle.family.ours:
            self._taken_by = self._taken_by or f"mode {mode}"

    # --- from the companion

    def sent(self, frame: bytes) -> Any:
        """A frame of ours; returns the message."""
        message = _decoded(self._parser, frame)
        assert message is not None, frame.hex()
        if message.get_type() == "SET_ATTITUDE_TARGET":
            self._setpoint(message)
        elif message.get_type() == "COMMAND_LONG" and message.command not in _ASKS:
            self.commands.append(message.command)
            if self._taken_by:
                self._fault(f"command {message.command} after {self._taken_by}")
            if self.over:
                self._fault(f"command {message.command} after the flight")
        return message

    def _setpoint(self, setpoint: Any) -> None:
        self.setpoints += 1
        rates = setpoint.body_roll_rate, setpoint.body_pitch_rate, setpoint.body_yaw_rate
        if not all(map(isfinite, (*rates, setpoint.thrust))):
            self._fault(f"not finite: {setpoint}")
            return
        if hypot(*rates[:2]) > self._tilt_rate * 1.000001:
            self._fault(f"tilt rate {hypot(*rates[:2])}")
        if abs(rates[2]) > self._yaw_rate * 1.000001:
            self._fault(f"yaw rate {rates[2]}")
        if setpoint.type_mask != 128:
            self._fault(f"type mask {setpoint.type_mask}")
        self._thrust(setpoint.thrust, rates)
        self._answers(setpoint.time_boot_ms)
        if self._taken_by:
            self._fault(f"a setpoint after {self._taken_by}")
        if self.over:
            self._fault("a setpoint after the flight")

    def _thrust(self, thrust: float, rates: tuple[float, ...]) -> None:
        vehicle = self._vehicle
        lowest, highest = self._thrusts
        if thrust == 0.0 and not any(rates):
            if vehicle.armed and dialect.MAV_CMD_NAV_TAKEOFF in self.commands:
                self._fault("no thrust after the take-off was commanded")
        elif not lowest - 1e-6 <= thrust <= highest + 1e-6:
            self._fault(f"thrust {thrust}")

    def _answers(self, stamp: int) -> None:
        """A setpoint leaves in answer to one sample, and that is fresh and new."""
        if self._sample is None:
            self._fault("a setpoint that answers nothing")
            return
        told, now, age, made_at = self._sample
        if stamp != told or self._answered:
            self._fault(f"stamped {stamp} in answer to {told}, again: {self._answered}")
        if stamp in self._answered_stamps:
            self._fault(f"a second answer to a sample of {stamp} ms")
        if made_at < self._newest:
            self._fault(f"an answer to a sample {self._newest - made_at:.3f} s before the last")
        self._answered, self._newest = True, made_at
        self._answered_stamps.add(stamp)
        slack = _AGE_SLACK + _CLOCK_SLACK * (now - self._first)
        if age - self._quickest > self._stale + slack:
            self._fault(f"an answer to a sample {age:.3f} s old")

    def _fault(self, what: str) -> None:
        if what not in self.faults and len(self.faults) < 5:
            self.faults.append(what)


def _decoded(parser: Any, frame: bytes) -> Any:
    try:
        return parser.decode(bytearray(frame))
    except (dialect.MAVError, IndexError, TypeError):
        return None
