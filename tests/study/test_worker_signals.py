"""Worker processes and a terminal that closes, which sends SIGHUP to all of them."""

import subprocess
import sys

PROGRAM = """
import signal, subprocess
from multiprocessing import resource_tracker
from companion.child_process import interrupts_blocked

def blocked(pid):
    with open(f"/proc/{pid}/status") as file:
        mask = next(int(line.split()[1], 16) for line in file if line.startswith("SigBlk"))
    return [number for number in (signal.SIGHUP, signal.SIGINT) if mask >> (number - 1) & 1]

with interrupts_blocked():
    worker = subprocess.Popen(["cat"], stdin=subprocess.PIPE)
    print(*map(int, blocked(worker.pid)))
print(*map(int, blocked(resource_tracker._resource_tracker._pid)))
print(*map(int, blocked("self")))
worker.communicate()
"""


def test_a_terminal_that_closes_ends_no_worker_and_not_the_resource_tracker():
    """A new tracker knew nothing of the first one's semaphores: a traceback for each of them."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    worker, tracker, command = done.stdout.split("\n")[:3]
    assert (worker, command) == ("1 2", "")
    assert tracker.startswith("1")  # it unblocks SIGINT, which it ignores
