"""Which solver can be had by which interpreter, and what is said where one cannot."""

import sys
from dataclasses import replace
from time import monotonic, sleep

import pytest

from companion.cli.main import main
from companion.extras import MissingExtraError
from companion.guidance.trajectory.figures import Hover
from companion.nmpc import Settings, Solver, solvers
from companion.nmpc.solvers import ACADOS, check, compile_ahead

LONG = 20.0  # s
BY_ACADOS = Settings(solver="acados")


def interpreter(folder, words):
    """One that runs these words of shell, "$@" being its arguments."""
    path = folder / "python"
    path.write_text(f"#!/bin/sh\n{words}\n")
    path.chmod(0o755)
    return path


def have(monkeypatch, *packages):
    monkeypatch.setattr(solvers, "_installed", lambda package: package in packages)


def test_without_acados_one_sentence_says_where_to_install_it(monkeypatch):
    have(monkeypatch, "casadi")
    with pytest.raises(MissingExtraError, match=r"of its own.*\[acados\].*nmpc\.python"):
        check("acados")


@pytest.mark.parametrize("solver", ["hpipm", "acados"])
def test_two_casadis_in_one_environment_are_refused(monkeypatch, solver):
    have(monkeypatch, "casadi", ACADOS)
    with pytest.raises(MissingExtraError, match="environment"):
        check(solver)


def test_acados_without_a_compiler_is_refused(monkeypatch):
    have(monkeypatch, ACADOS)
    monkeypatch.setattr(solvers, "which", lambda tool: None if tool == "cc" else f"/usr/bin/{tool}")
    with pytest.raises(MissingExtraError, match="needs cc for that"):
        check("acados")
    monkeypatch.setattr(solvers, "which", lambda tool: f"/usr/bin/{tool}")
    check("acados")


def test_an_interpreter_that_is_none_is_named(tmp_path):
    with pytest.raises(MissingExtraError, match=r"cannot run .*/gone: No such file"):
        check("hpipm", tmp_path / "gone")


def test_an_interpreter_without_this_program_is_told_how_to_get_it(tmp_path):
    bare = interpreter(tmp_path, f'exec {sys.executable} -I -S "$@"')
    with pytest.raises(MissingExtraError, match=r"knows no companion; .*companion\[acados\]"):
        check("acados", bare)


def test_another_interpreter_looks_for_itself(tmp_path):
    other = interpreter(tmp_path, f'exec {sys.executable} "$@"')
    with pytest.raises(MissingExtraError, match=rf"{other}: nmpc\.solver: acados needs {ACADOS}"):
        check("acados", other)


def test_what_the_compiler_says_is_known_before_the_flight(tmp_path):
    other = interpreter(tmp_path, 'case "$2" in *compiling) echo "no header" >&2; exit 1;; esac')
    with pytest.raises(MissingExtraError, match=r"nmpc\.solver: no header"):
        compile_ahead(BY_ACADOS, other)
    compile_ahead(replace(BY_ACADOS, solver="hpipm"), other)  # has nothing to compile


def test_the_process_is_of_the_interpreter_asked_for(tmp_path):
    other = interpreter(
        tmp_path, f'case "$2" in *worker) touch {tmp_path}/asked;; esac\nexec {sys.executable} "$@"'
    )
    solver = Solver(Settings(), Hover(1.0), lambda *trouble: pytest.fail(str(trouble)), other)
    try:
        until = monotonic() + LONG
        while not solver.ready:
            assert monotonic() < until
            sleep(0.01)
        assert (tmp_path / "asked").exists()
    finally:
        solver.close()


def test_fly_ends_with_that_sentence_and_a_two(tmp_path, capsys, monkeypatch):
    have(monkeypatch)
    config = tmp_path / "config.yaml"
    config.write_text("guidance: {kind: nmpc}\nnmpc: {solver: acados}\nvehicle: {lag_ms: 25.0}\n")
    assert main(["fly", "--config", str(config)]) == 2
    said = capsys.readouterr().err
    assert f"needs {ACADOS}" in said
    assert "Traceback" not in said
