"""Decodes the frame of a client's setpoint to a request, or refuses it with a reason."""

from companion.mavlink.framing import Frame
from companion.mavlink.messages import decode, dialect
from companion.serve.network.addresses import Address, target_of
from companion.serve.setpoints.attitude_target import decode_attitude_target
from companion.serve.setpoints.position_target import decode_global_target, decode_local_target
from companion.serve.setpoints.request import RefusedSetpoint, Request, VehiclePose

_ATTITUDE_TARGET_ID = dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET
_LOCAL_TARGET_ID = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
_GLOBAL_TARGET_ID = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT
SETPOINT_IDS = frozenset({_ATTITUDE_TARGET_ID, _LOCAL_TARGET_ID, _GLOBAL_TARGET_ID})
"""Ids of the messages that command a motion, an attitude or body rates."""


def decode_setpoint(
    frame: Frame,
    pose: VehiclePose,
    targets: tuple[Address, Address],
    *,
    body_yaw_is_relative: bool,
) -> Request:
    """Decode a client's setpoint to a request.

    `targets`: the autopilot and our component; a setpoint may be addressed to either.
    `body_yaw_is_relative`: see `decode_local_target`.

    Raises:
        RefusedSetpoint: the setpoint is for another vehicle, contradictory, incomplete, not finite,
            too large, or of a kind that is not flown.
    """
    target, (autopilot, our_address) = target_of(frame), targets
    if target.system not in (0, autopilot.system):
        raise RefusedSetpoint(
            f"target_system is {target.system}; this vehicle is {autopilot.system}"
        )
    if target.component not in (0, autopilot.component, our_address.component):
        raise RefusedSetpoint(
            f"target_component is {target.component}; the autopilot is {autopilot.component}"
        )
    message = decode(frame.message_id, frame.payload)
    if frame.message_id == _ATTITUDE_TARGET_ID:
        return decode_attitude_target(message)
    if frame.message_id == _GLOBAL_TARGET_ID:
        return decode_global_target(message, pose)
    return decode_local_target(message, pose, body_yaw_is_relative=body_yaw_is_relative)
