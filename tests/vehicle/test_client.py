"""Commands, parameters, rates and clocks, against a vehicle that answers well and badly."""

import asyncio
import math
import struct
import time

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.mavlink.commands import command_name, result_name
from companion.mavlink.errors import (
    CommandRefused,
    CommandTimeout,
    CommandUnfinished,
    LinkLost,
    LinkTimeout,
    ParameterRefused,
    UnansweredParameter,
    UnknownMessage,
    UnknownParameter,
)
from companion.vehicle.px4.autopilot import Px4
from tests.mavlink.fakes import attitude, linked, until

ARM, SET_MODE = 400, 176
ARDUPILOT = 3
INT32, REAL32 = 6, 9


def ack(command, result, system=1, component=191):
    return dialect.MAVLink_command_ack_message(command, result, 0, 0, system, component)


def text(words, severity=4, number=0, chunk=0):
    return dialect.MAVLink_statustext_message(severity, words.encode(), number, chunk)


async def test_an_accepted_command_carries_its_parameters():
    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(message.command, 0)]
        await link.command(ARM, 1.0, 2.0)
        await link.command(*Px4().take_off(10.0, 30.0))
        arm, take_off = vehicle.of("COMMAND_LONG")
        assert (arm.command, arm.param1, arm.param2, arm.param7) == (ARM, 1.0, 2.0, 0.0)
        assert (arm.target_system, arm.target_component, arm.confirmation) == (1, 1, 0)
        assert (take_off.command, take_off.param7) == (22, 40.0)
        assert take_off.param5 != take_off.param5  # NaN: where it is


async def test_a_refusal_has_the_autopilots_words_before_and_after_the_ack():
    async with linked() as (link, vehicle):
        vehicle.send(text("something old\t"))
        await asyncio.sleep(0.01)
        vehicle.answers["COMMAND_LONG"] = lambda message: [
            text("Arming denied: \t"),
            ack(message.command, 1),
            text("Resolve system health failures first\t"),
        ]
        with pytest.raises(CommandRefused) as caught:
            await link.command(ARM, 1.0)
        assert caught.value.result_name == "TEMPORARILY_REJECTED"
        assert caught.value.texts == ("Arming denied:", "Resolve system health failures first")
        assert "MAV_CMD_COMPONENT_ARM_DISARM" in str(caught.value)
        assert len(vehicle.of("COMMAND_LONG")) == 1


async def test_a_lost_command_is_repeated_with_a_rising_confirmation():
    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: (
            [ack(message.command, 0)] if message.confirmation == 2 else []
        )
        await link.command(ARM, 1.0, timeout_s=0.02)
        assert [message.confirmation for message in vehicle.of("COMMAND_LONG")] == [0, 1, 2]


async def test_silence_is_a_timeout_after_all_tries():
    async with linked() as (link, vehicle):
        with pytest.raises(CommandTimeout, match="after 3 tries"):
            await link.command(ARM, 1.0, timeout_s=0.01, retries=2)
        assert len(vehicle.of("COMMAND_LONG")) == 3
        # Nothing of it is left: the next command works.
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(message.command, 0)]
        await link.command(ARM, 1.0)


async def test_by_itself_a_command_is_repeated_three_times():
    async with linked() as (link, vehicle):
        with pytest.raises(CommandTimeout, match="after 4 tries"):
            await link.command(ARM, 1.0, timeout_s=0.01)
        assert len(vehicle.of("COMMAND_LONG")) == 4


async def test_in_progress_is_waited_for_and_not_repeated():
    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(message.command, 5)]
        task = asyncio.create_task(link.command(ARM, timeout_s=0.02))
        await asyncio.sleep(0.1)
        assert not task.done()
        vehicle.send(ack(ARM, 0))
        await task
        assert len(vehicle.of("COMMAND_LONG")) == 1


async def test_a_command_that_stays_in_progress_is_no_silence(monkeypatch):
    """It is not repeated, and has a time for the whole, however often it is called in progress."""
    monkeypatch.setattr("companion.mavlink.commands._IN_PROGRESS_TIMEOUT_S", 0.1)

    async def repeat(vehicle):
        while True:
            vehicle.send(ack(ARM, 5))
            await asyncio.sleep(0.03)

    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(message.command, 5)]
        repeating = asyncio.create_task(repeat(vehicle))
        async with asyncio.timeout(5.0):
            with pytest.raises(CommandUnfinished, match=r"ARM_DISARM: .* gave no result"):
                await link.command(ARM, timeout_s=0.5, retries=1)
        repeating.cancel()
        assert len(vehicle.of("COMMAND_LONG")) == 1


async def cancel_once_sent(link, vehicle):
    """A command whose call is cancelled before its ACK comes."""
    cancelled = asyncio.create_task(link.command(SET_MODE, 1.0, 4.0))
    await until(lambda: vehicle.of("COMMAND_LONG"))
    cancelled.cancel()


async def test_a_late_ack_of_a_cancelled_command_does_not_count_for_the_next_one():
    """A hold is cancelled; its ACK must not count for the landing, which the autopilot refuses."""

    async with linked() as (link, vehicle):
        await cancel_once_sent(link, vehicle)
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(SET_MODE, 0), ack(SET_MODE, 4)]
        with pytest.raises(CommandRefused, match="FAILED"):
            await link.command(SET_MODE, 1.0, 6.0)
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(SET_MODE, 0)]
        await link.command(SET_MODE, 1.0, 6.0)


async def test_a_cancelled_command_that_was_lost_costs_the_next_one_a_repetition():
    async with linked() as (link, vehicle):
        await cancel_once_sent(link, vehicle)
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(SET_MODE, 0)]
        await link.command(SET_MODE, 1.0, 6.0, timeout_s=0.02)
        assert len(vehicle.of("COMMAND_LONG")) == 3


async def test_an_ack_that_waited_while_we_stood_still_does_not_count_for_the_next_command():
    async with linked() as (link, vehicle):
        stalled = asyncio.create_task(link.command(SET_MODE, 4.0, timeout_s=0.02, retries=0))
        await until(lambda: vehicle.of("COMMAND_LONG"))
        time.sleep(0.15)  # noqa: ASYNC251 - the process stands still
        with pytest.raises(CommandTimeout):
            await stalled
        vehicle.answers["COMMAND_LONG"] = lambda message: [ack(SET_MODE, 0), ack(SET_MODE, 4)]
        with pytest.raises(CommandRefused, match="FAILED"):
            await link.command(SET_MODE, 1.0, 6.0)


async def test_acks_for_others_and_for_other_commands_do_not_count():
    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: [
            ack(message.command, 4, system=255, component=190),
            ack(message.command, 4, component=100),
            ack(21, 4),
            ack(message.command, 0),
        ]
        await link.command(ARM)


async def test_two_commands_of_a_kind_wait_for_each_other():
    async with linked() as (link, vehicle):
        results = {1.0: 0, 0.0: 4}
        vehicle.answers["COMMAND_LONG"] = lambda message: [
            ack(message.command, results[message.param1])
        ]
        outcomes = await asyncio.gather(
            link.command(ARM, 1.0), link.command(ARM, 0.0), return_exceptions=True
        )
        assert outcomes[0] is None
        assert isinstance(outcomes[1], CommandRefused)


async def test_what_waits_when_the_link_closes_is_told():
    async with linked() as (link, _):
        waiting = asyncio.create_task(link.command(ARM, timeout_s=30.0))
        await asyncio.sleep(0)
    with pytest.raises(LinkLost):
        await waiting


def test_names_of_commands_and_results():
    assert command_name(176) == "MAV_CMD_DO_SET_MODE"
    assert command_name(65000) == "MAV_CMD 65000"
    assert (result_name(2), result_name(77)) == ("DENIED", "RESULT 77")


async def test_a_message_is_asked_for_and_returned():
    async with linked() as (link, vehicle):
        vehicle.answers["COMMAND_LONG"] = lambda message: [
            ack(message.command, 0),
            *([attitude(77)] if message.param1 == 31 else []),
        ]
        assert (await link.request_message("ATTITUDE_QUATERNION")).time_boot_ms == 77
        with pytest.raises(LinkTimeout, match="ODOMETRY"):
            await link.request_message("ODOMETRY", timeout_s=0.02)
        with pytest.raises(UnknownMessage):
            await link.request_message("NO_SUCH_THING")


class ParameterVehicle:
    """PX4's parameters: integers as bytes in the float field."""

    def __init__(self, vehicle):
        self.kinds = {"COM_OF_LOSS_T": REAL32, "COM_OBL_RC_ACT": INT32}
        self.raw = {"COM_OF_LOSS_T": struct.pack("<f", 1.0), "COM_OBL_RC_ACT": bytes(4)}
        self.locked = False
        self.deaf = 0
        vehicle.answers["PARAM_REQUEST_READ"] = self.read
        vehicle.answers["PARAM_SET"] = self.write

    def read(self, message):
        if self.deaf:
            self.deaf -= 1
            return []
        return self.value(message.param_id)

    def write(self, message):
        if not self.locked:
            self.raw[message.param_id] = bytes(message.get_msgbuf()[10:14])
            assert message.param_type == self.kinds[message.param_id]
        return self.value(message.param_id)

    def value(self, name):
        if name not in self.raw:
            return []
        number = struct.unpack("<f", self.raw[name])[0]
        return [dialect.MAVLink_param_value_message(name.encode(), number, self.kinds[name], 2, 0)]


async def test_parameters_of_both_kinds_are_read_and_written():
    async with linked() as (link, vehicle):
        ParameterVehicle(vehicle)
        assert await link.read_parameter("COM_OF_LOSS_T") == 1.0
        assert await link.write_parameter("COM_OF_LOSS_T", 0.5) == 0.5
        for number in (3, -1, 2**31 - 1, -(2**31), 1_000_000):
            held = await link.write_parameter("COM_OBL_RC_ACT", number)
            assert (held, type(held)) == (number, int)
            assert await link.read_parameter("COM_OBL_RC_ACT") == number


async def test_parameters_that_another_station_changes_are_told_until_one_leaves():
    async with linked() as (link, vehicle):
        parameters, told = ParameterVehicle(vehicle), []
        leave = link.subscribe_parameters(lambda *value: told.append(value))
        vehicle.send(*parameters.value("COM_OF_LOSS_T"))
        await until(lambda: told)
        parameters.raw["COM_OBL_RC_ACT"] = struct.pack("<i", -5)
        vehicle.send(*parameters.value("COM_OBL_RC_ACT"))
        await until(lambda: len(told) == 2)
        assert told == [("COM_OF_LOSS_T", 1.0), ("COM_OBL_RC_ACT", -5)]
        leave()
        assert await link.read_parameter("COM_OF_LOSS_T") == 1.0
        assert len(told) == 2


async def test_a_lost_parameter_request_is_repeated():
    async with linked() as (link, vehicle):
        ParameterVehicle(vehicle).deaf = 2
        assert await link.read_parameter("COM_OF_LOSS_T", timeout_s=0.02) == 1.0


async def test_a_second_answer_to_a_read_is_no_answer_to_the_write_after_it():
    async with linked() as (link, vehicle):
        parameters = ParameterVehicle(vehicle)

        def write(message):
            old = parameters.value(message.param_id)
            return [*old, *parameters.write(message)]

        vehicle.answers["PARAM_SET"] = write
        assert await link.write_parameter("COM_OF_LOSS_T", 0.5) == 0.5


async def test_unknown_parameters_by_silence_and_by_error():
    async with linked() as (link, vehicle):
        parameters = ParameterVehicle(vehicle)
        with pytest.raises(UnansweredParameter, match="COM_OF_LOST: no answer after 2 tries"):
            await link.read_parameter("COM_OF_LOST", timeout_s=0.01, retries=1)
        with pytest.raises(UnknownParameter, match="1 to 16"):
            await link.read_parameter("A_NAME_THAT_IS_TOO_LONG")
        parameters.value = lambda name: [
            dialect.MAVLink_param_error_message(1, 191, name.encode(), -1, 1)
        ]
        with pytest.raises(UnknownParameter, match="has no such parameter") as told:
            await link.read_parameter("COM_OF_LOST")
        assert not isinstance(told.value, UnansweredParameter)
        parameters.value = lambda name: [
            dialect.MAVLink_param_error_message(1, 191, name.encode(), -1, 5)
        ]
        with pytest.raises(ParameterRefused, match="read-only"):
            await link.read_parameter("COM_OF_LOSS_T")


async def test_a_value_that_cannot_be_held_is_refused():
    async with linked() as (link, vehicle):
        parameters = ParameterVehicle(vehicle)
        for bad in (0.5, 2**31, float("nan")):
            with pytest.raises(ParameterRefused, match="cannot hold"):
                await link.write_parameter("COM_OBL_RC_ACT", bad)
        with pytest.raises(ParameterRefused, match="cannot hold"):
            await link.write_parameter("COM_OF_LOSS_T", float("inf"))
        parameters.locked = True
        with pytest.raises(ParameterRefused, match="keeps 0 instead of 4"):
            await link.write_parameter("COM_OBL_RC_ACT", 4)


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
async def test_what_is_no_number_is_read_as_it_came_even_of_an_integer(number):
    """ArduPilot sends integers as numbers in a float."""

    async with linked(autopilot=ARDUPILOT) as (link, vehicle):
        told = dialect.MAVLink_param_value_message(b"GUID_OPTIONS", number, INT32, 1, 0)
        vehicle.answers["PARAM_REQUEST_READ"] = lambda _: [told]
        read = await link.read_parameter("GUID_OPTIONS")
        assert isinstance(read, float)
        assert str(read) == str(number)


async def test_rates_are_asked_for_and_counted():
    async with linked() as (link, vehicle):

        def answer(message):
            if message.param1 != 31:
                return [ack(message.command, 3)]
            burst = [attitude(4 * index) for index in range(20)]
            asyncio.get_running_loop().call_later(0.02, vehicle.send, *burst)
            return [ack(message.command, 0)]

        vehicle.answers["COMMAND_LONG"] = answer
        rates = await link.set_rates(
            {"ODOMETRY": 400.0, "ATTITUDE_QUATERNION": 250.0}, window_s=0.2
        )
        first, second = vehicle.of("COMMAND_LONG")
        assert (first.command, first.param1, first.param2) == (511, 331.0, 2500.0)
        assert (second.param1, second.param2) == (31.0, 4000.0)
        assert rates["ODOMETRY"] == (400.0, 0.0, 0.0, "UNSUPPORTED")
        asked, granted, achieved, refusal = rates["ATTITUDE_QUATERNION"]
        assert (asked, granted, refusal) == (250.0, 250.0, "")
        assert 20 / 0.4 < achieved <= 20 / 0.2 + 1e-6
        with pytest.raises(UnknownMessage):
            await link.set_rates({"ATTITUDE": 50.0, "NONSENSE": 1.0})
        assert len(vehicle.of("COMMAND_LONG")) == 2


async def test_timesync_tells_how_old_a_sample_was_when_it_arrived():
    async with linked() as (link, vehicle):
        clock, ahead = asyncio.get_running_loop().time, 1000.0

        def answer(message):
            if message.tc1:
                return []
            stamp = round((clock() + ahead) * 1e9)
            return [
                dialect.MAVLink_timesync_message(stamp + 10**12, message.ts1 + 1),  # another's
                dialect.MAVLink_timesync_message(stamp, message.ts1),
            ]

        vehicle.answers["TIMESYNC"] = answer
        while not link.clock.age_known:
            stamp = round(1000 * (clock() + ahead - 0.5))
            vehicle.send(dialect.MAVLink_attitude_quaternion_message(stamp, 1, *6 * [0]))
            await asyncio.sleep(0.02)
        delay = link.clock.delay
        error = delay.largest_possible(clock()) - delay.seconds + link.timesync.round_trip_s
        assert delay.seconds == pytest.approx(0.5, abs=0.05 + error)
        age = link.clock.age(clock() + ahead - 1.0, clock())
        assert age == pytest.approx(1.0, abs=0.05 + error)
        assert link.clock.age(clock() + ahead + 1.0, clock()) == 0.0  # never negative


async def test_the_vehicles_own_timesync_is_answered():
    async with linked() as (_, vehicle):
        vehicle.send(dialect.MAVLink_timesync_message(0, 987654321))
        await until(lambda: any(message.tc1 for message in vehicle.of("TIMESYNC")))
        answers = [message for message in vehicle.of("TIMESYNC") if message.tc1]
        assert answers[0].ts1 == 987654321
