"""The same flight of either autopilot over each wire, signed and not; the truth judges.

In real time, as users fly: all wires at once, because a real-time flight mostly waits. In lockstep
over the byte streams, for the beacons.
"""

import asyncio
from contextlib import ExitStack

import pytest

from companion.demo import local_endpoints
from companion.mavlink import loop as link_loop
from tests.flight.fly import LOOP_HZ
from tests.flight.sockets import fly, mock_vehicle, session_for

WIRES = {"udp": None, "tcp": "tcp://127.0.0.1:1", "serial": "serial:///dev/any:921600"}
REAL_TIME = [
    ("px4", "udp", True),
    ("px4", "serial", True),
    ("ardupilot", "udp", False),
    ("ardupilot", "tcp", True),
]
HOVER = {"hover": {"duration_s": 1.0}}
BUSY = {"safety": {"computer_action": "warn"}}
"""In real time, a computer that is busy with other tests decides nothing."""


def joined(stack, folder, autopilot, wire, signs, **settings):
    """A mock on that wire, and our section `link`."""
    folder.mkdir()
    key = folder / "key"
    key.write_text("a passphrase\n")
    theirs = {"signing": {"passphrase_file": str(key)}} if signs else {}
    ours = {"signing_key_file": str(key)} if signs else {}
    ours["min_attitude_rate_hz"] = 10.0  # in real time, a busy computer pauses telemetry
    if WIRES[wire] is not None:
        made = stack.enter_context(local_endpoints(WIRES[wire]))
        ours["endpoint"], theirs["endpoint"] = made.program, made.vehicle_arguments[1]
    settings |= theirs | {"autopilot": autopilot}
    mock = stack.enter_context(mock_vehicle(folder, **settings))
    mock.state()  # it is there
    return mock, ours


def judge(summary, truth, autopilot, signs, rate_hz):
    assert (summary.result, summary.phase) == ("ok", "disarm"), summary.events
    assert not truth["armed"]
    assert not truth["crashed"]
    assert truth["setpoints"] > rate_hz
    if signs:
        assert truth["signing"]["accepted"] > rate_hz
        assert truth["signing"]["unsigned"] == truth["signing"]["refused"] == 0
    said = [text for _, text in summary.events]
    assert not any("its frames" in text for text in said)
    assert ("autopilot: Armed by external command" in said) == (autopilot == "px4")


@pytest.fixture(scope="module")
def in_real_time(tmp_path_factory):
    """Summary and truth of each row of `REAL_TIME`."""
    folder = tmp_path_factory.mktemp("wires")
    with ExitStack() as stack:
        mocks, sessions = [], []
        for row in REAL_TIME:
            own = folder / "-".join(map(str, row))
            mock, link = joined(stack, own, *row, in_lockstep=False, speed=1.0)
            mocks.append(mock)
            sessions.append(session_for(mock, own / "flight", link=link, **HOVER, **BUSY))

        async def fly_all():
            return await asyncio.gather(*(session.fly() for session in sessions))

        summaries = link_loop.run(fly_all())
        truths = [mock.state() for mock in mocks]
    return dict(zip(REAL_TIME, zip(summaries, truths, strict=True), strict=True))


@pytest.mark.parametrize("row", REAL_TIME, ids=str)
def test_the_same_flight_over_each_wire_in_real_time(row, in_real_time):
    autopilot, _, signs = row
    summary, truth = in_real_time[row]
    judge(summary, truth, autopilot, signs, rate_hz=LOOP_HZ)
    assert summary.latency_us()["p50"] > 0.0


@pytest.mark.parametrize(
    ("autopilot", "wire"), [("px4", "tcp"), ("ardupilot", "serial")], ids=["tcp", "serial"]
)
def test_the_same_flight_in_lockstep_over_a_byte_stream(autopilot, wire, tmp_path):
    with ExitStack() as stack:
        mock, link = joined(
            stack, tmp_path / "flight", autopilot, wire, signs=False, full_rate=True
        )
        summary = fly(mock, tmp_path / "flight", link=link, **HOVER)
        judge(summary, mock.state(), autopilot, signs=False, rate_hz=mock.rate_hz)
