"""Following a trajectory: how far off every planner is, over speed, led or not, and in wind.

`task` says what is flown, `flight` flies one on the bundled vehicle and `truth` asks that where it
really is, `fleet` flies many at once; the rest tells what came of it.
"""

from companion.study.track.study import PARTS, run

__all__ = ["PARTS", "run"]
