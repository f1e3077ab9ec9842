"""The telemetry of the small vehicle, by message."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect
from pymavlink.dialects.v20 import development

from tests.fuzz.family import ARDUPILOT, HOME_ALTITUDE, PX4, Family

if TYPE_CHECKING:
    from tests.fuzz.vehicle import Vehicle

KINDS = {**development.mavlink_map, **dialect.mavlink_map}
"""Message classes by number."""
_ON_GROUND, _IN_AIR, _TAKING_OFF = 1, 2, 3
_LATITUDE, _LONGITUDE, _ALTITUDE = 473_977_420, 85_455_940, int(HOME_ALTITUDE * 1e3)


def _ms(vehicle: "Vehicle") -> int:
    return int(vehicle.boot_s * 1000.0) & 0xFFFFFFFF


def _us(vehicle: "Vehicle") -> int:
    return int(vehicle.boot_s * 1e6)


def _rates(vehicle: "Vehicle") -> tuple[float, float, float]:
    return vehicle.rates if vehicle.flies_by_rates() else (0.0, 0.0, 0.0)


def _heartbeat(vehicle: "Vehicle") -> Any:
    base = 29
    if vehicle.family.is_ardupilot:
        base = 65 if vehicle.by_rates or vehicle.mode != ARDUPILOT.ready else 73
    base |= 128 if vehicle.armed else 0
    status = 4 if vehicle.armed else 3
    return dialect.MAVLink_heartbeat_message(
        2, vehicle.family.autopilot, base, vehicle.mode, status, 3
    )


def _landed(vehicle: "Vehicle") -> Any:
    in_air = _TAKING_OFF if vehicle.rising else _IN_AIR
    return dialect.MAVLink_extended_sys_state_message(
        0, _ON_GROUND if vehicle.height <= 0.05 else in_air
    )


BUILDERS: dict[str, Callable[["Vehicle"], Any]] = {
    "ATTITUDE_QUATERNION": lambda v: dialect.MAVLink_attitude_quaternion_message(
        _ms(v), *v.q, *_rates(v)
    ),
    "LOCAL_POSITION_NED": lambda v: dialect.MAVLink_local_position_ned_message(
        _ms(v), *v.position, *v.velocity
    ),
    "EXTENDED_SYS_STATE": _landed,
    "ATTITUDE_TARGET": lambda v: dialect.MAVLink_attitude_target_message(
        _ms(v), 0, list(v.q), *_rates(v), v.thrust
    ),
    "ODOMETRY": lambda v: dialect.MAVLink_odometry_message(
        _us(v), 1, 12, *v.position, v.q, *v.velocity, 0, 0, 0, [0.0] * 21, [0.0] * 21
    ),
    "HEARTBEAT": _heartbeat,
    "CURRENT_MODE": lambda v: development.MAVLink_current_mode_message(0, v.mode, v.mode),
    "SYS_STATUS": lambda _: dialect.MAVLink_sys_status_message(
        *(0x1FFFFFFF,) * 3, 100, 16000, 500, 90, *(0,) * 6
    ),
    "BATTERY_STATUS": lambda _: dialect.MAVLink_battery_status_message(
        0, 0, 0, 2500, [4000] * 4 + [65535] * 6, 500, 0, 0, 90
    ),
    "ESTIMATOR_STATUS": lambda v: dialect.MAVLink_estimator_status_message(
        _us(v), 0x33F, *(0.1,) * 8
    ),
    "EKF_STATUS_REPORT": lambda _: dialect.MAVLink_ekf_status_report_message(0x33F, *(0.1,) * 5),
    "HOME_POSITION": lambda _: dialect.MAVLink_home_position_message(
        _LATITUDE, _LONGITUDE, _ALTITUDE, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0
    ),
    "GPS_RAW_INT": lambda v: dialect.MAVLink_gps_raw_int_message(
        _us(v), 3, _LATITUDE, _LONGITUDE, _ALTITUDE, 80, 90, 0, 0, 12
    ),
    "GLOBAL_POSITION_INT": lambda v: dialect.MAVLink_global_position_int_message(
        _ms(v), _LATITUDE, _LONGITUDE, _ALTITUDE, int(v.height * 1e3), 0, 0, 0, 0
    ),
}

EVERY = {
    "ATTITUDE_QUATERNION": 1,
    "LOCAL_POSITION_NED": 2,
    "EXTENDED_SYS_STATE": 8,
    "ATTITUDE_TARGET": 4,
    "ODOMETRY": 4,
    "HEARTBEAT": 20,
    "CURRENT_MODE": 2,
    "SYS_STATUS": 20,
    "BATTERY_STATUS": 40,
    "ESTIMATOR_STATUS": 8,
    "EKF_STATUS_REPORT": 8,
    "HOME_POSITION": 40,
    "GPS_RAW_INT": 20,
    "GLOBAL_POSITION_INT": 20,
}
"""Every how many steps of the vehicle each is sent."""
_ONLY = {
    "CURRENT_MODE": PX4,
    "ODOMETRY": PX4,
    "ESTIMATOR_STATUS": PX4,
    "EKF_STATUS_REPORT": ARDUPILOT,
}


def sends(family: Family, name: str) -> bool:
    """Whether a family sends a message."""
    return _ONLY.get(name, family) == family
