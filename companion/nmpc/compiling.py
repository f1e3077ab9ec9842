"""Compiles a solver ahead of a flight: `python -m companion.nmpc.compiling`.

`solvers.compile_ahead` starts it. The settings come pickled on standard input; what goes wrong is
told on standard error.
"""

import pickle
import sys

from companion.nmpc.acados_build import BuildError
from companion.nmpc.problem import Problem


def main() -> int:
    """Make the problem once: then its solver is in the cache."""
    try:
        Problem(pickle.load(sys.stdin.buffer))  # from our own parent
    except BuildError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
