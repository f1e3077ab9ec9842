"""acados' solvers as files: generated and compiled once, from then on in the user's cache."""

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from ctypes import CDLL
from fcntl import LOCK_EX, flock
from hashlib import sha256
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from shutil import rmtree
from typing import Any

import acados
import casadi as ca
import numpy as np
from acados.acados_template import AcadosOcp, AcadosOcpSolver

from companion.nmpc.solvers import ACADOS

_LIBRARIES = ("libblasfeo.so", "libhpipm.so", "libqpOASES_e.so.3.1")
"""What acados' own library is linked with, in the order of who needs whom."""
_DONE = "built"
"""A file of this name says that all others of a folder are whole."""


class BuildError(Exception):
    """A solver cannot be generated or compiled; the message says why."""


def load(ocp: AcadosOcp) -> AcadosOcpSolver:
    """The solver of a problem, compiled if this user never had one of this very problem.

    Args:
        ocp: the whole of it; its files are laid into the cache.

    Raises:
        BuildError: it cannot be compiled, or the cache cannot be written.
    """
    folder = cache_folder() / _key(ocp)
    ocp.code_export_directory, described = str(folder), str(folder / "problem.json")
    # It tells on standard output what nobody asked.
    with redirect_stdout(StringIO()):
        try:
            with _locked(folder):
                if not (folder / _DONE).exists():
                    rmtree(folder, ignore_errors=True)
                    _build(ocp, folder, described)
        except OSError as error:
            raise BuildError(f"acados' solver cannot be laid into {folder}: {error}") from error
        for name in _LIBRARIES:  # they are found by name once they are there
            CDLL(str(Path(acados.LIB_DIR, name)))
        return AcadosOcpSolver(ocp, json_file=described, build=False, generate=False)


def cache_folder() -> Path:
    """Where the solvers of this user lie; `XDG_CACHE_HOME` moves it."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "mavlink-companion" / "acados"


def _key(ocp: AcadosOcp) -> str:
    """Of everything that goes into the compiled code: expressions, numbers, acados, machine."""
    model = ocp.model
    terms = [model.disc_dyn_expr, model.cost_y_expr, model.cost_y_expr_e, model.con_h_expr]
    expressions = ca.Function(
        "ocp", [model.x, model.u, model.p], [term for term in terms if term is not None]
    )
    numbers = {
        name: vars(getattr(ocp, name)) for name in ("dims", "cost", "constraints", "solver_options")
    }
    told = json.dumps(
        [numbers, version(ACADOS), acados.DIR, os.uname().machine], default=_plain, sort_keys=True
    )
    return sha256((expressions.serialize() + told).encode()).hexdigest()[:32]


def _plain(value: Any) -> Any:
    return np.asarray(value).tolist()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Two flights that begin at once compile one after the other."""
    folder.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    with folder.with_suffix(".lock").open("w") as lock:
        flock(lock, LOCK_EX)
        yield


def _build(ocp: AcadosOcp, folder: Path, described: str) -> None:
    # acados looks for its templates in the environment, and asks to download them otherwise.
    os.environ["ACADOS_SOURCE_DIR"] = acados.DIR
    os.environ["ACADOS_PYTHON_INTERFACE_PATH"] = acados.TEMPLATE_DIR
    os.environ["TERA_PATH"] = acados.TERA_PATH
    folder.mkdir(mode=0o700)
    AcadosOcpSolver.generate(ocp, json_file=described)
    done = subprocess.run(
        ["make", "ocp_shared_lib"], cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        said = done.stderr.strip() or f"make ended with {done.returncode}"
        raise BuildError(f"acados' solver cannot be compiled in {folder}: {said.splitlines()[0]}")
    (folder / _DONE).touch()
