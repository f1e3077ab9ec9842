"""What the studies need beyond the flying program."""

from companion.extras import require

_MODULES = ("jinja2", "matplotlib", "scipy", "tabulate")


def check() -> None:
    """Make sure that the extra `study` is installed; numba is not asked for, it only saves time.

    Raises:
        MissingExtraError: a package is missing; the message says how to get it.
    """
    for module in _MODULES:
        require(module, "study", "`companion study`")
