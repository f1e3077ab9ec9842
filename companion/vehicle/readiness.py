"""What decides whether a vehicle can be armed and flown."""

from typing import NamedTuple


class Readiness(NamedTuple):
    """Taken from telemetry; `None` where nothing came yet.

    Attributes:
        prearm_good: The autopilot's own pre-arm checks pass.
        estimator_flags: ESTIMATOR_STATUS_FLAGS.
        position: A finite local position was received.
        home: The home position was received.
    """

    prearm_good: bool | None
    estimator_flags: int | None
    position: bool
    home: bool
