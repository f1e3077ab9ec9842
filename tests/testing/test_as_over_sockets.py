"""A flight in memory is the flight over a socket in lockstep, to the bit."""

from dataclasses import replace

import pytest
from pymavlink import mavutil

from tests.flight import fly as memory
from tests.flight import sockets

GUSTS = {"speed_m_s": 2.0, "from_deg": 40.0, "gust_m_s": 0.7, "vertical_gust_m_s": 0.3}
BAD_LINK = [
    {"kind": "drop", "probability": 0.05, "after_offboard_s": 2.0},
    {"kind": "delay", "probability": 0.1, "delay_ms": 24.0, "after_offboard_s": 2.0},
    {"kind": "duplicate", "probability": 0.2, "after_offboard_s": 2.0},
    {"kind": "reorder", "probability": 0.1, "after_offboard_s": 2.0},
    {"kind": "corrupt", "probability": 0.02, "after_offboard_s": 2.0},
]
CIRCLE = {
    "flight": {"maneuvers": ["hover", "circle"]},
    "hover": {"duration_s": 0.5},
    "circle": {"radius_m": 1.0},
}


def setpoints(summary):
    log = mavutil.mavlink_connection(str(summary.log / "flight.tlog"))
    return [
        (m.time_boot_ms, m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust)
        for m in iter(lambda: log.recv_match(type=["SET_ATTITUDE_TARGET"]), None)
    ]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param({}, id="good link", marks=pytest.mark.slow),
        pytest.param({"wind": GUSTS, "faults": BAD_LINK}, id="gusts, then a bad link"),
    ],
)
def test_the_same_setpoints_to_the_bit(tmp_path, autopilot, settings):
    settings = {**settings, "autopilot": autopilot, "seed": 7}
    with sockets.mock_vehicle(tmp_path, **settings) as mock:
        over_udp = sockets.fly(mock, tmp_path / "udp", **CIRCLE)
    with memory.mock_vehicle(in_lockstep=True, **settings) as vehicle:
        in_memory = memory.fly(vehicle, tmp_path / "memory", **CIRCLE)
    sent = setpoints(over_udp)
    assert len(sent) > 400
    assert sent == setpoints(in_memory)
    logs = [(summary.log / "flight.tlog").read_bytes() for summary in (over_udp, in_memory)]
    assert logs[0] == logs[1]
    assert over_udp.events == in_memory.events
    assert over_udp.link["frames"] == in_memory.link["frames"]
    assert replace(over_udp.counts, missed_deadlines=0) == in_memory.counts
