"""The vehicle's drag before it flies: as the configuration tells it, or the last flight learned it.

Before the vehicle tells who it is, the one that flew last is taken to fly again.
"""

from pathlib import Path

from companion.config import Config
from companion.drag import NO_DRAG, Drag
from companion.guidance.drag_estimate import ANY_VEHICLE, DragPrior
from companion.recording.learned_file import newest

_LINEAR, _QUADRATIC = 0.2, 0.02
"""Standard deviations of a drag that is told or was learned, 1/s and 1/m: flight corrects it."""
_MOST = Drag(ANY_VEHICLE.drag.linear + ANY_VEHICLE.linear_deviation)
"""More than most vehicles have."""


def prior_of(drag: Drag) -> DragPrior:
    """What is believed of a drag that is told, or that an earlier flight learned."""
    return DragPrior(drag, _LINEAR, _QUADRATIC)


def drag_prior(config: Config) -> DragPrior:
    """What the flight's estimate of the drag begins with, whichever vehicle it is."""
    told = config.guidance.drag
    return ANY_VEHICLE if told is None else prior_of(told)


def least_drag(config: Config) -> Drag:
    """The drag that certainly slows the vehicle; none where it is not known."""
    return _known(config)[0] or NO_DRAG


def most_drag(config: Config) -> Drag:
    """The drag that thrust may have to overcome; more than usual where it is not known."""
    return _known(config)[0] or _MOST


def assumption(config: Config) -> str:
    """What of the drag is not the configuration's own word, as the end of a sentence."""
    drag, source = _known(config)
    if drag is None:
        return f" (the drag is not known: up to {_MOST.linear:g} 1/s is reckoned with)"
    if source is not None:
        return f" (reckoned with the drag that an earlier flight learned: {source})"
    return ""


def _known(config: Config) -> tuple[Drag | None, Path | None]:
    """The drag that is told or was learned, and where the latter is kept."""
    if config.guidance.drag is not None:
        return config.guidance.drag, None
    kept = newest(config.recording.directory)
    return (None, None) if kept is None else (kept.drag, kept.path)
