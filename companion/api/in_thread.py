"""Runs slow work of a program's call without blocking the event loop in which it is called."""

import asyncio
from collections.abc import Callable
from typing import TypeVar, TypeVarTuple

from companion.mavlink.lockstep import LockstepEventLoop

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")


async def call_in_thread(function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
    """Call a slow function in a thread, so that samples are still answered.

    In lockstep and on a virtual clock the vehicle waits for us, so the function is called directly.
    A thread would only make the order of events random.
    """
    if isinstance(asyncio.get_running_loop(), LockstepEventLoop):
        return function(*arguments)
    return await asyncio.to_thread(function, *arguments)
