"""What differs between the two autopilots, as far as a flight meets it (measured on real ones).

Modes have the same names for both: READY (where a flight begins), TAKEOFF, RATES (obeys our
setpoints), HOLD, LAND, RETURN, PILOT and STABILIZE (a pilot's sticks).
"""

from dataclasses import dataclass
from types import MappingProxyType, ModuleType

from pymavlink.dialects.v20 import ardupilotmega, development

SET_MODE, ARM, TAKEOFF, LAND = 176, 400, 22, 21
SET_MESSAGE_INTERVAL, REQUEST_MESSAGE, RUN_PREARM_CHECKS = 511, 512, 401
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class Personality:
    """One kind of autopilot.

    Attributes:
        name: for test names and messages.
        autopilot: MAV_AUTOPILOT.
        dialect: pymavlink's, with the messages that only this one has.
        custom_modes: HEARTBEAT.custom_mode of each mode.
        estimator: message that carries the estimator's flags, and the flags of a good one.
        heartbeat_can_be_asked: whether SET_MESSAGE_INTERVAL of HEARTBEAT is granted.
        enters_by_setpoint: whether the first setpoint in the air enters RATES.
        bytewise: whether integer parameters travel as bytes.
        parameters: name → value; an int is an integer parameter.
        default_rates: messages that come unasked, Hz.
    """

    name: str
    autopilot: int
    dialect: ModuleType
    custom_modes: MappingProxyType
    estimator: tuple
    heartbeat_can_be_asked: bool
    enters_by_setpoint: bool
    bytewise: bool
    parameters: MappingProxyType
    default_rates: MappingProxyType

    def base_mode(self, mode, *, armed):
        """HEARTBEAT.base_mode, as recorded."""
        if self.enters_by_setpoint:
            by_position = mode not in ("RATES", "STABILIZE")
            return 81 | (8 if by_position else 0) | (128 if armed else 0)
        base = {"RATES": 1, "PILOT": 81, "STABILIZE": 81}.get(mode, 29)
        return base | (128 if armed else 0)

    def mode_asked(self, message):
        """The mode that a DO_SET_MODE asks for, or None for an unknown one."""
        number = int(message.param2)
        if not self.enters_by_setpoint:
            number = number << 16 | int(message.param3) << 24
        asked = [mode for mode, custom in self.custom_modes.items() if custom == number]
        return asked[0] if asked else None


PX4 = Personality(
    name="px4",
    autopilot=12,
    dialect=development,
    # LOITER is both HOLD and READY: the name of the first that has the number is the mode.
    custom_modes=MappingProxyType(
        {
            "HOLD": 0x03040000,
            "READY": 0x03040000,
            "TAKEOFF": 0x02040000,
            "RATES": 0x00060000,
            "LAND": 0x06040000,
            "RETURN": 0x05040000,
            "PILOT": 0x00030000,
            "STABILIZE": 0x00070000,
        }
    ),
    estimator=("ESTIMATOR_STATUS", 0x33F),
    heartbeat_can_be_asked=False,
    enters_by_setpoint=False,
    bytewise=True,
    parameters=MappingProxyType(
        {
            "COM_OF_LOSS_T": 1.0,
            "COM_OBL_RC_ACT": 5,
            "COM_RC_OVERRIDE": 2,
            "COM_RC_STICK_OV": 30.0,
            "MAN_OVERRIDE_SPD": 1.0,
            "COM_RC_IN_MODE": 0,
            "MAV_FWDEXTSP": 1,
            "NAV_DLL_ACT": 2,
            "NAV_RCL_ACT": 2,
            "COM_RCL_EXCEPT": 0,
            "MPC_THR_HOVER": 0.5,
            "THR_MDL_FAC": 0.0,
            "MC_BAT_SCALE_EN": 0,
            "COM_DISARM_PRFLT": 10.0,
            "MAV_SYS_ID": 1,
            "MAV_SIGN_CFG": 0,
            "IMU_INTEG_RATE": 200,
            "GF_ACTION": 2,
            "COM_LOW_BAT_ACT": 3,
            "CBRK_SUPPLY_CHK": 0,
            "CBRK_FLIGHTTERM": 121212,
            "FD_FAIL_R": 60,
            "FD_FAIL_P": 60,
        }
    ),
    default_rates=MappingProxyType(
        {
            "HEARTBEAT": 1.0,
            "ATTITUDE_QUATERNION": 50.0,
            "LOCAL_POSITION_NED": 30.0,
            "EXTENDED_SYS_STATE": 5.0,
            "SYS_STATUS": 5.0,
        }
    ),
)
ARDUPILOT = Personality(
    name="ardupilot",
    autopilot=3,
    dialect=ardupilotmega,
    custom_modes=MappingProxyType(
        {
            "READY": 4,
            "TAKEOFF": 4,
            "RATES": 4,
            "HOLD": 17,
            "LAND": 9,
            "RETURN": 6,
            "PILOT": 5,
            "STABILIZE": 0,
        }
    ),
    estimator=("EKF_STATUS_REPORT", 0x33F),
    heartbeat_can_be_asked=True,
    enters_by_setpoint=True,
    bytewise=False,
    parameters=MappingProxyType(
        {
            "GUID_OPTIONS": 8,
            "ATC_ANGLE_BOOST": 0,
            "GUID_TIMEOUT": 1.0,
            "ATC_RATE_FF_ENAB": 1,
            "ATC_INPUT_TC": 0.15,
            "ATC_ACC_R_MAX": 0.0,
            "ATC_ACC_P_MAX": 0.0,
            "ATC_ACC_Y_MAX": 0.0,
            "FS_GCS_ENABLE": 1,
            "MAV_GCS_SYSID": 255,
            "MAV_SYSID": 1,
            "FS_THR_ENABLE": 1,
            "FS_OPTIONS": 0,
            "MOT_THST_HOVER": 0.5,
            "MOT_THST_EXPO": 0.0,
            "MOT_BAT_VOLT_MAX": 0.0,
            "ARMING_SKIPCHK": 0,
            "DISARM_DELAY": 10,
            "SCHED_LOOP_RATE": 400,
            "FS_EKF_ACTION": 1,
            "FENCE_ACTION": 1,
            "FENCE_ENABLE": 0,
            "BATT_FS_LOW_ACT": 2,
            "BATT_FS_CRT_ACT": 1,
        }
    ),
    default_rates=MappingProxyType({"HEARTBEAT": 1.0}),
)
BOTH = (PX4, ARDUPILOT)
