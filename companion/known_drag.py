"""The vehicle's drag before it flies: what the configuration tells, else what may be."""

from companion.config import Config
from companion.drag import NO_DRAG, Drag
from companion.guidance.drag_estimate import ANY_VEHICLE, DragPrior

_TOLD_LINEAR, _TOLD_QUADRATIC = 0.2, 0.02
"""Standard deviations of a drag that the configuration tells, 1/s and 1/m: flight corrects it."""


def drag_prior(config: Config) -> DragPrior:
    """What the flight's estimate of the drag begins with."""
    told = config.guidance.drag
    return ANY_VEHICLE if told is None else DragPrior(told, _TOLD_LINEAR, _TOLD_QUADRATIC)


def least_drag(config: Config) -> Drag:
    """The drag that certainly slows the vehicle; none where it is not known."""
    return config.guidance.drag or NO_DRAG


def most_drag(config: Config) -> Drag:
    """The drag that thrust may have to overcome; more than usual where it is not known."""
    prior = drag_prior(config)
    if config.guidance.drag is not None:
        return prior.drag
    return Drag(prior.drag.linear + prior.linear_deviation, prior.drag.quadratic)
