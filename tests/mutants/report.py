"""What became of a room's mutants."""

from collections import Counter
from dataclasses import dataclass

WANTED = 0.85
"""Share of mutants that the tests of a room must kill."""


@dataclass
class Mutant:
    """One change of one function."""

    name: str
    status: str
    diff: str = ""

    @property
    def killed(self) -> bool:
        """Tests failed, or ran into an endless loop, because of it."""
        return self.status in ("killed", "timeout", "segfault")

    @property
    def function(self) -> str:
        """Dotted name of the function or method: `companion.attitude.rotation.multiply`."""
        module, _, mangled = self.name.partition("__mutmut_")[0].rpartition(".")
        # mutmut writes x_function or xǁClassǁmethod.
        return f"{module}.{mangled[2:]}".replace("ǁ", ".")

    @property
    def change(self) -> str:
        """`old line -> new line`, without indentation."""
        lines = [line for line in self.diff.splitlines() if not line.startswith(("---", "+++"))]
        old = " ".join(line[1:].strip() for line in lines if line.startswith("-"))
        new = " ".join(line[1:].strip() for line in lines if line.startswith("+"))
        return f"{old} -> {new}"


def print_room(room: str, mutants: list[Mutant], accepted: list[dict[str, str]]) -> float:
    """Print survivors and score.

    Args:
        room: Its name.
        mutants: All that were tried.
        accepted: Survivors that change nothing anyone could see: `function`, `change`, `reason`.

    Returns:
        Share of mutants killed, of those that are not accepted.
    """
    reasons = {(entry["function"], entry["change"]): entry["reason"] for entry in accepted}
    survivors = [mutant for mutant in mutants if not mutant.killed]
    wrong = [mutant for mutant in survivors if (mutant.function, mutant.change) not in reasons]
    for mutant in wrong:
        print(f"{mutant.function}  ({mutant.status}: {mutant.name})\n    {mutant.change}")
    counted = len(mutants) - len(survivors) + len(wrong)
    score = 1.0 - len(wrong) / counted if counted else 1.0
    kinds = ", ".join(f"{n} {kind}" for kind, n in Counter(m.status for m in mutants).items())
    print(
        f"{room}: {len(mutants)} mutants ({kinds}), {counted - len(wrong)} killed, "
        f"{len(wrong)} survived, {len(survivors) - len(wrong)} accepted, score {score:.1%}",
        flush=True,
    )
    return score
