"""Drag that flights have learned, stored for the next flight: one small file for each vehicle."""

import json
from pathlib import Path
from typing import Any, NamedTuple

from companion.drag import Drag
from companion.files.bounded_file import FileRefusedError, read_text
from companion.files.write_whole import write_whole

_MAX_BYTES = 10_000
"""Largest file that is read, bytes."""
_MAX_FILES = 1000
"""Largest number of vehicle files in a folder; with more, none is read."""
_MAX_LINEAR_DRAG, _MAX_QUADRATIC_DRAG = 10.0, 1.0
"""Upper bounds of `guidance.drag_per_s` and `guidance.quadratic_drag_per_m`, 1/s and 1/m."""
_MAX_SPEED = 1000.0
"""Upper bound of a learned top speed, m/s."""


class LearnedDrag(NamedTuple):
    """Drag of a vehicle, learned in earlier flights."""

    drag: Drag
    top_speed: float
    """Largest speed at which the drag was learned, m/s."""
    path: Path

    def as_keys(self) -> dict[str, dict[str, float]]:
        """The drag as keys of the configuration, by section."""
        return {
            "guidance": {
                "drag_per_s": self.drag.linear,
                "quadratic_drag_per_m": self.drag.quadratic,
            }
        }


class LearnedFile:
    """The file `learned-UID.json` in the folder of the flights.

    Args:
        directory: `recording.directory`.
        uid: hardware id of the vehicle's autopilot (AUTOPILOT_VERSION), hexadecimal.
    """

    def __init__(self, directory: Path, uid: str) -> None:
        self.path = directory / f"learned-{uid}.json"

    def load(self) -> tuple[LearnedDrag | None, str | None]:
        """The learned values, and a warning if the file cannot be read. Never raises."""
        try:
            return _read_drag(self.path), None
        except (FileRefusedError, ValueError, TypeError, KeyError, RecursionError) as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return None, None
            reason = error if isinstance(error, FileRefusedError) else "it is damaged"
            return None, (
                f"{self.path}: the drag that earlier flights learned cannot be used "
                f"({reason}); this flight learns it anew"
            )

    def save(self, drag: Drag, top_speed: float) -> None:
        """Replace the file atomically.

        Raises:
            OSError: the file cannot be written; the old one is unchanged.
        """
        text = json.dumps(
            {
                "drag_per_s": round(drag.linear, 4),
                "quadratic_drag_per_m": round(drag.quadratic, 5),
                "top_speed_m_s": round(top_speed, 2),
            }
        )
        write_whole(self.path, text + "\n")


def newest_learned(directory: Path) -> LearnedDrag | None:
    """Learned drag of the vehicle whose file in `directory` was saved last. Never raises.

    None: there is no file, the newest is damaged, or there are more than `_MAX_FILES` files.
    """
    try:
        paths = sorted(directory.glob("learned-*.json"), key=lambda path: -path.stat().st_mtime)
        return _read_drag(paths[0]) if 0 < len(paths) <= _MAX_FILES else None
    except (OSError, FileRefusedError, ValueError, TypeError, KeyError, RecursionError):
        return None


def _read_drag(path: Path) -> LearnedDrag:
    values = json.loads(read_text(path, _MAX_BYTES))
    return LearnedDrag(
        Drag(
            _checked_number(values["drag_per_s"], _MAX_LINEAR_DRAG),
            _checked_number(values["quadratic_drag_per_m"], _MAX_QUADRATIC_DRAG),
        ),
        _checked_number(values["top_speed_m_s"], _MAX_SPEED),
        path,
    )


def _checked_number(value: Any, max_value: float) -> float:
    if type(value) not in (int, float) or not 0.0 <= value <= max_value:
        raise ValueError(value)
    return float(value)
