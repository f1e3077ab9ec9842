"""What a solver of the optimal control problem takes and gives, whichever it is."""

from typing import NamedTuple, Protocol

from companion.nmpc.warm_start import Floats


class Found(NamedTuple):
    """What came of one solve.

    Attributes:
        plan: (x_0, u_0, x_1, …, x_N), in the order of `Program.unknown`.
        solved: whether the plan may be flown, if it is finite.
        converged: whether the iterations reached the tolerance.
        iterations: of the SQP.
    """

    plan: Floats
    solved: bool
    converged: bool
    iterations: int


class Backend(Protocol):
    """Solves the problem of one model, each time anew from the guess it is given."""

    def solve(self, guess: Floats, parameters: Floats) -> Found:
        """Solve from a guess, whose first state is held: it is where the vehicle starts.

        Args:
            guess: in the order of `Program.unknown`.
            parameters: as `transcription.parameters_of` makes them.
        """
        ...
