"""The drag known before a flight: from the configuration, or learned in the last flight.

Until the vehicle identifies itself, it is assumed to be the one that flew last.
"""

from pathlib import Path

from companion.config import Config
from companion.drag import NO_DRAG, Drag
from companion.guidance.drag_estimate import ANY_VEHICLE, DragPrior
from companion.recording.learned_file import newest

_LINEAR, _QUADRATIC = 0.2, 0.02
"""Standard deviations of a configured or learned drag, 1/s and 1/m; the flight corrects it."""
_MOST = Drag(ANY_VEHICLE.drag.linear + ANY_VEHICLE.linear_deviation)
"""Drag that few vehicles exceed."""


def prior_of(drag: Drag) -> DragPrior:
    """The prior of a drag that is configured or was learned in an earlier flight."""
    return DragPrior(drag, _LINEAR, _QUADRATIC)


def drag_prior(config: Config) -> DragPrior:
    """The prior with which the drag estimate begins."""
    told = config.guidance.drag
    return ANY_VEHICLE if told is None else prior_of(told)


def least_drag(config: Config) -> Drag:
    """The drag that is known to brake the vehicle; none if it is unknown."""
    return _known(config)[0] or NO_DRAG


def most_drag(config: Config) -> Drag:
    """The drag that thrust must be able to overcome; a large one if it is unknown."""
    return _known(config)[0] or _MOST


def assumption(config: Config) -> str:
    """What is assumed of an unconfigured drag, as the end of a sentence; empty if configured."""
    drag, source = _known(config)
    if drag is None:
        return f" (the drag is not known: assumed up to {_MOST.linear:g} 1/s)"
    if source is not None:
        return f" (with the drag that an earlier flight learned: {source})"
    return ""


def _known(config: Config) -> tuple[Drag | None, Path | None]:
    """The configured or learned drag, and the file of a learned one."""
    if config.guidance.drag is not None:
        return config.guidance.drag, None
    kept = newest(config.recording.directory)
    return (None, None) if kept is None else (kept.drag, kept.path)
