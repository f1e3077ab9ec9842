"""A program whose code blocks the event loop, in real time over a socket."""

import re
import subprocess
import sys
import time

import pytest

import companion
from companion.files import bounded_yaml
from tests.flight.fly import quick_flight
from tests.flight.sockets import mock_vehicle

HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}
PARAMETERS = {"px4": {"COM_OBL_RC_ACT": 5.0}, "ardupilot": {}}
"""PX4 holds when setpoints stop; by its default it lands where there is no remote control."""
AFTER_FAILSAFE = {"px4": "LOITER", "ardupilot": "GUIDED"}
"""ArduPilot stays in GUIDED, and comes to rest at a level attitude."""
NEVER_YIELDS = """
import sys
import companion


async def main():
    async with companion.connect(sys.argv[1]) as vehicle:
        await vehicle.take_off()
        async with vehicle.control() as control:
            async for state in control.states():
                control.accelerate((0.3, 0.0, 0.0))
                while state.velocity_ned[0] > 0.3:
                    pass


companion.run(main())
"""
BOTH = pytest.mark.parametrize(
    "autopilot", ["px4", pytest.param("ardupilot", marks=pytest.mark.slow)]
)


@BOTH
def test_a_coroutine_that_blocks_for_a_second_leaves_the_vehicle_held(tmp_path, autopilot):
    with mock_vehicle(tmp_path, in_lockstep=False, autopilot=autopilot, speed=1.0) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        config = quick_flight(autopilot, {}, endpoint=endpoint, attitude_rate_hz=mock.rate_hz)

        async def main():
            async with companion.connect(config, folder=tmp_path) as vehicle:
                await vehicle.take_off()
                blocked = False
                async with vehicle.control() as control:
                    async for _ in control.states(seconds=10.0):
                        control.accelerate((0.3, 0.0, 0.0))
                        if not blocked and control.state.velocity_ned[0] > 0.3:
                            blocked = True
                            time.sleep(1.0)  # noqa: ASYNC251

        with pytest.raises(companion.FlightEnded) as ended:
            companion.run(main())
        state = mock.until(lambda state: abs(state["velocity"][0]) < 0.1)
    assert re.search("stood still|no new command|failsafe|took over|deadline", str(ended.value))
    assert (state["mode"], state["armed"], state["crashed"]) == (HELD[autopilot], True, False)


@pytest.mark.slow
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_after_a_coroutine_that_never_yields_the_autopilots_failsafe_holds(tmp_path, autopilot):
    settings = {"speed": 1.0, "parameters": PARAMETERS[autopilot]}
    with mock_vehicle(tmp_path, in_lockstep=False, autopilot=autopilot, **settings) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        recording = {"recording": {"directory": str(tmp_path / "flights")}}
        config = quick_flight(
            autopilot, recording, endpoint=endpoint, attitude_rate_hz=mock.rate_hz
        )
        file = tmp_path / "companion.yaml"
        file.write_text(bounded_yaml.dump(config.model_dump(mode="json")))
        program = subprocess.Popen([sys.executable, "-c", NEVER_YIELDS, file])
        try:
            mock.until(lambda state: state["velocity"][0] > 0.25, 40.0)
            time.sleep(3.5)  # ArduPilot waits 3 s for setpoints
            held = mock.until(lambda state: abs(state["velocity"][0]) < 0.1)
            time.sleep(0.5)
            state = mock.state()
            assert program.poll() is None, "it still blocks"
        finally:
            program.kill()
            program.wait()
    assert state["setpoints"] == held["setpoints"], "nothing is sent any more"
    assert (state["mode"], state["armed"]) == (AFTER_FAILSAFE[autopilot], True)
    assert abs(state["velocity"][0]) < 0.15
    assert abs(state["velocity"][2]) < 0.2
