"""Each program of examples/ runs as it stands and shows what its docstring says."""

import ast
import contextlib
import io
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from companion import testing
from tests.flight.fly import LOOP_HZ, QuickVehicle
from tests.serve.serving import free_ports, mock, serving

EXAMPLES = Path(__file__).parents[1] / "examples"
PROGRAMS = sorted(path.name for path in EXAMPLES.glob("*.py") if path.name != "recorded.py")
MOST_LINES = 40

PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all of them run: the first one that reads a flight flies it, the others find it."""
    return tmp_path_factory.mktemp("examples")


def as_users_do(folder: Path, program: str, *arguments: str) -> str:
    """Standard output of one example in a process of its own, which must end well."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / program, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(EXAMPLES.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def output(folder: Path, program: str) -> str:
    """Standard output of one example, run in this process: the imports cost more than the rest.

    Its vehicle boots, climbs and lands quickly: that is most of the time of most examples.
    """
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.chdir(folder):
        patch.setattr(sys, "argv", [program])
        patch.setattr(sys, "path", [str(EXAMPLES), *sys.path[1:]])
        patch.setattr(testing, "MockVehicle", QuickVehicle)
        with contextlib.redirect_stdout(said):
            runpy.run_path(str(EXAMPLES / program), run_name="__main__")
    return said.getvalue()


def numbers(line: str) -> list[float]:
    return [float(text) for text in re.findall(r"(?<![\w.])[+-]?\d+(?:\.\d+)?", line)]


def test_the_law_in_a_loop_follows_the_model(folder: Path) -> None:
    lines = output(folder, "law_in_a_loop.py").splitlines()
    assert len(lines) == 7
    for line in lines:
        _, north, north_model, east, east_model = numbers(line)
        assert north == pytest.approx(north_model, abs=0.01)
        assert east == pytest.approx(east_model, abs=0.01)
    assert (north, east) == pytest.approx((0.3, -0.2), abs=0.002)


def test_the_batch_study_finds_the_paper_s_laws_straight(folder: Path) -> None:
    worst = {
        line.split()[0]: numbers(line)[-1]
        for line in as_users_do(folder, "batch_study.py").splitlines()
    }
    assert worst["first-order"] < 0.001
    assert worst["exact"] < 0.001
    assert all(worst[name] > 0.02 for name in ("quaternion", "so3", "euler"))


def test_the_own_planner_reaches_the_target_and_leaves_the_line(folder: Path) -> None:
    (paper, paper_left), (own, own_left) = [
        numbers(line)[-3:-1] for line in output(folder, "own_planner.py").splitlines()
    ]
    assert paper < 0.001
    assert own > 0.02
    assert paper_left < 0.01
    assert own_left < 0.01


def test_the_own_trajectory_is_slowed_down(folder: Path) -> None:
    lines = output(folder, "own_trajectory.py").splitlines()
    for limit in ("limits.max_tilt_deg", "limits.max_tilt_rate_deg_s", "limits.max_climb_m_s"):
        assert limit in "\n".join(lines[1:-1])
    (duration,) = numbers(lines[-1])
    assert 3.3 < duration < 4.0
    assert "for limits." in lines[-1]


def test_the_configuration_is_written_and_mistakes_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from companion.cli.main import main  # noqa: PLC0415

    said = output(folder, "configure_in_code.py")
    assert "did you mean `max_tilt_deg`?" in said
    assert "got 'steep'" in said
    assert main(["config", "--diff", str(folder / "indoor.yaml")]) == 0
    assert "fence_radius_m: 3" in capsys.readouterr().out


def test_the_csv_path_is_flown(folder: Path) -> None:
    (line,) = output(folder, "fly_csv.py").splitlines()
    assert line.startswith("result: ok, ")
    assert 0.001 < numbers(line)[0] < 0.1
    assert len((folder / "heart.csv").read_text().splitlines()) == 402


def test_the_injected_fault_makes_the_vehicle_land(folder: Path) -> None:
    said = output(folder, "inject_fault.py")
    assert "safety: gps: GPS position lost → land" in said
    result, state = said.splitlines()[-2:]
    assert result == "result: GPS position lost"
    assert "armed: False" in state
    assert numbers(state)[-1] == pytest.approx(0.0, abs=0.05)


def test_own_guidance_stays_with_its_point_in_wind(folder: Path) -> None:
    behind, landed = output(folder, "own_guidance.py").splitlines()
    level, height = numbers(behind)
    assert level < 0.5
    assert height < 0.1
    assert landed == "landed: True"


def test_the_fence_holds_above_own_guidance(folder: Path) -> None:
    began, why, landed = output(folder, "fence.py").splitlines()
    assert "beyond limits.fence_radius_m" in why
    assert landed.startswith("landed: True")
    assert 4.0 < numbers(landed)[0] - numbers(began)[0] < 8.0


def test_the_learned_policy_reaches_its_goal(folder: Path) -> None:
    assert numbers(output(folder, "learned_policy.py"))[0] < 0.2


def test_the_survey_is_refused_too_fast_flown_and_comes_home(folder: Path) -> None:
    refused, flown, back = output(folder, "waypoint_survey.py").splitlines()
    assert refused.startswith("refused: waypoints: ")
    assert flown.startswith("5 corners in ")
    assert numbers(back)[0] < 0.2


@pytest.mark.slow
def test_a_pymavlink_script_flies_a_square_through_us(folder: Path) -> None:
    vehicle, program = free_ports(2)
    with mock(vehicle), serving(vehicle, f"udpin://127.0.0.1:{program}"):
        said = as_users_do(folder, "pymavlink_offboard.py", f"udpout:127.0.0.1:{program}")
    assert [numbers(line)[0] < 0.3 for line in said.splitlines()[1:5]] == [True] * 4
    assert said.splitlines()[5].endswith("True")


@pytest.mark.slow
def test_a_pymavlink_script_without_us_ends_with_what_to_start(folder: Path) -> None:
    address = f"udpout:127.0.0.1:{free_ports(1)[0]}"
    run = [sys.executable, str(EXAMPLES / "pymavlink_offboard.py"), address]
    ended = subprocess.run(run, check=False, cwd=folder, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr == "no COMMAND_ACK within 10 s: does `companion serve` run?\n"


@pytest.mark.slow
def test_a_mavsdk_script_flies_through_us(folder: Path) -> None:
    vehicle, program = free_ports(2)
    with mock(vehicle), serving(vehicle, f"udpin://127.0.0.1:{program}"):
        said = as_users_do(folder, "mavsdk_offboard.py", f"udpout://127.0.0.1:{program}")
    assert numbers(said) == pytest.approx([2.0, 3.0], abs=0.2)


def test_model_following_is_straighter_behind_a_rate_loop(folder: Path) -> None:
    lines = [line.split() for line in output(folder, "compare_planners.py").splitlines()]
    straightness = {name: float(figure) for name, *_, figure, result in lines if result == "ok"}
    assert list(straightness) == ["first-order", "model-following"]
    assert straightness["model-following"] < 0.01
    assert straightness["first-order"] > 0.04


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a flight of doublets was recorded, by the example that identifies."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "said.txt").write_text(output(folder, "identify_from_log.py"))
    return folder


def test_the_vehicle_is_identified(flown: Path) -> None:
    lines = (flown / "said.txt").read_text().splitlines()[-5:]
    setpoints, rates = numbers(lines[0])
    assert 2500 < setpoints < rates
    roll, pitch = numbers(lines[1]), numbers(lines[2])
    assert roll[0] == pytest.approx(50.0, abs=5.0)
    assert roll[1] == pytest.approx(42.0, abs=5.0)
    assert pitch[:2] == pytest.approx(roll[:2], abs=2.0)
    assert all("a good fit" in line for line in lines[1:4])
    assert numbers(lines[4])[-1] == pytest.approx(0.49, abs=0.01)


def test_the_tlog_is_read(flown: Path) -> None:
    said = output(flown, "read_tlog.py")
    modes = re.findall(r"mode (\w+), (armed|not armed)", said)
    assert modes[0] == ("LOITER", "not armed")
    assert ("OFFBOARD", "armed") in modes
    assert modes[-1][1] == "not armed"
    (rate,) = re.findall(r"ATTITUDE_QUATERNION +\d+ +([\d.]+) Hz", said)
    assert float(rate) == pytest.approx(LOOP_HZ, abs=1.0)


def test_the_flight_is_plotted(flown: Path) -> None:
    pytest.importorskip("matplotlib")
    (line,) = output(flown, "plot_flight.py").splitlines()
    assert 0.05 < numbers(line)[-1] < 1.0
    picture = (flown / "flight.png").read_bytes()
    assert picture.startswith(PNG)
    assert len(picture) > 20_000


@pytest.mark.parametrize("program", PROGRAMS)
def test_it_says_what_it_shows_and_is_short(program: str) -> None:
    text = (EXAMPLES / program).read_text("utf-8")
    docstring = ast.get_docstring(ast.parse(text))
    assert docstring is not None
    assert f"Run: python examples/{program}" in docstring
    assert len(text.splitlines()) <= MOST_LINES


def test_each_is_listed_and_tested() -> None:
    listed = (EXAMPLES / "README.md").read_text("utf-8")
    tests = Path(__file__).read_text("utf-8")
    for program in PROGRAMS:
        assert f"]({program})" in listed, f"examples/README.md does not list {program}"
        assert f'"{program}"' in tests, f"no test runs {program}"
