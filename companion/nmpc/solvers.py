"""Whether a solver can be had, by an interpreter of one's choice: `python -m` this, with its name.

CasADi's and acados' packages both bring a module `casadi`, of which acados' lacks what the other
needs. So they live in two environments, and the solver's process may be of either.
"""

import pickle
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from shutil import which
from typing import get_args

from companion.extras import MissingExtraError, require
from companion.nmpc.settings import Settings, SolverName

ACADOS = "comma-deps-acados"
"""The package; its modules are `acados` and a `casadi`."""
_TOOLS = ("make", "cc")
_ANSWERS_WITHIN = 30.0
"""s; an interpreter has to start and to look for packages."""


def check(solver: SolverName, python: Path | None = None) -> None:
    """Make sure that a solver can be had, before anything is begun.

    Args:
        solver: which.
        python: the interpreter of its process; None is ours.

    Raises:
        MissingExtraError: it cannot; the message says how to mend that.
    """
    if python is not None:
        _check_there(solver, python)
    elif solver == "acados":
        _check_acados()
    else:
        require("casadi", "nmpc", "Predictive control")
        if _installed(ACADOS):
            raise MissingExtraError(
                f"nmpc.solver: hpipm cannot be had beside {ACADOS}, whose casadi is another one:"
                " take the extra nmpc and the extra acados into an environment each"
            )


def compile_ahead(settings: Settings, python: Path | None = None) -> None:
    """Make sure that a solver can be had, and compile it if that has to be done first.

    It may take seconds, which a vehicle in the air, or one in lockstep, ought not to wait.

    Args:
        settings: as they will be flown.
        python: the interpreter of the solver's process; None is ours.

    Raises:
        MissingExtraError: it cannot be had; the message says how to mend that.
    """
    check(settings.solver, python)
    if settings.solver != "acados":
        return
    asked = [str(python or sys.executable), "-m", "companion.nmpc.compiling"]
    done = subprocess.run(asked, input=pickle.dumps(settings), capture_output=True, check=False)
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").strip().splitlines()
        raise MissingExtraError(f"nmpc.solver: {words[-1] if words else 'the compiler vanished'}")


def _check_acados() -> None:
    if not _installed(ACADOS):
        raise MissingExtraError(
            f"nmpc.solver: acados needs {ACADOS}, in an environment of its own because it brings"
            " a casadi of its own: python3 -m venv acados-venv, then acados-venv/bin/pip install"
            " 'mavlink-companion[acados]' (in a clone: -e '.[acados]'), and set nmpc.python:"
            " acados-venv/bin/python"
        )
    if _installed("casadi"):
        raise MissingExtraError(
            f"nmpc.solver: {ACADOS} and casadi are installed into one environment, where each"
            " overwrites the other: install the extra acados into an environment of its own, and"
            " set nmpc.python to its interpreter"
        )
    missing = [tool for tool in _TOOLS if which(tool) is None]
    if missing:
        raise MissingExtraError(
            f"nmpc.solver: acados compiles its solver and needs {' and '.join(missing)} for that;"
            " install it (Debian: apt install build-essential)"
        )


def _check_there(solver: SolverName, python: Path) -> None:
    """Let another interpreter look."""
    asked = [str(python), "-m", __name__, solver]
    try:
        done = subprocess.run(
            asked, capture_output=True, text=True, check=False, timeout=_ANSWERS_WITHIN
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        why = error.strerror if isinstance(error, OSError) else "it does not answer"
        raise MissingExtraError(f"nmpc.python: cannot run {python}: {why}") from error
    if "No module named 'companion" in done.stderr:
        raise MissingExtraError(
            f"nmpc.python: {python} knows no companion; install it there, too: {python} -m pip"
            f" install 'mavlink-companion[{'acados' if solver == 'acados' else 'nmpc'}]' (in a"
            " clone: -e '.[…]')"
        )
    if done.returncode != 0:
        words = done.stderr.strip().splitlines() or [f"it ends with {done.returncode}"]
        raise MissingExtraError(f"nmpc.python: {python}: {words[-1]}")


def _installed(package: str) -> bool:
    try:
        distribution(package)
    except PackageNotFoundError:
        return False
    return True


def main() -> int:
    """Say on standard error what is missing, if anything is."""
    (solver,) = (name for name in get_args(SolverName) if name == sys.argv[1])
    try:
        check(solver)
    except MissingExtraError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
