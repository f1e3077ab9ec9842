"""Studies for the tests of workers, whose processes import this file and little else."""

import os
import signal


def returns_its_name(name, tick):
    tick("only part")
    return f"outcome of {name}"


def fails_in_second(name, tick):
    if name == "second":
        raise OSError("the disk is full")
    return name


def is_killed(_name, _tick):
    os.kill(os.getpid(), signal.SIGKILL)
