"""The mock through the scripts of the recordings: what comes, in which order, how often.

Messages are compared both ways, so that the mock neither leaves out nor makes up one; what differs
all the same is named here. What first came within `TOGETHER_S` of one another may come in any
order: it is a matter of phases. Rates are compared between the requests that change them.
"""

from dataclasses import dataclass
from itertools import combinations

import pytest
from ardupilot_rig import HOVER as ARDUPILOT_HOVER
from ardupilot_rig import ArduRig
from mock_rig import HOVER as PX4_HOVER
from mock_rig import QUICK, Rig
from script import Script, digest

TOGETHER_S = 0.6
RATE_TOLERANCE = 0.1
FEWEST = 3
"""Rates are compared of messages that came at least this often."""

# By number what the dialect has no name for: ESC_INFO, ESC_STATUS, LINK_NODE_STATUS,
# TIME_ESTIMATE_TO_TARGET, CURRENT_EVENT_SEQUENCE, and one that no dialect at hand knows.
PX4_LACKS = {
    "#290", "#291", "#8", "#380", "#411", "#514",
    "DISTANCE_SENSOR", "GNSS_INTEGRITY", "OPEN_DRONE_ID_LOCATION", "OPEN_DRONE_ID_SYSTEM",
    "SCALED_PRESSURE", "POSITION_TARGET_GLOBAL_INT", "GPS_GLOBAL_ORIGIN",
    "COMMAND_LONG",  # to cameras and gimbals
}  # fmt: skip
"""PX4 sends these; the mock has no such sensors, and does not need to."""
ARDUPILOT_LACKS = {
    "AHRS", "AHRS2", "POWER_STATUS", "MEMINFO", "NAV_CONTROLLER_OUTPUT", "SCALED_IMU2",
    "SCALED_IMU3", "SCALED_PRESSURE2", "SIMSTATE", "WIND", "TERRAIN_REQUEST", "TERRAIN_REPORT",
    "ESC_TELEMETRY_1_TO_4",
}  # fmt: skip
"""ArduPilot sends these in its groups of streams, the mock does not."""
ON_OCCASION = {
    "COMMAND_ACK", "STATUSTEXT", "PARAM_VALUE", "PARAM_ERROR", "AUTOPILOT_VERSION",
    "MESSAGE_INTERVAL", "GPS_GLOBAL_ORIGIN", "#410",
}  # fmt: skip
"""Sent when something happens, not at a rate; #410 is EVENT."""
TOLD_WHILE_BOOTING = {"STATUSTEXT", "PARAM_VALUE", "#410"}
"""PX4 tells of its boot, too; the mock only of what happens then."""
OFFBOARD_TARGETS = {"ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED"}
"""Come and go with OFFBOARD."""


@dataclass(frozen=True)
class Case:
    """How a recording is flown again.

    Attributes:
        lacks: what the mock leaves out.
        no_rate: what came at no steady rate.
        unordered: what begins at another time than recorded.
        booted_s: until then PX4's streams begin one by one, and the mock's all at once.
        pauses: recorded times that are passed over, because nothing changes there.
        shift: the mock's time less the recording's, s.
        boot_s: the mock's prearm_delay_s.
    """

    lacks: set
    no_rate: frozenset = frozenset()
    unordered: frozenset = frozenset()
    booted_s: float = 0.0
    pauses: tuple = ()
    shift: float = 0.0
    boot_s: float = 4.5


PX4_FLIGHT = Case(
    PX4_LACKS,
    no_rate=frozenset(OFFBOARD_TARGETS),
    unordered=frozenset(TOLD_WHILE_BOOTING),
    booted_s=3.6,
    pauses=((15.0, 22.0), (27.0, 49.0), (54.0, 70.0)),
)
CASES = {
    # 7 s at each rate are cut to 0.8.
    "ardupilot-idle": Case(
        ARDUPILOT_LACKS,
        boot_s=24.0,
        pauses=(
            (21.0, 39.0),
            (43.0, 49.0),
            *((at, at + 6.2) for at in range(55, 117, 7)),
            *((at, at + 6.2) for at in (120, 127, 134, 150, 157, 164)),
            (141.0, 148.0),
            (171.0, 184.0),
            (189.0, 196.5),
        ),
    ),
    "ardupilot-flight": Case(
        set(), boot_s=22.0, pauses=((21.0, 40.5), (59.0, 69.0), (78.0, 98.0))
    ),
    "px4-idle": Case(PX4_LACKS, booted_s=26.5, shift=-17.0),
    "px4-offboard-entry": Case(
        PX4_LACKS, no_rate=frozenset(OFFBOARD_TARGETS), booted_s=210.7, shift=-200.0
    ),
    "px4-flight-companion": PX4_FLIGHT,
    "px4-flight-gcs": PX4_FLIGHT,
}  # fmt: skip


def flown(name):
    case = CASES[name]
    if name.startswith("ardupilot"):
        rig = ArduRig(boot=False, prearm_delay_s=case.boot_s, lockstep={"enabled": False})
        hover = ARDUPILOT_HOVER
    else:
        rig = Rig(boot=False, parameters=QUICK, lockstep={"enabled": False})
        hover = PX4_HOVER
    script = Script(digest(name), rig, hover=hover, shift=case.shift, pauses=case.pauses)
    script.run()
    return case, script


@pytest.mark.parametrize("name", CASES)
def test_the_mock_through_the_script_of_a_recording(name):
    case, script = flown(name)
    recorded = dict(script.recording["first"])
    lacking = set(recorded) - set(script.came)
    assert lacking <= case.lacks
    assert set(script.came) <= set(recorded)
    assert order_differs(case, recorded, script) == []
    compared = compare_rates(case, script)
    steady = {name for name, windows in script.recording["rates"].items() if windows}
    assert compared == steady - lacking - ON_OCCASION - case.no_rate


def order_differs(case, recorded, script):
    """Pairs that came in one order in the recording and in the other from the mock."""
    names = [name for name in recorded if name in script.came and name not in case.unordered]
    wrong = []
    for first, second in combinations(names, 2):
        if recorded[second] - recorded[first] < TOGETHER_S or recorded[second] < case.booted_s:
            continue
        if script.came[second][0] < script.came[first][0]:
            wrong.append((first, second))
    return wrong


def compare_rates(case, script):
    """Assert that each steady rate is the recorded one; return the messages it was told of."""
    compared = set()
    for name, windows in script.recording["rates"].items():
        if name not in script.came or name in ON_OCCASION or name in case.no_rate:
            continue
        for start, stop, hz in windows:
            times = [t for t in script.came[name] if script.here(start) <= t <= script.here(stop)]
            if len(times) >= FEWEST:
                got = (len(times) - 1) / (times[-1] - times[0])
                assert got == pytest.approx(hz, rel=RATE_TOLERANCE), (name, start, stop)
                compared.add(name)
    return compared
