"""The mock over real sockets: paced time, lockstep, ports, signals, the control channel."""

import random
import signal
import socket
import subprocess
import sys
import time
from itertools import pairwise

import pytest
from mock_process import HOST, Client, ask, free_gcs_port, free_port, mock_process, started_by_hand
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.settings import GCS_PORT_OFFSET, PORT_OFFSET
from sitl_mock.exchange import burst_time
from sitl_mock.link.endpoint import joined_datagrams
from sitl_mock.link.framing import Framer, decode
from sitl_mock.settings import MockSettings

FAST = "MPC_TKO_RAMP_T: 0.3, COM_SPOOLUP_TIME: 0.1, MPC_TKO_SPEED: 3.0"


def flight(client):
    """A client that arms, takes off, hands over to rates, and answers every step."""

    def act(now):
        if now % 1000 == 0:
            client.send(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
        if now == 0:
            client.command(511, 31, 4000)
        if now == 5000:
            client.command(176, 1, 4, 2)
            client.command(400, 1)
        if now == 9000:
            client.command(176, 1, 6)
        if now < 8000:
            return False
        roll = 0.3 if now % 1000 < 500 else -0.3
        client.send(
            dialect.MAVLink_set_attitude_target_message(
                now, 1, 1, 128, [1, 0, 0, 0], roll, 0.0, 0.0, 0.4903
            )
        )
        return True

    return act


def fly(seed, tmp_path, *extra):
    port = free_port()
    config = tmp_path / f"{seed}.yaml"
    config.write_text(f"mock: {{gcs_port: 0, wind: {{gust_m_s: 1}}, parameters: {{{FAST}}}}}")
    arguments = ("--config", config, "--lockstep", "--port", port, "--seed", seed)
    with Client(port) as client, mock_process(*arguments, *extra):
        return client.lockstep(12_000, flight(client))


@pytest.mark.slow
def test_a_lockstep_flight_is_the_same_to_the_bit_for_a_seed(tmp_path):
    first, again, other = (fly(seed, tmp_path) for seed in (5, 5, 6))
    assert len(first) >= 3000
    assert first == again
    assert first != other
    modes = [m.custom_mode for d in first for m in decode(d) if m.get_type() == "HEARTBEAT"]
    assert 0x00060000 in modes


def test_in_lockstep_nothing_flies_before_the_first_answer():
    port = free_port()
    with Client(port) as client, mock_process("--lockstep", "--port", port, "--gcs-port", 0):
        for _ in range(4):
            (beacon,) = decode(client.receive())
            assert (beacon.get_type(), beacon.time_boot_ms, beacon.time_unix_usec) == (
                "SYSTEM_TIME", 0, 0,
            )  # fmt: skip
        client.answer(0)
        assert client.wait_for("SYSTEM_TIME", lambda m: m.time_boot_ms > 0).time_boot_ms == 4


def test_one_sample_a_step_and_the_beacon_last():
    port = free_port()
    with Client(port) as client, mock_process("--lockstep", "--port", port, "--gcs-port", 0):
        client.lockstep(0, lambda _: client.command(511, 31, 1000))
        step = []
        while len(step) < 400:
            for message in decode(client.receive()):
                step.append(message)
                if message.get_type() == "SYSTEM_TIME":
                    client.answer(message.time_boot_ms)
        times = [m.time_boot_ms for m in step if m.get_type() == "ATTITUDE_QUATERNION"]
        assert times == list(range(times[0], times[-1] + 1, 4))
        last = None
        for message in step:
            if message.get_type() == "ATTITUDE_QUATERNION":
                last = message.time_boot_ms
            elif message.get_type() == "SYSTEM_TIME" and last is not None:
                assert message.time_boot_ms == last


def test_an_unanswered_beacon_comes_again_then_time_runs_by_itself_then_lockstep_returns(tmp_path):
    port = free_port()
    config = tmp_path / "mock.yaml"
    config.write_text("mock: {gcs_port: 0, lockstep: {enabled: true, patience_s: 0.5}}")
    with Client(port) as client, mock_process("--config", config, "--port", port):
        client.lockstep(400, lambda _: False)
        first, second = (client.wait_for("SYSTEM_TIME") for _ in range(2))
        assert first.time_boot_ms == second.time_boot_ms == 404
        later = client.wait_for("SYSTEM_TIME", lambda m: m.time_boot_ms > 800)
        for _ in range(100):  # an answer may come too late for its beacon, not for ever
            client.answer(later.time_boot_ms)
            later, again = (client.wait_for("SYSTEM_TIME") for _ in range(2))
            if later.time_boot_ms == again.time_boot_ms:
                break
            later = again
        assert later.time_boot_ms == again.time_boot_ms


def test_a_client_that_answers_only_samples_keeps_lockstep():
    port = free_port()
    with Client(port) as client, mock_process("--lockstep", "--port", port, "--gcs-port", 0):
        client.lockstep(0, lambda _: client.command(511, 31, 4000))
        client.wait_for("ATTITUDE_QUATERNION")
        seen = []
        while len(seen) < 300:
            for message in decode(client.receive()):
                if message.get_type() == "ATTITUDE_QUATERNION":
                    seen.append(message.time_boot_ms)
                    client.send(
                        dialect.MAVLink_set_attitude_target_message(
                            message.time_boot_ms, 1, 1, 128, [1, 0, 0, 0], 0, 0, 0, 0
                        )
                    )
                elif message.get_type() == "SYSTEM_TIME" and not seen:
                    client.answer(message.time_boot_ms)
        assert seen == list(range(seen[0], seen[-1] + 1, 4))


def test_link_faults_spare_the_beacon(tmp_path):
    port = free_port()
    config = tmp_path / "mock.yaml"
    config.write_text("mock: {gcs_port: 0, faults: [{kind: drop, at_s: 0.5}]}")
    arguments = ("--config", config, "--port", port, "--lockstep")
    with Client(port) as client, mock_process(*arguments):
        early = client.lockstep(500, lambda _: False)
        late = client.lockstep(2000, lambda _: False)
    assert max(len(decode(datagram)) for datagram in early) > 1
    assert {m.get_type() for d in late for m in decode(d)} == {"SYSTEM_TIME"}


def test_telemetry_goes_to_the_first_sender_and_a_second_is_obeyed_in_silence():
    port, control = free_port(), free_port()
    arguments = ("--port", port, "--gcs-port", 0, "--control-port", control, "--speed", 5)
    with Client(port) as listener, mock_process(*arguments):
        listener.wait_for("HEARTBEAT")
        with Client(free_port()) as first, Client(free_port()) as second:
            first.mock = second.mock = listener.mock
            first.command(512, 148)
            first.wait_for("AUTOPILOT_VERSION")
            second.command(176, 1, 4, 6)
            first.wait_for("COMMAND_ACK", lambda m: m.command == 176)
            second.socket.settimeout(0.3)
            with pytest.raises(TimeoutError):
                second.receive()
        assert ask(control, {"state": True})["mode"] == "LAND"


def test_speed_paces_vehicle_time():
    port, control = free_port(), free_port()
    arguments = ("--port", port, "--gcs-port", 0, "--control-port", control, "--speed", 4)
    with Client(port) as client, mock_process(*arguments):
        stamps = [client.wait_for("ATTITUDE").time_boot_ms for _ in range(50)]
        assert stamps == sorted(stamps)
        assert ask(control, {"state": True})["time"] >= stamps[-1] / 1000


def test_timesync_between_slots_is_finer_than_the_slots():
    port = free_port()
    with Client(port) as client, mock_process("--port", port, "--gcs-port", 0):
        client.wait_for("HEARTBEAT")
        answers = []
        for number in range(1, 30):
            client.send(dialect.MAVLink_timesync_message(0, number))
            answers.append(client.wait_for("TIMESYNC", lambda m, n=number: m.ts1 == n).tc1)
        assert answers == sorted(answers)
        assert any(answer % 4_000_000 for answer in answers)


def test_the_ground_station_has_a_link_of_its_own():
    port, gcs_port = free_port(), free_gcs_port()
    arguments = ("--port", port, "--gcs-port", gcs_port)
    with Client(port) as companion, Client(gcs_port) as station, mock_process(*arguments):
        station.mock = (HOST, gcs_port + GCS_PORT_OFFSET)
        station.wait_for("HEARTBEAT")
        station.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        station.command(400, 1)
        assert "Arming denied" in station.wait_for("STATUSTEXT").text
        assert station.wait_for("COMMAND_ACK").result == 1
        names = set()
        while "HEARTBEAT" not in names or "ATTITUDE_QUATERNION" not in names:
            names |= {m.get_type() for m in decode(companion.receive())}
        assert "STATUSTEXT" not in names


def test_several_vehicles_have_ids_and_ports_of_their_own():
    port = free_port(2)
    arguments = ("--port", port, "--gcs-port", 0, "--count", 2)
    with Client(port) as one, Client(port + 1) as two, mock_process(*arguments):
        assert one.wait_for("HEARTBEAT").get_srcSystem() == 1
        assert two.wait_for("HEARTBEAT").get_srcSystem() == 2


def test_control_channel():
    port, control = free_port(), free_port()
    arguments = ("--port", port, "--gcs-port", 0, "--control-port", control, "--speed", 10)
    with Client(port) as client, mock_process(*arguments):
        client.wait_for("HEARTBEAT")
        state = ask(control, {"state": True})
        assert state["armed"] is False
        assert state["mode"] == "LOITER"
        assert len(state["q"]) == 4
        assert state["setpoints"] == 0
        assert state["touchdown_speed"] is None
        assert ask(control, {"fault": {"kind": "stop_telemetry"}}) == {"ok": True}
        assert falls_silent(client)
        assert ask(control, {"clear": True}) == {"ok": True}
        client.socket.settimeout(10)
        client.wait_for("ATTITUDE")
        for bad in (b"\xff", b"[]", {"fault": {"kind": "nope"}}, {"what": 1}, {"clear": False},
                    b"[" * 5000):  # fmt: skip
            assert "error" in ask(control, bad)


EVENTS = (410, 411)
"""EVENT and CURRENT_EVENT_SEQUENCE, which are no telemetry: they go on."""


def falls_silent(client):
    """Whether no telemetry comes for 0.3 s, once what was under way has come."""
    client.socket.settimeout(0.3)
    silent_since = time.monotonic()
    for _ in range(1000):
        try:
            datagram = client.receive()
        except TimeoutError:
            return True
        if datagram[7] | datagram[8] << 8 not in EVENTS:
            silent_since = time.monotonic()
        elif time.monotonic() - silent_since > 0.3:
            return True
    return False


def test_random_datagrams_over_the_socket_change_nothing():
    rng = random.Random(1)
    port, control = free_port(), free_port()
    arguments = ("--port", port, "--gcs-port", 0, "--control-port", control, "--speed", 5)
    frame = Framer(255, 190).frame(dialect.MAVLink_command_long_message(1, 1, 400, 0, *[0.0] * 7))
    with Client(port) as client, mock_process(*arguments):
        client.wait_for("HEARTBEAT")
        for number in range(2000):
            data = bytearray(frame) if number % 2 else bytearray(rng.randbytes(rng.randrange(99)))
            if data:
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            client.socket.sendto(bytes(data), client.mock)
            if number % 50 == 49:  # let the mock keep up: a full socket buffer drops datagrams
                client.command(512, 148)
                client.wait_for("AUTOPILOT_VERSION")
        state = ask(control, {"state": True})
        assert (state["armed"], state["mode"], state["setpoints"]) == (False, "LOITER", 0)


def test_a_busy_port_is_one_clear_error():
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((HOST, port + PORT_OFFSET))
        run = subprocess.run(
            [sys.executable, "-m", "sitl_mock", "--headless", "--port", str(port)],
            capture_output=True, text=True, timeout=20, check=False,
        )  # fmt: skip
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert str(port + PORT_OFFSET) in run.stderr
    assert "different --port\n" in run.stderr


def test_ctrl_c_ends_well():
    port = free_port()
    by_hand = mock_process("--port", port, "--gcs-port", 0, start=started_by_hand)
    with Client(port) as client, by_hand as process:
        client.wait_for("HEARTBEAT")
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 0


def test_bundles_keep_order_and_fit():
    rng = random.Random(1)
    frames = [rng.randbytes(rng.randrange(12, 280)) for _ in range(60)]
    joined = joined_datagrams(frames)
    assert b"".join(joined) == b"".join(frames)
    assert max(map(len, joined)) <= 1400
    assert len(joined) < 12
    assert joined_datagrams([]) == []


def test_bursts_come_as_often_as_recorded():
    """ardupilot-circle-5ms, -corners, -identify: every 5.4 to 5.8 ms, 20 to 28 % in pairs."""
    burst_s = MockSettings.model_validate({"autopilot": "ardupilot"}).burst_ms * 1e-3
    slots = [n * 0.0025 for n in range(1, 4001)]
    # 250 Hz of the 400 Hz loop, five slots of eight.
    samples = [slot for number, slot in enumerate(slots) if number % 8 in (1, 3, 4, 6, 7)]
    times = [burst_time(each, burst_s) for each in samples]
    waited = [burst - slot for burst, slot in zip(times, samples, strict=True)]
    assert -1e-9 < min(waited) < max(waited) < burst_s
    paired = sum(after - before < 1e-6 for before, after in pairwise(times)) / len(times)
    assert 0.18 < paired < 0.42
    assert burst_time(0.0123, 0.0) == 0.0123
