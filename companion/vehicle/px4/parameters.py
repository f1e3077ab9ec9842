"""PX4's parameters that matter to a flight by body rates.

Sources: PX4's parameter reference and `commander`; "measured": PX4 main in simulation, 2026.
"""

from companion.vehicle.parameter_checks import (
    INEFFECTIVE,
    UNSAFE,
    at_most,
    battery_scaling,
    bit_clear,
    bit_set,
    first_problem,
    forbidden,
    hover_thrust,
    positive,
    rate_hold,
    required,
    safe_action,
    system_id,
    thrust_curve,
)
from companion.vehicle.parameter_rules import ParameterRule
from companion.vehicle.px4.parameter_checks import (
    attitude_rate,
    failure_tilt,
    signing,
    termination_tilt,
)

_REFERENCE = "PX4 parameter reference"
_MEASURED = "measured on PX4 main, 2026"
_STOPS_MOTORS = "the motors stop in the air"
_LINK_LOSS_ACTIONS = (0.0, 1.0, 2.0, 3.0)
_ACTIONS_TEXT = "(0 nothing, 1 hold, 2 return, 3 land)"
_LOST_PILOT_IGNORED = "in OFFBOARD nothing is done about a lost transmitter"
_STICKS_IGNORED = "moving the sticks does not end offboard; only the mode switch does"

PX4_PARAMETERS: tuple[ParameterRule, ...] = (
    ParameterRule(
        ("COM_OF_LOSS_T",), "for how long the last rates are held", rate_hold, _MEASURED, vital=True
    ),
    ParameterRule(
        ("COM_OBL_RC_ACT",),
        "what PX4 does when setpoints stop (0 position, 1 altitude, 3 return, 4 land, 5 hold)",
        safe_action(
            (0.0, 1.0, 3.0, 4.0, 5.0),
            {
                2.0: "PX4 goes to manual flight, and falls or drifts unless a pilot acts at once",
                6.0: _STOPS_MOTORS,
                7.0: _STOPS_MOTORS,
            },
            set_to=5.0,
        ),
        f"{_REFERENCE}; {_MEASURED}",
        in_all_versions=True,
    ),
    ParameterRule(
        ("COM_RC_OVERRIDE",),
        "whether the pilot can take over by moving the sticks (before 1.18)",
        bit_set(INEFFECTIVE, 2, _STICKS_IGNORED),
        _REFERENCE,
    ),
    ParameterRule(
        ("COM_RC_STICK_OV",),
        "how far the sticks must be moved to take over, in percent (before 1.18)",
        at_most(INEFFECTIVE, 60.0, "a pilot in a hurry may not move the sticks that far", 30.0),
        _REFERENCE,
    ),
    ParameterRule(
        ("MAN_OVERRIDE_SPD",),
        "how quickly the sticks must be moved to take over (1.18 on)",
        positive(INEFFECTIVE, _STICKS_IGNORED, 1.0),
        _REFERENCE,
    ),
    ParameterRule(
        ("COM_RC_IN_MODE",),
        "whether there is a pilot's transmitter at all",
        forbidden(
            UNSAFE, {4.0: "stick input is disabled, so that no pilot can take over"}, set_to=0.0
        ),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("MAV_FWDEXTSP",),
        "whether setpoints that arrive by MAVLink are obeyed",
        required(INEFFECTIVE, 1.0, "setpoints are not obeyed, and OFFBOARD is not entered"),
        _REFERENCE,
    ),
    ParameterRule(
        ("NAV_DLL_ACT",),
        f"what PX4 does without a ground station's heartbeat, even with setpoints {_ACTIONS_TEXT}",
        safe_action(_LINK_LOSS_ACTIONS, {5.0: _STOPS_MOTORS, 6.0: _STOPS_MOTORS}, set_to=2.0),
        f"{_REFERENCE}; {_MEASURED}",
        in_all_versions=True,
    ),
    ParameterRule(
        ("NAV_RCL_ACT",),
        "what PX4 does when the pilot's transmitter is lost (0 nothing, 1 hold, 2 return, 3 land, "
        "7 hold, but only in a pilot's modes)",
        first_problem(
            safe_action(
                (*_LINK_LOSS_ACTIONS, 7.0), {5.0: _STOPS_MOTORS, 6.0: _STOPS_MOTORS}, set_to=2.0
            ),
            forbidden(INEFFECTIVE, {0.0: _LOST_PILOT_IGNORED, 7.0: _LOST_PILOT_IGNORED}, 2.0),
        ),
        f"{_REFERENCE}; PX4's failsafe.cpp",
        in_all_versions=True,
    ),
    ParameterRule(
        ("COM_RCL_EXCEPT",),
        "in which modes a lost transmitter is ignored",
        bit_clear(INEFFECTIVE, 4, _LOST_PILOT_IGNORED),
        _REFERENCE,
    ),
    ParameterRule(
        ("MPC_THR_HOVER",), "at which thrust PX4 expects to hover", hover_thrust, _REFERENCE
    ),
    ParameterRule(
        ("THR_MDL_FAC",), "whether PX4 compensates the thrust curve", thrust_curve, _REFERENCE
    ),
    ParameterRule(
        ("MC_BAT_SCALE_EN",),
        "whether PX4 compensates the battery voltage",
        battery_scaling,
        _REFERENCE,
    ),
    ParameterRule(
        ("COM_DISARM_PRFLT",),
        "after how long on the ground PX4 disarms itself",
        positive(UNSAFE, "a vehicle that was armed and does not take off stays armed", 10.0),
        f"{_REFERENCE}; {_MEASURED}",
        in_all_versions=True,
    ),
    ParameterRule(("MAV_SYS_ID",), "the vehicle's system id", system_id, "MAVLink routing"),
    ParameterRule(
        ("MAV_SIGN_CFG",),
        "whether PX4 obeys only signed frames",
        signing,
        _REFERENCE,
        needs_reboot=True,
    ),
    ParameterRule(
        ("IMU_INTEG_RATE",),
        "how often attitude is estimated, Hz",
        attitude_rate,
        _MEASURED,
        needs_reboot=True,
    ),
    ParameterRule(
        ("GF_ACTION",),
        "what PX4 does at its own geofence (0 nothing, 1 warn, 2 hold, 3 return, 5 land)",
        safe_action((0.0, 1.0, 2.0, 3.0, 5.0), {4.0: _STOPS_MOTORS}, set_to=2.0),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("COM_LOW_BAT_ACT",),
        "what PX4 does about an empty battery (0 warn, 2 land, 3 return or land)",
        first_problem(
            forbidden(UNSAFE, {4.0: f"when the battery is nearly empty, {_STOPS_MOTORS}"}, 3.0),
            forbidden(
                INEFFECTIVE,
                {0.0: "PX4 only warns; if companion has ended, nothing lands the vehicle"},
                set_to=3.0,
            ),
        ),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("CBRK_SUPPLY_CHK",),
        "whether arming checks the power supply",
        forbidden(INEFFECTIVE, {894281.0: "the power supply is not checked before arming"}, 0.0),
        _REFERENCE,
        needs_reboot=True,
    ),
    ParameterRule(
        ("CBRK_FLIGHTTERM",),
        "whether the failure detector stops motors",
        termination_tilt,
        _REFERENCE,
        in_all_versions=True,
        needs_reboot=True,
    ),
    ParameterRule(
        ("FD_FAIL_R",), "beyond which roll PX4 reports a failure", failure_tilt, _REFERENCE
    ),
    ParameterRule(
        ("FD_FAIL_P",), "beyond which pitch PX4 reports a failure", failure_tilt, _REFERENCE
    ),
)
