"""Converts a client's frame to its command, or to the reason why it is not flown."""

from companion.mavlink.framing import Frame
from companion.mavlink.messages import decode, dialect
from companion.serve.network.addresses import Address, target_of
from companion.serve.setpoints.attitude_target import attitude_target
from companion.serve.setpoints.position_target import global_target, local_target
from companion.serve.setpoints.request import RefusedSetpoint, Request, Situation

_ATTITUDE = dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET
_LOCAL = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
_GLOBAL = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT
SETPOINTS = frozenset({_ATTITUDE, _LOCAL, _GLOBAL})
"""The messages that command a motion."""


class Setpoints:
    """Interprets setpoints for one vehicle.

    Args:
        autopilot: address of the autopilot.
        own: address of our component, which setpoints may also be addressed to.
        body_yaw_is_relative: see `local_target`.
    """

    def __init__(self, autopilot: Address, own: Address, *, body_yaw_is_relative: bool) -> None:
        self._autopilot, self._own = autopilot, own
        self._body_yaw_is_relative = body_yaw_is_relative

    def understand(self, frame: Frame, situation: Situation) -> Request:
        """The command of a setpoint.

        Args:
            frame: frame of one of `SETPOINTS`.
            situation: present situation of the vehicle.

        Raises:
            RefusedSetpoint: the setpoint is for another vehicle, contradictory, incomplete, not
                finite, too large, or of a kind that is not flown.
        """
        self._check_target(target_of(frame))
        message = decode(frame.message_id, frame.payload)
        if frame.message_id == _ATTITUDE:
            return attitude_target(message)
        if frame.message_id == _GLOBAL:
            return global_target(message, situation)
        return local_target(message, situation, body_yaw_is_relative=self._body_yaw_is_relative)

    def _check_target(self, target: Address) -> None:
        if target.system not in (0, self._autopilot.system):
            raise RefusedSetpoint(
                f"target_system is {target.system}; this vehicle is {self._autopilot.system}"
            )
        if target.component not in (0, self._autopilot.component, self._own.component):
            raise RefusedSetpoint(
                f"target_component is {target.component}; the autopilot is "
                f"{self._autopilot.component}"
            )
