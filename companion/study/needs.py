"""What the studies need beyond the flying program."""

from companion.extras import require

_MODULES = ("jinja2", "matplotlib", "scipy", "tabulate")


def check(name: str) -> None:
    """Make sure that the extras of a study are installed; numba is not asked for, it saves time.

    Args:
        name: of the study.

    Raises:
        MissingExtraError: a package is missing; the message says how to get it.
    """
    for module in _MODULES:
        require(module, "study", "`companion study`")
    if name in ("nmpc", "track"):
        require("casadi", "nmpc", f"`companion study {name}`")
