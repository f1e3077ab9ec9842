"""Numbers that are none, attitudes that are none, samples twice or in the wrong order."""

from math import inf, nan

from tests.hostile.actions import says, tells
from tests.hostile.endings import gives_back, never_armed, ok, on_the_ground
from tests.hostile.personality import ARDUPILOT, PX4
from tests.hostile.scenario import Scenario, flights, in_turn

ATTITUDE, POSITION = "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"
FIELDS = {
    ATTITUDE: ("q1", "q2", "q3", "q4", "rollspeed", "pitchspeed", "yawspeed"),
    POSITION: ("x", "y", "z", "vx", "vy", "vz"),
}
HARMLESS = {
    "HOME_POSITION": ("x", "y", "z"),
    "ATTITUDE_TARGET": ("thrust", "body_roll_rate"),
    "ESTIMATOR_STATUS": ("vel_ratio", "pos_horiz_accuracy"),
    "EKF_STATUS_REPORT": ("velocity_variance",),
    "ODOMETRY": ("x", "vx", "rollspeed"),
}
OTHERS = {PX4.name: {"EKF_STATUS_REPORT"}, ARDUPILOT.name: {"ESTIMATOR_STATUS", "ODOMETRY"}}
VALUES = {PX4.name: nan, ARDUPILOT.name: inf}


def steering(kind):
    """The control loop lives on these."""
    value = VALUES[kind.name]
    for message, fields in FIELDS.items():
        for field in fields:
            script = (("in control", 0.6, says(message, **{field: value})),)
            name = f"{message} {field} is {value} in control"
            yield Scenario(name, script, (gives_back(1.5),), (kind,))


def watching(kind):
    """These are told besides."""
    value = VALUES[kind.name]
    for message, fields in HARMLESS.items():
        if message in OTHERS[kind.name]:
            continue
        for field in fields:
            script = (("in control", 0.6, says(message, **{field: value})),)
            yield Scenario(f"{message} {field} is {value} in control", script, (ok,), (kind,))


TARGETS = {
    "is {value}": lambda value: says("ATTITUDE_TARGET", q=[value, 0.0, 0.0, 0.0]),
    "is zero": lambda _: says("ATTITUDE_TARGET", q=[0.0] * 4),
    "is of length 1.5": lambda _: says("ATTITUDE_TARGET", q=[1.5, 0.0, 0.0, 0.0]),
    "is upside down": lambda _: says("ATTITUDE_TARGET", q=[0.0, 1.0, 0.0, 0.0]),
    "looks backwards": lambda _: says("ATTITUDE_TARGET", q=[0.0, 0.0, 0.0, 1.0]),
    "leads by 40 degrees": lambda _: says("ATTITUDE_TARGET", q=[0.93969, 0.0, 0.0, 0.34202]),
    "has the stamp 0": lambda _: says("ATTITUDE_TARGET", time_boot_ms=0),
    "has the last stamp there is": lambda _: says("ATTITUDE_TARGET", time_boot_ms=2**32 - 1),
}


def axes_of_the_rates():
    """ArduPilot tells the axes along which it takes the rates; nonsense ends no flight."""
    for what, lie in TARGETS.items():
        value = VALUES[ARDUPILOT.name]
        name = f"the attitude of ATTITUDE_TARGET {what.format(value=value)} in control"
        yield Scenario(name, (("in control", 0.6, lie(value)),), (ok,), (ARDUPILOT,))


def turned(factor):
    """The quaternion of each sample times `factor`, by the number of the sample."""

    def act(autopilot):
        count = iter(range(10**6))

        def change(fields):
            by = factor(next(count))
            return {**fields, **{name: by * fields[name] for name in ("q1", "q2", "q3", "q4")}}

        tells(ATTITUDE, change)(autopilot)

    return act


def swapped(autopilot):
    """Each second sample comes after the one that follows it."""
    held = []

    def change(fields):
        held.append(fields)
        return None if len(held) % 2 else [held[-1], held[-2]]

    tells(ATTITUDE, change)(autopilot)


def twice_and_from_before(autopilot):
    """Each sample comes twice, and then the one before it once more."""
    before = []

    def change(fields):
        before.append(fields)
        return [fields, fields, *before[-2:-1]]

    tells(ATTITUDE, change)(autopilot)


ATTITUDES = (
    *(
        Scenario(f"{what} in control", (("in control", 0.6, action),), (gives_back(1.5),))
        for what, action in (
            ("quaternions of length 1.5", turned(lambda _: 1.5)),
            ("quaternions of length 0", turned(lambda _: 0.0)),
        )
    ),
    *(
        Scenario(f"{what} in control", (("in control", 0.3, action),), (ok,))
        for what, action in (
            ("q and -q in turn", turned(lambda number: 1 - 2 * (number % 2))),
            ("each sample twice and the one before once more", twice_and_from_before),
        )
    ),
    Scenario("samples in the wrong order", (("in control", 0.6, swapped),), (gives_back(4.0),)),
)
NOWHERE = {"latitude": 0, "longitude": 0, "altitude": 0}
HOMES = (
    Scenario(
        "HOME_POSITION is NaN from the start",
        (("start", 0.0, says("HOME_POSITION", x=nan, y=nan, z=nan)),),
        (never_armed,),
    ),
    Scenario(
        "HOME_POSITION is all zeros",
        (("start", 0.0, says("HOME_POSITION", **NOWHERE)),),
        (on_the_ground,),
    ),
    Scenario(
        "quaternions of length 0 from the start",
        (("start", 0.0, turned(lambda _: 0.0)),),
        (never_armed,),
    ),
    *(
        Scenario(
            f"{message} is NaN from the start",
            (("start", 0.0, says(message, **dict.fromkeys(fields, nan))),),
            (never_armed,),
        )
        for message, fields in FIELDS.items()
    ),
)


@flights(in_turn(lambda kind: (*steering(kind), *watching(kind))))
def test_a_number_is_none(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights((*ATTITUDES, *HOMES, *axes_of_the_rates()))
def test_attitudes_and_homes_that_are_none(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
