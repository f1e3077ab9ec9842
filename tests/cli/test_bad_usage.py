"""The command line against nonsense: numbers and hosts that are none, Ctrl-C and kill."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from companion.cli.main import main
from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import parse_endpoint
from sitl_mock.__main__ import main as start_vehicle
from tests.cli.test_demo import quick_demo
from tests.flight.programs import Program

NO_NUMBERS = ["nan", "inf", "-inf", "-1", "0", "1e308", "soon", "9" * 400]
NO_HOSTS = ["a" * 64, f"{'a.' * 130}com", "a..b", ".a", "a b", "a\0b", "\ud800", "ß" * 64]


@pytest.mark.parametrize("number", NO_NUMBERS)
@pytest.mark.parametrize(
    "command",
    [
        ("bench", "link", "--seconds"),
        ("bench", "link", "--rate"),
        ("bench", "planner", "--seconds"),
        ("doctor", "--config", "c.yaml", "--wait"),
    ],
)
def test_a_number_that_is_none_is_wrong_usage(command, number, capsys):
    with pytest.raises(SystemExit) as ending:
        main([*command[:-1], f"{command[-1]}={number}"])
    assert ending.value.code == 2
    assert f"{command[-1]}: must be a number from" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("demo --manouvers hover", "demo: error: unrecognized arguments: --manouvers hover; did "),
        ("demo --manouvers=hover", "you mean --maneuvers?"),
        ("demo my.yaml", "demo: error: unrecognized arguments: my.yaml; did you mean --config my."),
        ("fly --arm my.yaml", "required: --config; did you mean --config my.yaml?"),
        ("identify my.yml", "--log is required; did you mean --config my.yml?"),
        ("fly --trajectory a.yaml", "arguments are required: --config\n"),
        ("fly my.yaml --set", "--set: expected one argument\n"),
        ("bench link --secnds 3", "bench link: error: unrecognized arguments: --secnds 3; did you"),
        ("plot one two.yaml", "plot: error: unrecognized arguments: two.yaml\n"),
        ("demo --xyz", "unrecognized arguments: --xyz\n"),
    ],
)
def test_an_argument_that_a_command_does_not_take_gets_the_usage_of_that_command(
    typed, told, capsys
):
    with pytest.raises(SystemExit) as ending:
        main(typed.split())
    error = capsys.readouterr().err
    assert ending.value.code == 2
    assert told in error
    assert error.startswith(f"usage: companion {typed.split()[0]} ")


@pytest.mark.parametrize("number", [*NO_NUMBERS, "0.5"])
@pytest.mark.parametrize("option", ["--speed", "--seed", "--port", "--gcs-port", "--count"])
def test_the_vehicle_refuses_numbers_that_are_none(option, number, capsys):
    allowed = {("--speed", "0.5"), ("--seed", "0"), ("--gcs-port", "0")}
    try:
        code = start_vehicle([f"{option}={number}", *([] if option == "--count" else ["--check"])])
    except SystemExit as ending:  # argparse's own way
        code = ending.code
    assert code == (0 if (option, number) in allowed else 2)
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("host", NO_HOSTS)
@pytest.mark.parametrize("scheme", ["udpin", "udpout", "tcp", "tcpin"])
def test_a_host_that_is_none_is_no_endpoint(scheme, host, tmp_path):
    with pytest.raises(EndpointError, match="endpoint"):
        parse_endpoint(f"{scheme}://{host}:14540")
    with pytest.raises(EndpointError, match="endpoint"):
        parse_endpoint(f"udpin://0.0.0.0:14540?peer={host}")
    config = tmp_path / "c.yaml"
    config.write_text("flight: {maneuvers: [hover]}")
    assert main(["fly", "--config", str(config), "--endpoint", f"{scheme}://{host}:14540"]) == 2
    assert start_vehicle(["--endpoint", f"tcpin://{host}:14540", "--check"]) == 2


@pytest.mark.parametrize("host", ["vehicle", "a-b.example.org", "192.0.2.1", "[::1]", "ß.example"])
def test_a_host_that_may_be_one_is_an_endpoint(host):
    assert parse_endpoint(f"udpout://{host}:14540").host == host.strip("[]")


@pytest.mark.parametrize("port", ["9" * 5000, "65536", "-1", "1e4"])
def test_a_port_that_is_none_is_no_endpoint(port):
    for text in (f"udpin://h:{port}", f"udpin://h:1?peer=h:{port}"):
        with pytest.raises(EndpointError):
            parse_endpoint(text)
    with pytest.raises(EndpointError):
        parse_endpoint(f"serial:///dev/ttyACM0:{'9' * 5000}")


def started(folder, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "companion", *arguments],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def loads(process, module):
    """Wait until a program maps an extension module: it is in the middle of its imports."""
    maps = Path(f"/proc/{process.pid}/maps")
    for _ in range(20_000):
        with contextlib.suppress(OSError):
            if module in maps.read_text():
                return
        assert process.poll() is None
        time.sleep(0.001)
    raise AssertionError(f"{module} is not loaded")


@pytest.mark.parametrize(
    ("module", "later"),
    [("_multiarray_umath", 0.0), ("_pydantic_core", 0.0), ("_pydantic_core", 0.3)],
)
def test_ctrl_c_while_the_program_starts_is_one_sentence(tmp_path, module, later):
    (tmp_path / "c.yaml").write_text("flight: {connect_timeout_s: 60}\n")
    process = started(tmp_path, "fly", "--config", "c.yaml", "--endpoint", "udpin://127.0.0.1:0")
    loads(process, module)
    time.sleep(later)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert "Traceback" not in out + err
    assert "interrupted" in out + err
    assert process.returncode == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_is_ended_by_a_signal_says_so(tmp_path, number):
    (tmp_path / "c.yaml").write_text("link: {endpoint: 'udpin://127.0.0.1:0'}\n")
    command = "doctor", "--config", "c.yaml", "--wait", "60"
    process = Program("companion.cli.main", *command, folder=tmp_path)
    while not psutil.Process(process.pid).net_connections():  # until it listens for the vehicle
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert "Traceback" not in out + err
    assert "Interrupted; every parameter" in out + err
    assert process.returncode == 1


def test_nohup_keeps_a_flight_when_its_terminal_goes():
    code = (
        "import signal; from companion.cli.signals import hangup_signals; from companion.cli "
        "import interrupts; print(hangup_signals() == [], signal.SIGHUP in "
        "interrupts.signals_with_default_handler())"
    )
    done = subprocess.run(
        ["nohup", sys.executable, "-c", code],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["True", "False"]


def vehicle_of(process):
    """The bundled vehicle that a program has started and that is ready."""
    for _ in range(6000):
        for child in psutil.Process(process.pid).children(recursive=True):
            with contextlib.suppress(psutil.Error):
                if "--headless" in child.cmdline():
                    return child
        assert process.poll() is None
        time.sleep(0.01)
    raise AssertionError("no vehicle was started")


@pytest.mark.parametrize("when", ["at once", "in flight"])
def test_a_demo_that_is_killed_takes_its_vehicle_with_it(tmp_path, when):
    arguments = ("demo", "--config", quick_demo(tmp_path), "--lockstep")
    if when == "at once":
        process = started(tmp_path, *arguments)
    else:
        process = Program("companion.cli.main", *arguments, folder=tmp_path)
    vehicle = vehicle_of(process)
    if when == "in flight":
        for line in process.stdout:
            if "offboard" in line:
                break
    process.kill()
    process.communicate()
    assert not psutil.wait_procs([vehicle], timeout=30)[1]


def test_a_vehicle_started_by_hand_does_not_need_its_standard_input():
    options = ("--headless", "--endpoint", "serial://", "--gcs-port", "0")
    process = subprocess.Popen(
        [sys.executable, "-m", "sitl_mock", *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith("ready on")
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.2)
    process.terminate()
    assert process.wait() == 0


def test_a_program_of_the_benchmark_ends_with_a_benchmark_that_is_killed():
    code = (
        "from companion.bench.process import BenchmarkedProgram; import time;"
        "one = BenchmarkedProgram('echo', 'companion.bench.echo_program');"
        "print(one._process.pid, flush=True); time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    echo = psutil.Process(int(process.stdout.readline()))
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not psutil.wait_procs([echo], timeout=30)[1]
