"""PX4's parameters that matter to a companion, with PX4's types and defaults (SIH quadrotor X).

An ``int`` is INT32, a ``float`` REAL32. Parameters marked * have an effect in the mock. All others
exist because clients read them or users look for them.
"""

from sitl_mock.autopilot.parameters import Parameter

PX4_PARAMETERS: tuple[Parameter, ...] = tuple(
    Parameter(name, value)
    for name, value in (
        ("BAT_CRIT_THR", 0.07),  # *
        ("BAT_EMERGEN_THR", 0.05),  # *
        ("BAT_LOW_THR", 0.15),  # *
        ("BAT1_CAPACITY", -1.0),
        ("BAT1_N_CELLS", 4),
        ("CAL_ACC0_ID", 1310988),
        ("CAL_GYRO0_ID", 1310988),
        ("CAL_MAG0_ID", 197388),
        ("CBRK_IO_SAFETY", 22027),
        ("CBRK_FLIGHTTERM", 121212),
        ("CBRK_SUPPLY_CHK", 0),
        ("CBRK_USB_CHK", 197848),
        ("COM_ARM_WO_GPS", 1),
        ("COM_DISARM_LAND", 2.0),  # *
        ("COM_DISARM_PRFLT", 10.0),  # *
        ("COM_DL_LOSS_T", 10),  # *
        ("COM_FAIL_ACT_T", 5.0),  # *
        ("COM_LOW_BAT_ACT", 0),  # *
        ("COM_OBC_LOSS_T", 5.0),  # *
        ("COM_OBL_RC_ACT", 0),  # *
        ("COM_OF_LOSS_T", 1.0),  # *
        ("COM_DLL_EXCEPT", 0),  # *
        ("COM_RCL_EXCEPT", 0),  # *
        ("COM_RC_IN_MODE", 1),  # *
        ("COM_RC_LOSS_T", 0.5),  # *
        ("COM_SPOOLUP_TIME", 1.0),  # *
        ("EKF2_NOAID_TOUT", 5000000),  # *
        ("FD_FAIL_P", 60),
        ("FD_FAIL_R", 60),
        ("GF_ACTION", 2),
        ("GF_MAX_HOR_DIST", 0.0),
        ("GF_MAX_VER_DIST", 0.0),
        ("IMU_GYRO_RATEMAX", 400),
        ("IMU_INTEG_RATE", 250),
        ("MAN_OVERRIDE_SPD", 1.0),  # *
        ("MAV_0_MODE", 0),
        ("MAV_COMP_ID", 1),
        ("MAV_FWDEXTSP", 1),  # *
        ("MAV_PROTO_VER", 0),
        ("MAV_SIGN_CFG", 0),
        ("MAV_SYS_ID", 1),
        ("MAV_TYPE", 2),
        ("MC_BAT_SCALE_EN", 0),
        ("MC_PITCHRATE_D", 0.003),
        ("MC_PITCHRATE_I", 0.2),
        ("MC_PITCHRATE_MAX", 220.0),  # *
        ("MC_PITCHRATE_P", 0.15),
        ("MC_PITCH_P", 6.5),  # *
        ("MC_ROLLRATE_D", 0.003),
        ("MC_ROLLRATE_I", 0.2),
        ("MC_ROLLRATE_MAX", 220.0),  # *
        ("MC_ROLLRATE_P", 0.15),
        ("MC_ROLL_P", 6.5),  # *
        ("MC_YAWRATE_D", 0.0),
        ("MC_YAWRATE_I", 0.1),
        ("MC_YAWRATE_MAX", 200.0),  # *
        ("MC_YAWRATE_P", 0.2),
        ("MC_YAW_P", 2.8),  # *
        ("MC_YAW_WEIGHT", 0.4),  # *
        ("MIS_TAKEOFF_ALT", 2.5),  # *
        ("MPC_LAND_ALT1", 10.0),  # *
        ("MPC_LAND_ALT2", 5.0),  # *
        ("MPC_LAND_ALT3", 1.0),
        ("MPC_LAND_CRWL", 0.3),  # *
        ("MPC_LAND_SPEED", 0.7),  # *
        ("MPC_THR_HOVER", 0.5),  # *
        ("MPC_THR_MAX", 1.0),  # *
        ("MPC_THR_MIN", 0.12),  # *
        ("MPC_TILTMAX_AIR", 45.0),  # *
        ("MPC_TKO_RAMP_T", 3.0),  # *
        ("MPC_TKO_SPEED", 1.5),  # *
        ("MPC_XY_CRUISE", 5.0),  # *
        ("MPC_XY_P", 0.95),  # *
        ("MPC_XY_VEL_I_ACC", 0.4),  # *
        ("MPC_XY_VEL_MAX", 12.0),  # *
        ("MPC_XY_VEL_P_ACC", 1.8),  # *
        ("MPC_Z_P", 1.0),  # *
        ("MPC_Z_VEL_I_ACC", 2.0),  # *
        ("MPC_Z_VEL_MAX_DN", 1.5),  # *
        ("MPC_Z_VEL_MAX_UP", 3.0),  # *
        ("MPC_Z_VEL_P_ACC", 4.0),  # *
        ("MPC_Z_V_AUTO_DN", 1.5),  # *
        ("MPC_Z_V_AUTO_UP", 3.0),  # *
        ("NAV_ACC_RAD", 2.0),  # *
        ("NAV_DLL_ACT", 0),  # *
        ("NAV_RCL_ACT", 2),  # *
        ("RTL_CONE_ANG", 45),  # *
        ("RTL_DESCEND_ALT", 30.0),
        ("RTL_LAND_DELAY", 0.0),
        ("RTL_RETURN_ALT", 60.0),  # *
        ("RTL_TYPE", 0),
        ("SDLOG_MODE", 0),
        ("SYS_AUTOCONFIG", 0),
        ("SYS_AUTOSTART", 10040),
        ("SYS_HITL", 0),
        ("THR_MDL_FAC", 0.0),
    )
)
