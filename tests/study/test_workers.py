"""Studies in worker processes: the outcomes, the progress, an error, and the same files."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from companion.cli.main import main
from companion.study import runner
from companion.study.workers import run_in_workers
from tests.study.studies_of_workers import fails_in_second, is_killed, returns_its_name


def test_outcomes_keep_their_order_and_every_part_is_told():
    told = []
    parts = {"first": 1, "second": 2}
    outcomes = run_in_workers(returns_its_name, parts, 2, lambda *each: told.append(each))
    assert list(outcomes.items()) == [(name, f"outcome of {name}") for name in parts]
    assert sorted(told) == [("first", "only part"), ("second", "only part")]


@pytest.mark.parametrize(
    ("study", "message"),
    [
        (fails_in_second, "the disk is full"),
        pytest.param(is_killed, "worker .* killed", marks=pytest.mark.slow),
    ],
)
def test_an_error_in_a_worker_ends_the_run(study, message):
    with pytest.raises(OSError, match=message):
        run_in_workers(study, {"first": 1, "second": 1}, 1, lambda *_: None)


@pytest.mark.parametrize(("parent_lives", "code"), [(True, 0), (False, -signal.SIGKILL)])
def test_a_worker_whose_parent_was_killed_while_it_started_ends_too(parent_lives, code):
    parent = os.getpid() if parent_lives else 1
    work = f"from companion.child_process import end_with_parent as end; end({parent})"
    assert subprocess.run([sys.executable, "-c", work], check=False).returncode == code


def test_the_number_of_workers_is_checked(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["study", "all", "--workers", "0"])
    assert ended.value.code == 2
    assert "must be a whole number from 1 to 256" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_two_workers_write_the_files_of_one(tmp_path):
    def files(workers) -> dict[str, bytes]:
        out: Path = tmp_path / str(workers)
        runner.run("all", None, out, Console(quiet=True), workers)
        return {path.name: path.read_bytes() for path in out.iterdir()}

    one = files(1)
    assert "study.html" in one
    assert files(2) == one
