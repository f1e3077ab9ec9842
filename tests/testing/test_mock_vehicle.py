"""The public harness: a mock vehicle in memory, its pilot, its faults, and what it received."""

import asyncio
import gc
import signal
import threading
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.config.files import load
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver
from companion.mavlink.errors import EndpointError
from companion.mavlink.settings import LinkSettings
from companion.recording.flight_record import read_flight
from companion.serve.session import ServeSession
from companion.testing import (
    MockVehicle,
    Program,
    UnhandledError,
    connect,
    environment,
    fly,
    open_wire,
    run,
    serving,
    session,
)
from companion.testing.settings import mock_with_changes
from companion.testing.virtual_loop import VirtualClock
from companion.vehicle.flight_log import read_flight_log
from companion.vehicle.link import Link
from sitl_mock.config.section import ConfigError as MockConfigError
from tests.flight.fly import (
    QUICK_FLIGHT,
    QUICK_PARAMETERS,
    QuickVehicle,
    attitude_rate_hz,
    quick_flight,
)

CONFIG = Path(__file__).parents[2] / "configs" / "mock-px4.yaml"
BOTH_WAYS = pytest.mark.parametrize("lockstep", [True, False], ids=["lockstep", "free"])
SHORT = {"hover": {"duration_s": 1.0}}


def config(mock, **changes):
    return quick_flight(mock.autopilot, {**SHORT, **changes})


@BOTH_WAYS
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_it_flies_lands_and_writes_nothing_that_nobody_asked_for(autopilot, lockstep, tmp_path):
    mock = QuickVehicle(autopilot, lockstep=lockstep)
    threads = set(threading.enumerate())
    summary = fly(config(mock), mock)
    assert (summary.result, summary.phase, summary.log) == ("ok", "disarm", None)
    assert summary.tracking()["position_max_m"] < 0.1
    assert summary.as_dict()["latency_us"] == {"p50": 0.0, "p99": 0.0, "max": 0.0}
    state = mock.state()
    assert (state["armed"], state["landed"], state["crashed"]) == (False, True, False)
    # ArduPilot takes none any more once it has been told to land.
    assert len(mock.setpoints) == summary.counts.setpoints >= state["setpoints"] > 100
    assert set(threading.enumerate()) <= threads  # one of an earlier test may have ended


@BOTH_WAYS
def test_equal_flights_are_equal_to_the_bit(lockstep, tmp_path):
    logs, received = [], []
    for name in ("one", "two"):
        wind = {"speed_m_s": 2.0, "gust_m_s": 1.0}
        faults = [{"kind": "delay", "probability": 0.2, "delay_ms": 11.0}]
        mock = QuickVehicle(lockstep=lockstep, delay_s=0.0007, wind=wind, faults=faults, seed=5)
        summary = fly(config(mock), mock, tmp_path / name)
        assert summary.result == "ok", summary.events
        logs.append((tmp_path / name / "flight.tlog").read_bytes())
        received.append(mock.setpoints)
    assert logs[0] == logs[1]
    assert received[0] == received[1]


def test_without_lockstep_a_sample_is_answered_when_it_arrives_and_a_wire_takes_its_time():
    later = {}
    for delay in (0.0, 0.003):
        mock = QuickVehicle(full_rate=True, lockstep=False, delay_s=delay)
        rate = {"attitude_rate_hz": attitude_rate_hz(mock)}
        assert fly(config(mock, link=rate), mock).result == "ok"
        own = [each for each in mock.setpoints if each.sample_time_boot_ms]
        later[delay] = {round(1e6 * (each.time - each.sample_time_boot_ms / 1e3)) for each in own}
    # The autopilot takes a setpoint in the 4 ms between two of its steps.
    assert later[0.0] == {0}
    assert later[0.003] == {4000}


def test_the_pilot_takes_over_and_what_was_asked_at_a_time_or_condition_happens_once():
    mock, done = QuickVehicle(), []
    mock.at(2.0, lambda: done.append(mock.time))
    mock.when(lambda: mock.state()["setpoints"] > 240, lambda: done.append("enough"))
    mock.when(lambda: len(mock.setpoints) > 240, mock.take_over)
    summary = fly(config(mock), mock)
    assert done == [pytest.approx(2.0), "enough"]
    assert summary.result == "the pilot or another station took over: mode POSCTL"
    assert mock.state()["mode"] == "POSCTL"
    assert not mock.after_step


def test_a_ground_station_commands():
    mock = QuickVehicle()
    mock.run(1.0)
    mock.command(400, 1)  # MAV_CMD_COMPONENT_ARM_DISARM
    assert mock.until(lambda state: state["armed"], 1.0)["time"] < 1.1
    with pytest.raises(AssertionError, match="did not hold within"):
        mock.until(lambda state: not state["armed"], 0.5)


def test_faults_begin_and_end():
    mock = QuickVehicle()
    mock.inject({"kind": "refuse_arming"})
    summary = fly(config(mock, flight={"ready_timeout_s": 2.0}), mock)
    assert (summary.phase, mock.state()["armed"]) == ("checks", False)
    mock.clear_faults()
    assert fly(config(mock), mock).result == "ok"
    with pytest.raises(MockConfigError, match="fault"):
        mock.inject({"kind": "bad weather"})


def test_a_clock_that_slips_and_runs_in_bursts_is_met_as_over_udp():
    """As ArduPilot's simulator on a busy computer; ages are known by TIMESYNC."""
    oldest = []
    for slips in ((), ({"kind": "slip_clock", "slip_ms": 30.0, "after_offboard_s": 0.5},)):
        mock = QuickVehicle("ardupilot", lockstep=False, delay_s=0.0005, burst_ms=5.6, faults=slips)
        summary = fly(config(mock), mock)
        assert summary.result == "ok", summary.events
        oldest.append(summary.as_dict()["dead_time_s"]["sample_age_p99"])
    assert 0.0 < oldest[0] < 0.01
    assert oldest[1] == pytest.approx(oldest[0] + 0.03, abs=0.006)


def test_the_configuration_may_be_a_file_or_the_keys_that_differ(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("flight: {arm: true, maneuvers: [hover]}\nhover: {duration_s: 1}\n")
    hot = MockVehicle(config=CONFIG, prearm_delay_s=0.2, parameters=QUICK_PARAMETERS["px4"])
    assert fly(file, hot).result == "ok"
    cold = QuickVehicle()
    assert fly(str(file), cold, tmp_path / "log").log == tmp_path / "log"
    assert "the pilot to arm" in fly({"flight": {"arming_timeout_s": 1.0}}, QuickVehicle()).result


def test_what_cannot_be_flown_in_memory_is_refused():
    mock = QuickVehicle()
    with pytest.raises(ConfigError, match=r"link\.backend mavsdk"):
        fly({"link": {"backend": "mavsdk"}}, mock)
    with pytest.raises(MockConfigError, match="windd"):
        MockVehicle(windd={})
    settings = LinkSettings("udpin://127.0.0.1:1", lockstep=True)

    async def twice():
        async with Link(settings, opener=open_wire), Link(settings, opener=open_wire):
            pass

    with pytest.raises(EndpointError, match="open already"):
        run(mock, twice())

    async def elsewhere():
        async with Link(LinkSettings("udpin://127.0.0.1:1"), opener=open_wire):
            pass

    with pytest.raises(EndpointError, match=r"companion\.testing\.run"):
        asyncio.run(elsewhere())


def test_a_link_of_ones_own_runs_on_the_vehicles_clock():
    mock = QuickVehicle("ardupilot")

    async def listen():
        settings = LinkSettings("udpin://127.0.0.1:1", lockstep=True)
        async with Link(settings, opener=environment.open_transport) as link:
            heartbeat = await link.wait_connected(3.0)
            await asyncio.sleep(2.0)
            return heartbeat.armed, asyncio.get_running_loop().time()

    armed, now = run(mock, listen())
    assert not armed
    assert 2.0 < now < 3.1
    assert mock.time == pytest.approx(now, abs=0.01)


def test_an_error_that_nobody_takes_is_raised():
    async def careless():
        asyncio.get_running_loop().call_soon(lambda: 1 / 0)
        await asyncio.sleep(0.1)

    with pytest.raises(UnhandledError) as raised:
        run(QuickVehicle(), careless())
    assert isinstance(raised.value.__cause__, ZeroDivisionError)


class Interrupts(SilentObserver):
    def __init__(self):
        self.session = None

    def waiting(self, name, waiting_for, elapsed, timeout):
        if name == "maneuvers":
            self.session.interrupt("enough")


def test_a_session_can_be_interrupted():
    mock, observer = QuickVehicle(), Interrupts()
    observer.session = session(config(mock, hover={"duration_s": 9.0}), mock, observer=observer)
    assert run(mock, observer.session.fly()).result == "enough"
    assert (mock.state()["mode"], mock.state()["armed"]) == ("LOITER", True)


def test_ctrl_c_ends_more_than_the_flight_in_which_it_comes():
    mock = QuickVehicle()
    mock.at(3.0, lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        fly(config(mock), mock)
    assert 3.0 <= mock.time < 4.0


def test_many_flights_leave_nothing_behind():
    def once():
        mock = QuickVehicle()
        assert fly(config(mock, flight={"arming_timeout_s": 0.5, "arm": False}), mock).log is None

    once()
    gc.collect()
    files = len(list(Path("/proc/self/fd").iterdir()))
    threads = set(threading.enumerate())
    objects = len(gc.get_objects())
    for _ in range(5):
        once()
    gc.collect()
    assert len(list(Path("/proc/self/fd").iterdir())) == files
    assert set(threading.enumerate()) <= threads  # one of an earlier test may have ended
    assert len(gc.get_objects()) - objects < 200


def test_a_session_of_serve_that_ends_before_its_network_is_told(monkeypatch):
    async def ended(_):
        return {}

    async def main():
        async with asyncio.timeout(5.0):
            async with serving(config(mock), mock):
                pass

    mock = QuickVehicle()
    monkeypatch.setattr(ServeSession, "run", ended)
    with pytest.raises(RuntimeError, match="before its network was open"):
        run(mock, main())


def test_a_program_that_is_not_connected_cannot_send():
    program = Program("tests")
    program.disconnect()
    with pytest.raises(RuntimeError, match=r"call connect\(session\) first"):
        program.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


def test_a_client_hears_what_comes_next_until_it_disconnects():
    async def main():
        async with serving(config(mock), mock) as served:
            program = Program("tests").connect(served)
            program.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            first = await program.hears("ATTITUDE_QUATERNION", 5.0)
            second = await program.hears("ATTITUDE_QUATERNION", 5.0)
            assert second.time_boot_ms > first.time_boot_ms
            program.disconnect()
            await asyncio.sleep(0.1)
            heard = len(program.heard)
            with pytest.raises(TimeoutError):
                await program.hears("ATTITUDE_QUATERNION", 0.5)
            assert len(program.heard) == heard

    mock = QuickVehicle()
    run(mock, main())


def test_a_key_below_one_that_is_no_section_is_refused():
    with pytest.raises(ConfigError, match=r"mock\.seed\.deep cannot be set: mock\.seed is 1"):
        mock_with_changes({"seed": 1}, {"seed.deep": 2})


@pytest.mark.parametrize("collecting", [True, False])
def test_a_flight_leaves_the_garbage_collector_as_it_was(collecting):
    async def main():
        return gc.isenabled()

    try:
        if not collecting:
            gc.disable()
        assert run(QuickVehicle(), main()) is False
        assert gc.isenabled() is collecting
    finally:
        gc.enable()


def test_a_lockstep_clock_goes_only_forward():
    clock = VirtualClock(3.0)
    assert clock.advance(5.0)
    assert not clock.advance(5.0)
    assert not clock.advance(4.0)
    assert clock.read() == 5.0


def test_what_is_no_program_no_configuration_or_no_fault_is_refused_in_a_sentence():
    mock = QuickVehicle()

    async def main(config):
        async with connect(config, mock):
            pass

    with pytest.raises(ValueError, match=r"coroutine was expected, as in run\(vehicle, main\(\)\)"):
        run(mock, main)
    with pytest.raises(TypeError, match="config must be a Config, a path or a dict of sections"):
        run(mock, main(5))
    with pytest.raises(ConfigError, match="`limit` is not a known key; did you mean `limits`"):
        run(mock, main({"limit": {"max_tilt_deg": 20.0}}))
    with pytest.raises(ConfigError, match="`flight` is a section"):
        run(mock, main({"flight": 5}))
    with pytest.raises(ConfigError, match="`include` works only in a YAML file"):
        run(mock, main({"include": "px4.yaml"}))
    with pytest.raises(RuntimeError, match=r"call `connect` inside `run\(vehicle, main\(\)\)`"):
        asyncio.run(main({}))
    with pytest.raises(MockConfigError, match="a fault is written as"):
        mock.inject("gps_loss")
    with pytest.raises(
        MockConfigError, match=r"MockVehicle: unknown key mock\.wnd; did you mean wind"
    ):
        MockVehicle("px4", wnd={})


def test_a_link_that_cannot_be_opened_is_told_once():
    """The flight's own error was told a second time, as one that nobody took."""
    mock = QuickVehicle()

    async def main():
        async with connect(QUICK_FLIGHT, mock):
            with pytest.raises(EndpointError, match="open already"):
                async with connect(QUICK_FLIGHT, mock):
                    pass
            gc.collect()

    run(mock, main())  # raises UnhandledError if nobody took it


def test_a_program_gets_a_folder_of_its_flight_that_there_was_not_before(tmp_path):
    """`fly` made it, `connect` failed on it with a FileNotFoundError."""
    mock, folder = QuickVehicle(), tmp_path / "flights" / "mine"

    async def main():
        async with connect(QUICK_FLIGHT, mock, str(folder)):
            pass

    run(mock, main())
    assert {"config.yaml", "flight.mcap", "flight.tlog"} <= {path.name for path in folder.iterdir()}


def test_paths_may_be_text_and_a_channel_that_there_is_not_is_named_with_all(tmp_path):
    mock = QuickVehicle()
    assert fly(config(mock), mock, folder=str(tmp_path / "one")).result == "ok"
    record = read_flight(str(tmp_path / "one"))
    assert len(record.rows("setpoint")) > 0
    with pytest.raises(KeyError, match=r"no channel 'setpiont'; there are .*setpoint"):
        record.rows("setpiont")
    assert load(str(CONFIG)) == load(CONFIG)
    log = read_flight_log(str(tmp_path / "one" / "flight.tlog"))
    assert len(log.setpoints) > 0
