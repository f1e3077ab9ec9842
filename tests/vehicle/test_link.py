"""The link over UDP: samples in, setpoints out, and nothing else on its own account."""

import asyncio
import math
import random
from dataclasses import asdict

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink.errors import (
    EndpointError,
    InvalidSetpoint,
    LinkError,
    LinkTimeout,
    NotConnected,
    UnsupportedAutopilot,
)
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.free_port import free_port
from companion.vehicle.link import Link
from tests.mavlink.fakes import FakeVehicle, attitude, frames_of, heartbeat, linked, until

LEVEL = BodyRates(0.0, 0.0, 0.0)


async def test_an_error_while_a_sample_is_made_keeps_the_frame_and_those_after_it():
    """An event of the vehicle's clock is told within the sample's way, and its taker may fail."""

    async with linked() as (link, vehicle):
        errors, heard = [], []
        link.on_error = errors.append
        link.subscribe("ATTITUDE_QUATERNION", heard.append)
        taken, link.clock.take = link.clock.take, lambda *_: 1 / 0
        vehicle.send(attitude(4, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        await until(lambda: heard)
        link.clock.take = taken
        assert [type(error) for error in errors] == [ZeroDivisionError]


async def test_a_sample_is_answered_by_one_setpoint():
    async with linked() as (link, vehicle):
        samples = []

        def control(sample):
            samples.append(sample)
            link.send_setpoint(sample.time_boot_ms, BodyRates(0.5, -0.25, 0.125), 0.5)

        link.on_attitude = control
        for stamp in (4, 8, 12):
            vehicle.send(attitude(stamp, 0.5, -0.5, 0.5, -0.5, 1.0, 2.0, 4.0))
        setpoints = await vehicle.hears("SET_ATTITUDE_TARGET", 3)
        assert [sample.time_boot_ms for sample in samples] == [4, 8, 12]
        assert samples[1].vehicle_time == pytest.approx(0.008)
        assert samples[0].q == (0.5, -0.5, 0.5, -0.5)
        assert samples[0].body_rates == BodyRates(1.0, 2.0, 4.0)
        assert samples[0].received_ns > 0
        assert [setpoint.time_boot_ms for setpoint in setpoints] == [4, 8, 12]
        for sent in setpoints:
            assert (sent.target_system, sent.target_component, sent.type_mask) == (1, 1, 128)
            assert sent.q == [1.0, 0.0, 0.0, 0.0]
            rates = (sent.body_roll_rate, sent.body_pitch_rate, sent.body_yaw_rate)
            assert rates == (0.5, -0.25, 0.125)
            assert sent.thrust == 0.5
            assert (sent.get_srcSystem(), sent.get_srcComponent()) == (1, 191)


async def test_our_heartbeat_says_onboard_controller_and_repeats_no_setpoint():
    async with linked(heartbeat_rate_hz=200.0) as (link, vehicle):
        link.send_setpoint(4, LEVEL, 0.5)
        beat = (await vehicle.hears("HEARTBEAT", 10))[-1]
        assert (beat.type, beat.autopilot, beat.system_status) == (18, 8, 4)
        assert len(vehicle.of("SET_ATTITUDE_TARGET")) == 1


async def test_a_bad_setpoint_sends_nothing():
    async with linked() as (link, vehicle):
        sent = link.stats.sent
        with pytest.raises(InvalidSetpoint, match="must be finite"):
            link.send_setpoint(4, BodyRates(math.nan, 0.0, 0.0), 0.5)
        assert link.stats.sent == sent
        assert vehicle.of("SET_ATTITUDE_TARGET") == []


async def test_a_sample_with_nan_is_counted_not_delivered():
    async with linked() as (link, vehicle):
        samples = []
        link.on_attitude = samples.append
        vehicle.send(attitude(4, math.nan, 0, 0, 0, 0, 0, 0), attitude(8))
        await until(lambda: samples)
        assert [sample.time_boot_ms for sample in samples] == [8]
        assert link.stats.non_finite == 1


async def test_what_a_callback_raises_is_reported_and_the_stream_goes_on():
    async with linked() as (link, vehicle):
        errors, samples = [], []

        def control(sample):
            samples.append(sample)
            raise RuntimeError("planner broke")

        link.on_attitude, link.on_error = control, errors.append
        vehicle.send(attitude(4), attitude(8))
        await until(lambda: len(samples) == 2)
        assert [str(error) for error in errors] == ["planner broke"] * 2
        link.on_attitude = None
        vehicle.send(attitude(12), heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert len(errors) == 2


async def test_a_failing_tap_does_not_end_the_link():
    def tap(_time, _frame):
        raise OSError("disk full")

    errors = []
    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0"), tap) as link:
        link.on_error = errors.append
        vehicle = await FakeVehicle(link.local_address).open_udp()
        vehicle.send(heartbeat(), heartbeat())
        await until(lambda: len(errors) >= 2)
        assert {str(error) for error in errors} == {"disk full"}
        vehicle.close()


async def test_a_task_of_the_link_that_fails_is_reported(monkeypatch):
    async with linked(heartbeat_rate_hz=100.0) as (link, _):
        errors = []
        link.on_error = errors.append
        monkeypatch.setattr(link._outbox, "send_heartbeat", lambda: 1 / 0)
        await until(lambda: errors)
        assert [type(error) for error in errors] == [ZeroDivisionError]


async def test_only_the_configured_system_and_component_are_heard():
    async with linked() as (link, vehicle):
        samples = []
        link.on_attitude = samples.append
        for frame in frames_of(attitude(1), system=2) + frames_of(attitude(2), component=191):
            vehicle.send_raw(frame)
        vehicle.send(attitude(3))
        await until(lambda: samples)
        assert [sample.time_boot_ms for sample in samples] == [3]
        assert link.stats.ignored_foreign == 2


async def test_a_stranger_gets_no_setpoints_and_is_not_heard():
    async with linked() as (link, vehicle):
        stranger = await FakeVehicle(link.local_address).open_udp()
        stranger.send(attitude(1))
        samples = []
        link.on_attitude = samples.append
        vehicle.send(attitude(2))
        await until(lambda: samples)
        assert [sample.time_boot_ms for sample in samples] == [2]
        link.send_setpoint(2, LEVEL, 0.5)
        await vehicle.hears("SET_ATTITUDE_TARGET")
        assert stranger.heard == []
        stranger.close()


async def test_a_datagram_of_garbage_does_not_make_a_peer():
    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0")) as link:
        stranger = await FakeVehicle(link.local_address).open_udp()
        vehicle = await FakeVehicle(link.local_address).open_udp()
        stranger.send_raw(b"GET / HTTP/1.1\r\n")
        vehicle.send(heartbeat())
        await link.wait_connected(5.0)
        link.send_setpoint(0, LEVEL, 0.5)
        await vehicle.hears("SET_ATTITUDE_TARGET")
        assert stranger.heard == []
        stranger.close()
        vehicle.close()


async def test_udp_outwards_survives_a_vehicle_that_is_not_there_yet():
    port = free_port()
    settings = LinkSettings(endpoint=f"udpout://127.0.0.1:{port}", heartbeat_rate_hz=100.0)
    async with Link(settings) as link:
        await until(lambda: link.stats.not_sent >= 1)  # refused by ICMP
        vehicle = await FakeVehicle().open_udp(port=port)
        await vehicle.hears("HEARTBEAT")
        vehicle.send(heartbeat())
        assert (await link.wait_connected(5.0)).mode == "AUTO.LOITER"
        vehicle.close()


async def test_the_tap_sees_both_directions_and_only_the_vehicle():
    taken = []
    async with linked(tap=lambda time, frame: taken.append((time, frame))) as (link, vehicle):
        await vehicle.hears("HEARTBEAT")
        taken.clear()
        vehicle.send_raw(frames_of(attitude(1), system=9)[0])
        [frame] = frames_of(attitude(2), start=vehicle.mav.seq)
        vehicle.send_raw(frame)
        link.on_attitude = lambda sample: link.send_setpoint(sample.time_boot_ms, LEVEL, 0.25)
        [setpoint] = await vehicle.hears("SET_ATTITUDE_TARGET")
        hot = [raw for _, raw in taken if raw[7] in (31, 82)]
        assert hot == [frame, bytes(setpoint.get_msgbuf())]
        assert all(time <= asyncio.get_running_loop().time() for time, _ in taken)


async def test_losses_are_counted_by_the_gaps():
    async with linked() as (link, vehicle):
        vehicle.mav.seq = (vehicle.mav.seq + 5) & 0xFF
        vehicle.send(heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert link.stats.lost == 5
        # A message of another dialect is not understood, but it is not lost.
        unknown = bytearray(frames_of(heartbeat(), start=vehicle.mav.seq)[0])
        unknown[9] = 1  # message id 65536
        vehicle.send_raw(bytes(unknown))
        vehicle.mav.seq = (vehicle.mav.seq + 1) & 0xFF
        vehicle.send(heartbeat(0x03040000))
        await until(lambda: link.state.mode == "AUTO.LOITER")
        assert (link.stats.unknown, link.stats.lost) == (1, 5)


async def test_subscribers_get_decoded_messages_until_they_leave():
    async with linked() as (link, vehicle):
        heard = []
        leave = link.subscribe("VFR_HUD", heard.append)
        vehicle.send(dialect.MAVLink_vfr_hud_message(1.0, 2.0, 90, 50, 30.0, -1.0))
        await until(lambda: heard)
        assert (heard[0].get_type(), heard[0].heading, heard[0].alt) == ("VFR_HUD", 90, 30.0)
        leave()
        leave()
        vehicle.send(dialect.MAVLink_vfr_hud_message(1.0, 2.0, 90, 50, 30.0, -1.0))
        vehicle.send(heartbeat(0x00060000))
        await until(lambda: link.state.mode == "OFFBOARD")
        assert len(heard) == 1


async def test_no_vehicle_is_said_clearly():
    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0")) as link:
        with pytest.raises(NotConnected):
            _ = link.autopilot
        with pytest.raises(LinkTimeout, match="is the vehicle running"):
            await link.wait_connected(0.02)
        other = await FakeVehicle(link.local_address).open_udp()
        other.send_raw(frames_of(heartbeat(), system=2)[0])
        with pytest.raises(LinkTimeout, match="target_system right"):
            await link.wait_connected(0.1)
        other.close()


async def test_heartbeats_of_another_part_do_not_prolong_the_wait_for_the_autopilots():
    """As on a serial port, where every part with the autopilot's ids is heard."""
    part = heartbeat(autopilot=8)
    part.pack(dialect.MAVLink(None))

    async def chatter(link):
        while True:
            link._dispatcher.dispatch(part.get_msgId(), bytes(part.get_payload()))
            await asyncio.sleep(0.02)

    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0")) as link:
        chattering = asyncio.create_task(chatter(link))
        with pytest.raises(LinkTimeout):
            async with asyncio.timeout(3.0):
                await link.wait_connected(0.1)
        chattering.cancel()


async def test_a_position_is_known_with_the_stamp_of_the_vehicles_clock():
    async with linked() as (link, vehicle):
        vehicle.send(dialect.MAVLink_local_position_ned_message(2500, 1, 2, -3, 0, 0, 0))
        await until(lambda: link.state.position)
        assert link.state.position.vehicle_time == 2.5


async def test_an_autopilot_we_do_not_know_is_refused():
    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0")) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        vehicle.send(heartbeat(autopilot=4))
        with pytest.raises(UnsupportedAutopilot, match="MAV_AUTOPILOT 4"):
            await link.wait_connected(5.0)
        vehicle.close()


async def test_a_busy_port_is_said_with_a_way_out():
    async with Link(LinkSettings(endpoint="udpin://127.0.0.1:0")) as link:
        host, port = link.local_address
        with pytest.raises(EndpointError, match="in use by another program"):
            async with Link(LinkSettings(endpoint=f"udpin://{host}:{port}")):
                pass


async def test_lockstep_needs_its_own_loop():
    with pytest.raises(LinkError, match=r"lockstep\.run"):
        Link(LinkSettings(endpoint="udpin://127.0.0.1:0", lockstep=True))


def mutated(source, frames):
    kind = source.randrange(4)
    if kind == 0:
        return source.randbytes(source.randrange(1, 300))
    frame = bytearray(source.choice(frames))
    if kind == 1:
        frame[source.randrange(len(frame))] ^= 1 << source.randrange(8)
    elif kind == 2:
        del frame[source.randrange(1, len(frame)) :]
    else:
        frame = bytearray(b"\xfd") + frame[: source.randrange(len(frame))] + source.randbytes(9)
    return bytes(frame)


def test_ten_thousand_mutated_datagrams_change_nothing():
    """Item 6: through the whole receive path, straight into the socket's reader."""

    async def scene():
        async with linked() as (link, vehicle):
            await vehicle.hears("TIMESYNC")
            samples, errors = [], []
            link.on_attitude, link.on_error = samples.append, errors.append
            state = {name: value for name, value in vars(link.state).items() if name[0] != "_"}
            before = asdict(link.stats)
            source = random.Random(20260909)
            frames = frames_of(
                heartbeat(0x00060000, armed=True),
                attitude(4),
                dialect.MAVLink_command_ack_message(400, 0),
                dialect.MAVLink_local_position_ned_message(4, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
                dialect.MAVLink_statustext_message(3, b"lies", 0, 0),
                dialect.MAVLink_extended_sys_state_message(0, 2),
            )
            for index in range(10_000):
                vehicle.send_raw(mutated(source, frames))
                if index % 16 == 0:  # let the link read, so that the kernel drops none
                    await asyncio.sleep(0)
                    await asyncio.sleep(0)
            vehicle.send(heartbeat())
            await until(lambda: link.stats.frames > before["frames"])
            after = {name: value for name, value in vars(link.state).items() if name[0] != "_"}
            state.pop("heartbeat"), after.pop("heartbeat")
            assert after == state
            assert (samples, errors) == ([], [])
            assert link.stats.frames == before["frames"] + 1
            assert link.stats.bad_crc > 1000
            assert link.state.mode == "AUTO.LOITER"

    asyncio.run(scene())
