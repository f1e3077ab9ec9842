"""The drag known before a flight: from the configuration, or learned in an earlier flight.

The maneuvers are checked twice: first, before the connection, with the drag of the vehicle that
flew last (`drag_before_connecting`), and then with the drag of the connected vehicle
(`drag_of_vehicle`), which is read once for each vehicle and passed on in the preflight evidence.
"""

from pathlib import Path
from typing import NamedTuple

from companion.config import Config
from companion.drag import NO_DRAG, Drag
from companion.guidance.drag_estimate import ANY_VEHICLE, DragPrior
from companion.recording.learned_file import LearnedFile, newest_learned

_LINEAR_DEVIATION_PER_S = 0.2
"""Standard deviation of a configured or learned linear drag, 1/s; the flight corrects it."""
_QUADRATIC_DEVIATION_PER_M = 0.02
"""Standard deviation of a configured or learned quadratic drag, 1/m."""
_LARGEST_DRAG = Drag(ANY_VEHICLE.drag.linear + ANY_VEHICLE.linear_deviation)
"""Drag that few vehicles exceed."""


class KnownDrag(NamedTuple):
    """Knowledge of a vehicle's drag before its flight."""

    drag: Drag | None = None
    """Configured or learned drag; None: unknown."""
    source: Path | None = None
    """The file of a learned drag; None: configured or unknown."""
    file_fault: str | None = None
    """Why the file of a learned drag could not be used; None: no fault, or no file."""

    @property
    def lower_bound(self) -> Drag:
        """The drag that may be counted on to brake the vehicle; zero if it is unknown."""
        return self.drag or NO_DRAG

    @property
    def upper_bound(self) -> Drag:
        """The drag that thrust must be able to overcome; a large one if it is unknown."""
        return self.drag or _LARGEST_DRAG

    @property
    def assumption(self) -> str:
        """The assumed drag, in parentheses, as the end of a message; empty if configured."""
        if self.drag is None:
            return (
                f" (the vehicle's drag is not known; up to {_LARGEST_DRAG.linear:g} 1/s is assumed)"
            )
        if self.source is not None:
            return f" (with the drag that an earlier flight learned: {self.source})"
        return ""


def drag_before_connecting(config: Config) -> KnownDrag:
    """The configured drag; else the one learned by the vehicle that flew last; else unknown."""
    if config.guidance.drag is not None:
        return KnownDrag(config.guidance.drag)
    learned_file = newest_learned(config.recording.directory)
    return KnownDrag() if learned_file is None else KnownDrag(learned_file.drag, learned_file.path)


def drag_of_vehicle(config: Config, directory: Path | None, uid: str | None) -> KnownDrag:
    """The configured drag; else the one that this vehicle learned; else unknown.

    Args:
        config: configuration of the flight.
        directory: folder of the flights, which has the learned drag; None: no learned drag.
        uid: hardware id (AUTOPILOT_VERSION); None: no id, so no learned drag.
    """
    if config.guidance.drag is not None:
        return KnownDrag(config.guidance.drag)
    if uid is None or directory is None:
        return KnownDrag()
    learned_drag, fault = LearnedFile(directory, uid).load()
    return (
        KnownDrag(file_fault=fault)
        if learned_drag is None
        else KnownDrag(learned_drag.drag, learned_drag.path)
    )


def prior_of(drag: Drag | None) -> DragPrior:
    """The prior of a drag that is configured or was learned in an earlier flight; None: unknown."""
    if drag is None:
        return ANY_VEHICLE
    return DragPrior(drag, _LINEAR_DEVIATION_PER_S, _QUADRATIC_DEVIATION_PER_M)


def drag_prior(config: Config) -> DragPrior:
    """The prior of the configured drag."""
    return prior_of(config.guidance.drag)
