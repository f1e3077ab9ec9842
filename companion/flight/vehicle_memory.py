"""What flights learn of a vehicle, carried from one to the next by its hardware id."""

from collections.abc import Callable
from pathlib import Path

from companion.config.known_drag import prior_of
from companion.guidance.drag_estimate import ANY_VEHICLE, DragEstimate
from companion.preflight.evidence import Identity
from companion.recording.learned_file import LearnedFile


class VehicleMemory:
    """Begins the estimate of the drag with what an earlier flight of the vehicle learned.

    What the configuration tells counts instead. A vehicle without a hardware id is not remembered.

    Args:
        directory: of the flights.
        estimate: of the drag.
        told: whether the configuration tells the drag.
        note: takes what happened, in words.
    """

    def __init__(
        self, directory: Path, estimate: DragEstimate, told: bool, note: Callable[[str], None]
    ) -> None:
        self._directory, self._estimate, self._told, self._note = directory, estimate, told, note
        self._file: LearnedFile | None = None

    def meet(self, identity: Identity) -> None:
        """The vehicle tells who it is, before it is flown."""
        if identity.uid is None:
            return
        file = LearnedFile(self._directory, identity.uid)
        if self._file is not None and self._file.path == file.path:
            return
        self._file = file
        if self._told:
            return
        kept, trouble = file.load()
        self._estimate.begin(ANY_VEHICLE if kept is None else prior_of(kept.drag))
        if trouble is not None:
            self._note(trouble)
        if kept is not None:
            self._note(
                f"the drag is taken to be {kept.drag.linear:.2f} 1/s + "
                f"{kept.drag.quadratic:.3f} 1/m, as an earlier flight of this vehicle learned it "
                f"({file.path})"
            )

    def keep(self) -> None:
        """After the flight: write down what it learned, if it moved enough to learn anything."""
        if self._file is None or not self._estimate.certain:
            return
        try:
            self._file.save(self._estimate.drag, self._estimate.top_speed)
        except OSError as error:
            self._note(f"{self._file.path}: cannot keep the learned drag: {error.strerror}")
