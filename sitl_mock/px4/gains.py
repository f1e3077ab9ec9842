"""PX4's gains and limits, by its parameters."""

from math import radians

from sitl_mock.autopilot.attitude_control import AttitudeGains
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import PositionGains


def position_gains(parameters: ParameterTable) -> PositionGains:
    """Return the position controller's gains and limits."""
    return PositionGains(
        parameters["MPC_XY_P"],
        parameters["MPC_Z_P"],
        parameters["MPC_XY_VEL_P_ACC"],
        parameters["MPC_Z_VEL_P_ACC"],
        parameters["MPC_XY_VEL_I_ACC"],
        parameters["MPC_Z_VEL_I_ACC"],
        radians(parameters["MPC_TILTMAX_AIR"]),
        parameters["MPC_THR_HOVER"],
        parameters["MPC_THR_MIN"],
        parameters["MPC_THR_MAX"],
    )


def attitude_gains(parameters: ParameterTable) -> AttitudeGains:
    """Return the attitude controller's gains and limits."""
    return AttitudeGains(
        parameters["MC_ROLL_P"],
        parameters["MC_PITCH_P"],
        parameters["MC_YAW_P"],
        parameters["MC_YAW_WEIGHT"],
        (
            radians(parameters["MC_ROLLRATE_MAX"]),
            radians(parameters["MC_PITCHRATE_MAX"]),
            radians(parameters["MC_YAWRATE_MAX"]),
        ),
    )
