"""The mock's body rates against those recorded, under the very setpoints of the recordings."""

from pathlib import Path

import numpy as np
import pytest
from ardupilot_rig import THRUST_AS_THRUST, ArduRig
from mock_rig import Rig
from pymavlink import mavutil

RECORDINGS = Path(__file__).parents[1] / "mavlink" / "recordings"
HEIGHT_M = 20.0
SEARCHED_S = 0.02


def recorded(family, dialect):
    """Samples (n, 4): time, body rates; setpoints (n, 5): time of the sample they answer, rates,
    thrust."""
    path = str(RECORDINGS / f"{family}-rate-steps.tlog")
    log = mavutil.mavlink_connection(path, dialect=dialect)
    samples, setpoints = [], []
    while (message := log.recv_msg()) is not None:
        if message.get_type() == "ATTITUDE_QUATERNION":
            now = message.time_boot_ms / 1e3
            samples.append((now, message.rollspeed, message.pitchspeed, message.yawspeed))
        elif message.get_type() == "SET_ATTITUDE_TARGET" and samples:
            rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
            setpoints.append((now, *rates, message.thrust))
    log.close()
    return np.array(samples), np.array(setpoints)


def flown(rig, samples, setpoints):
    """Times and estimated body rates, (n, 4), of the mock under the setpoints at their times."""
    begins, start = samples[0, 0], rig.time
    due = list(setpoints)
    rows = []
    while (now := rig.time - start + begins) < samples[-1, 0]:
        while due and due[0][0] <= now:
            rig.rates(*map(float, due.pop(0)[1:]))
        rig.run(0.004)
        rows.append((rig.time - start + begins, *rig.simulation.vehicle.estimate().body_rates))
    return np.array(rows)


def ardupilot():
    rig = ArduRig(parameters={**THRUST_AS_THRUST, "ATC_ANGLE_BOOST": 0})
    rig.fly(HEIGHT_M)
    return rig


def px4():
    rig = Rig()
    rig.fly_offboard(HEIGHT_M)
    return rig


@pytest.mark.parametrize(
    ("family", "dialect", "ready"),
    [("ardupilot", "ardupilotmega", ardupilot), ("px4", "development", px4)],
)
def test_rates_follow_the_recorded_setpoints_as_recorded(family, dialect, ready):
    """Within 6.5 % of what roll and pitch did, no more than 4 ms early or late."""
    samples, setpoints = recorded(family, dialect)
    rig = ready()
    rig.each_tick = None
    rows = flown(rig, samples, setpoints)
    inside = samples[(samples[:, 0] > 0.1 + rows[0, 0]) & (samples[:, 0] < rows[-1, 0] - 0.1)]
    for axis in (1, 2):
        real = inside[:, axis]

        def error(late, axis=axis, real=real):
            mock = np.interp(inside[:, 0] + late, rows[:, 0], rows[:, axis])
            return np.sqrt(np.mean((mock - real) ** 2)) / np.std(real)

        assert error(0.0) < 0.065
        lateness = min(np.arange(-SEARCHED_S, SEARCHED_S + 1e-9, 0.001), key=error)
        assert abs(lateness) <= 0.004
