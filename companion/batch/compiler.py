"""numba on functions as they stand: the flight's own laws become machine code for many vehicles."""

import os
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

Substitutes = Mapping[Callable[..., Any], Callable[..., Any]]
"""Functions, and those that are compiled in their place."""

_OPTIONS: dict[str, Any] = {
    "error_model": "numpy",  # a check before each division keeps loops from being vectorised
    "fastmath": {"contract"},  # multiply and add in one instruction; nothing else is loosened
}


class Compiler:
    """Compiles functions together with all that they call, every call inlined.

    Inlining is what lets the loop that calls a law be vectorised. A law refers to other functions
    by its module's globals; it is rebuilt with globals in which they are compiled ones.
    """

    def __init__(self, substitutes: Substitutes) -> None:
        _use_wide_registers()
        self._substitutes = substitutes
        self._done: dict[Callable[..., Any], Any] = {}

    def function(self, function: Callable[..., Any]) -> Any:
        """`function`, for compiled code to call; it must be plain: no closure, no defaults."""
        if function not in self._done:
            import numba  # noqa: PLC0415  optional, and slow to import

            self._done[function] = numba.njit(self._rebuilt(function), forceinline=True, **_OPTIONS)
        return self._done[function]

    def loop(self, function: Callable[..., Any]) -> Any:
        """`function`, for anyone to call; it may close over what `function()` returned."""
        import numba  # noqa: PLC0415

        return numba.njit(function, **_OPTIONS)

    def _rebuilt(self, function: Callable[..., Any]) -> FunctionType:
        assert isinstance(function, FunctionType)
        known = dict(function.__globals__)
        for name in function.__code__.co_names:
            called = known.get(name)
            if callable(called):
                called = self._substitutes.get(called, called)
            if isinstance(called, FunctionType):
                known[name] = self.function(called)
        return FunctionType(function.__code__, known, function.__name__)


def _use_wide_registers() -> None:
    """Let LLVM use all 512 bits where the processor has them: by itself it keeps to 256.

    numba reads this once, before it compiles anything in the process; what the user set by its
    own environment variable is left as it is.
    """
    import llvmlite.binding as llvm  # noqa: PLC0415
    from numba import config  # noqa: PLC0415

    features = llvm.get_host_cpu_features()
    if not features.get("avx512f") or "NUMBA_CPU_FEATURES" in os.environ:
        return
    config.CPU_NAME = llvm.get_host_cpu_name()
    config.CPU_FEATURES = features.flatten() + ",-prefer-256-bit"
