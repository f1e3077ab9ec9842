"""What the listener hears of others, of clocks and of jumps, over a real socket."""

import asyncio
from math import inf, nan
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.preflight.link_listener import LinkListener
from companion.vehicle.clock import VehicleClock
from tests.mavlink.fakes import attitude, frames_of, heartbeat, linked, until

COMPANION, GROUND_STATION = 18, 6
HOLD, OFFBOARD = 0x03040000, 0x00060000


def of_type(kind):
    return dialect.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3)


def setpoint():
    return dialect.MAVLink_set_attitude_target_message(
        0, 1, 1, 128, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.5
    )


def target(thrust, *, pitch_rate=0.01):
    return dialect.MAVLink_attitude_target_message(
        0, 0, (1.0, 0.0, 0.0, 0.0), 0.0, pitch_rate, 0.0, thrust
    )


def odometry(resets):
    zeros = (0.0,) * 21
    return dialect.MAVLink_odometry_message(
        0, 1, 1, *(0.0,) * 3, (1.0, 0.0, 0.0, 0.0), *(0.0,) * 6, zeros, zeros, resets
    )


async def test_who_else_is_there_and_who_steers():
    async with linked() as (link, vehicle):
        with LinkListener(link, asyncio.get_running_loop().time) as listener:
            for source, message in (
                ((255, 190), of_type(GROUND_STATION)),
                ((1, 192), of_type(COMPANION)),
                ((1, 193), setpoint()),
                ((2, 1), heartbeat()),
            ):
                system, component = source
                vehicle.send_raw(frames_of(message, system=system, component=component)[0])
            await until(lambda: len(listener.other_nodes.sources) == 4)
        assert listener.other_nodes.autopilots == {(2, 1)}
        assert listener.other_nodes.companions == {(1, 192)}
        assert listener.other_nodes.setpoint_senders == {(1, 193)}
        vehicle.send_raw(frames_of(setpoint(), system=9)[0])
        await until(lambda: link.stats.ignored_foreign == 5)
        assert len(listener.other_nodes.sources) == 4  # the listener is off


async def test_a_disarmed_autopilot_that_obeys_setpoints_and_tells_of_thrust_is_steered():
    async with linked() as (link, vehicle):
        with LinkListener(link, asyncio.get_running_loop().time) as listener:
            vehicle.send(heartbeat(OFFBOARD), target(0.0), odometry(7))
            await until(lambda: link.state.reset_counter == 7)
            assert not listener.other_nodes.has_foreign_attitude_target
            vehicle.send(heartbeat(OFFBOARD, armed=True), target(0.4), odometry(9))
            await until(lambda: link.state.reset_counter == 9)
            assert not listener.other_nodes.has_foreign_attitude_target
            assert listener.reset_count == 2
            vehicle.send(heartbeat(OFFBOARD), target(0.4), odometry(9))
            await until(lambda: listener.other_nodes.has_foreign_attitude_target)


async def test_a_vehicle_that_holds_on_a_slope_is_steered_by_nobody():
    """A real PX4, disarmed in AUTO.LOITER, shows the rates that would level it."""
    async with linked() as (link, vehicle):
        with LinkListener(link, asyncio.get_running_loop().time) as listener:
            vehicle.send(heartbeat(HOLD), target(0.001, pitch_rate=0.088), odometry(1))
            await until(lambda: link.state.reset_counter == 1)
            assert link.state.armed is False
            assert not listener.other_nodes.has_foreign_attitude_target
            vehicle.send(heartbeat(OFFBOARD), target(0.001, pitch_rate=0.088))
            await until(lambda: listener.other_nodes.has_foreign_attitude_target)


@pytest.mark.parametrize(
    "values",
    [
        (nan, 0, 0, 0, 0, 0, 0),
        (0, 0, 0, 0, 0, 0, 0),
        (1, 0, 0, 0, inf, 0, 0),
        (2, 0, 0, 0, 0, 0, 0),
    ],
)
def test_samples_that_cannot_be_answered(values):
    callbacks = {}

    def subscribe(name, callback):
        callbacks[name] = callback
        return lambda: None

    link = SimpleNamespace(on_foreign_frame=None, subscribe=subscribe, clock=VehicleClock())
    with LinkListener(link, lambda: 0.0) as listener:
        callbacks["ATTITUDE_QUATERNION"](attitude(0, *values))
        callbacks["ATTITUDE_QUATERNION"](attitude(4))
    assert (listener.samples.sample_count, listener.samples.unusable_count) == (2, 1)


def test_pauses_and_stamps_of_the_samples():
    times = iter([0.0, 0.1, 0.2, 0.5, *(0.5 + 0.1 * n for n in range(1, 8))])
    callbacks = {}

    def subscribe(name, callback):
        callbacks[name] = callback
        return lambda: None

    link = SimpleNamespace(on_foreign_frame=None, subscribe=subscribe, clock=VehicleClock())
    with LinkListener(link, lambda: next(times)) as listener:
        assert listener.samples.clock_rate is None
        for stamp in (0, 100, 100, 90, *(400 + 200 * n for n in range(1, 8))):
            callbacks["ATTITUDE_QUATERNION"](attitude(stamp))
    received, pause, not_newer, rate, age, change, unusable, even = listener.samples
    assert abs(even - 10 / 1.2) < 1e-9
    assert (age, change) == (None, "")
    assert (received, not_newer, unusable) == (11, 2, 0)
    assert abs(pause - 0.3) < 1e-9
    assert abs(rate - 1.8 / 1.2) < 1e-9
