"""Compiles, unchanged, the laws that a flight calls, with numba for many vehicles at once."""

import os
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

Substitutes = Mapping[Callable[..., Any], Callable[..., Any]]
"""Functions, and the functions compiled in their place."""

_OPTIONS: dict[str, Any] = {
    "error_model": "numpy",  # a check before each division would prevent vectorised loops
    "fastmath": {"contract"},  # only: multiply and add in one instruction
}


class Compiler:
    """Compiles functions together with everything they call, every call inlined.

    The loop around a law is vectorised only if its calls are inlined. A law finds other functions
    in its module's globals, so a copy of the law is compiled whose globals hold compiled functions.
    """

    def __init__(self, substitutes: Substitutes) -> None:
        _use_wide_registers()
        self._substitutes = substitutes
        self._compiled: dict[Callable[..., Any], Any] = {}

    def compile_function(self, function: Callable[..., Any]) -> Any:
        """Compile a function for use in compiled code; it must have no closure and no defaults."""
        if function not in self._compiled:
            import numba  # noqa: PLC0415  optional, and slow to import

            self._compiled[function] = numba.njit(
                self._rebuild(function), forceinline=True, **_OPTIONS
            )
        return self._compiled[function]

    def compile_loop(self, function: Callable[..., Any]) -> Any:
        """Compile a loop; its closure may contain functions that `compile_function` returned."""
        import numba  # noqa: PLC0415

        return numba.njit(function, **_OPTIONS)

    def _rebuild(self, function: Callable[..., Any]) -> FunctionType:
        """A copy of the function whose globals hold compiled functions for all that it calls."""
        assert isinstance(function, FunctionType)
        names = dict(function.__globals__)
        for name in function.__code__.co_names:
            called = names.get(name)
            if callable(called):
                called = self._substitutes.get(called, called)
            if isinstance(called, FunctionType):
                names[name] = self.compile_function(called)
        return FunctionType(function.__code__, names, function.__name__)


def _use_wide_registers() -> None:
    """Let LLVM use 512-bit registers if the processor has them; by default it uses 256 bits.

    Call it before numba compiles anything. If the user has set NUMBA_CPU_FEATURES, nothing changes.
    """
    import llvmlite.binding as llvm  # noqa: PLC0415
    from numba import config  # noqa: PLC0415

    features = llvm.get_host_cpu_features()
    if not features.get("avx512f") or "NUMBA_CPU_FEATURES" in os.environ:
        return
    config.CPU_NAME = llvm.get_host_cpu_name()
    config.CPU_FEATURES = features.flatten() + ",-prefer-256-bit"
