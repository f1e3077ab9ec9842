"""A program whose code blocks the event loop, in real time over a socket."""

import re
import time

import pytest

import companion
from tests.flight.fly import quick_flight
from tests.flight.sockets import mock_vehicle


def test_a_coroutine_that_blocks_for_a_second_leaves_the_vehicle_held(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False, speed=1.0) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        config = quick_flight("px4", {}, endpoint=endpoint)

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
    assert (state["mode"], state["armed"], state["crashed"]) == ("LOITER", True, False)
