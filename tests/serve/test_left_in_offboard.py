"""A client lands the vehicle that it has flown, and wants to fly again."""

import asyncio

from tests.serve.virtual import POSITION, MemoryClient, airborne, begin_control, mock, served

_SET_MODE, _ARM, _AUTO, _LAND = 176, 400, 4, 6
_MODE_REPORTS = 0, 436
"""Ids of HEARTBEAT and CURRENT_MODE."""


def test_a_vehicle_that_a_client_has_landed_can_be_armed_again():
    """PX4 returned to OFFBOARD, and refused to arm in words that do not tell why."""
    vehicle = mock("px4")

    async def scene(session):
        script = await _landed_by_a_client(session, vehicle)
        await asyncio.sleep(1.5)
        assert vehicle.state()["mode"] == "LOITER", script.texts()
        script.command(_ARM, 1)
        await asyncio.sleep(1.0)
        assert vehicle.state()["armed"]

    served(vehicle, "px4", scene)


def test_a_pilot_who_chooses_a_mode_is_not_told_to_hold_again():
    """The command of hold was lost; sent again, it would end the mode that the pilot chose."""
    vehicle = mock("px4")

    async def scene(session):
        script = await _landed_by_a_client(session, vehicle)
        vehicle.inject({"kind": "drop", "direction": "from_companion"})
        await asyncio.sleep(1.0)
        assert vehicle.state()["mode"] == "OFFBOARD"
        vehicle.take_over("POSCTL")
        await asyncio.sleep(0.5)
        vehicle.clear_faults()
        await asyncio.sleep(5.0)
        assert vehicle.state()["mode"] == "POSCTL", script.texts()

    served(vehicle, "px4", scene)


def test_hold_is_not_sent_again_on_an_old_report_of_the_mode():
    """Lost are the first command, and the reports of the mode until after the second would go."""
    vehicle = mock("px4")

    def without_mode(data):
        return [] if int.from_bytes(data[7:10], "little") in _MODE_REPORTS else [data]

    async def scene(session):
        script = await _landed_by_a_client(session, vehicle)
        vehicle.inject({"kind": "drop", "direction": "from_companion"})
        async with asyncio.timeout(2.0):
            while not script.texts()[-1].endswith("to hold"):  # noqa: ASYNC110  texts set no events
                await asyncio.sleep(0.01)
        vehicle.to_companion = without_mode
        vehicle.take_over("POSCTL")
        await asyncio.sleep(0.9)
        vehicle.clear_faults()
        await asyncio.sleep(0.3)
        vehicle.to_companion = None
        await asyncio.sleep(4.0)
        assert vehicle.state()["mode"] == "POSCTL", script.texts()

    served(vehicle, "px4", scene)


def test_a_lost_command_of_hold_is_sent_again():
    vehicle = mock("px4")

    async def scene(session):
        await _landed_by_a_client(session, vehicle)
        vehicle.inject({"kind": "drop", "direction": "from_companion"})
        await asyncio.sleep(1.2)
        vehicle.clear_faults()
        await asyncio.sleep(2.0)
        assert vehicle.state()["mode"] == "LOITER"

    served(vehicle, "px4", scene)


async def _landed_by_a_client(session, vehicle):
    """Fly, land and disarm by a client; return the client."""
    await airborne(session, vehicle, "px4", 3.0)
    script = MemoryClient().connect(session)
    await begin_control(session, script, "px4", lambda _: script.local(POSITION, (0.0, 0.0, -3.0)))
    script.command(_SET_MODE, 1, _AUTO, _LAND)
    async with asyncio.timeout(30.0):
        while vehicle.state()["armed"]:  # noqa: ASYNC110  the truth sets no events
            await asyncio.sleep(0.02)
    return script
