"""The solver's process: `python -m companion.nmpc.worker FD`, started by `process.Solver`.

FD is a socket that keeps messages apart (SOCK_SEQPACKET). Settings and trajectory come pickled on
standard input. The process ends when the socket does.
"""

import gc
import os
import pickle
import signal
import socket
import sys

from companion.nmpc.messages import READY, pack_answer, unpack_request
from companion.nmpc.planning import Planning

_LARGEST_MESSAGE = 65536


def main() -> None:
    """Answer one request after the other."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is meant for the flight, which closes us
    asked = socket.socket(fileno=int(sys.argv[1]))
    settings, trajectory = pickle.load(sys.stdin.buffer)  # from our own parent
    os.nice(settings.niceness)
    planning = Planning(settings, trajectory)
    planning.warm_up()
    gc.freeze()
    gc.disable()  # nothing here makes cycles, and a collection in a solve would make it late
    try:
        asked.send(READY)
        while message := _newest(asked):
            asked.send(pack_answer(planning.answer(unpack_request(message))))
    except (BrokenPipeError, ConnectionResetError):
        pass  # the flight is over


def _newest(asked: socket.socket) -> bytes:
    """The last request there is, waiting for one; empty once the other end is closed."""
    message = asked.recv(_LARGEST_MESSAGE)
    while message:
        try:
            newer = asked.recv(_LARGEST_MESSAGE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            break
        message = newer
    return message


if __name__ == "__main__":
    main()
