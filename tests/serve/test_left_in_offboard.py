"""A client lands the vehicle that it has flown, and wants to fly again."""

import asyncio

from tests.serve.virtual import POSITION, MemoryClient, airborne, begin_control, mock, served

_SET_MODE, _ARM, _AUTO, _LAND = 176, 400, 4, 6


def test_a_vehicle_that_a_client_has_landed_can_be_armed_again():
    """PX4 returned to OFFBOARD, and refused to arm in words that do not tell why."""
    vehicle = mock("px4")

    async def scene(session):
        await airborne(session, vehicle, "px4", 3.0)
        script = MemoryClient().connect(session)
        await begin_control(
            session, script, "px4", lambda _: script.local(POSITION, (0.0, 0.0, -3.0))
        )
        script.command(_SET_MODE, 1, _AUTO, _LAND)
        async with asyncio.timeout(30.0):
            while vehicle.state()["armed"]:  # noqa: ASYNC110  the truth sets no events
                await asyncio.sleep(0.5)
        await asyncio.sleep(1.5)
        assert vehicle.state()["mode"] == "LOITER", script.texts()
        script.command(_ARM, 1)
        await asyncio.sleep(1.0)
        assert vehicle.state()["armed"]

    served(vehicle, "px4", scene)
