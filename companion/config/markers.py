"""Markers of keys: whether and how a key may change in flight.

The JSON Schema holds each marker as `in_flight`. The live page and the reference of the keys read
the markers from the schema.
"""

from typing import Any

IN_FLIGHT = "in_flight"
"""Name of the marker of a key that may change in flight."""

UP_TO_START = "up to its value at the start"
"""Permitted change of the limits with which the vehicle was checked before take-off."""

TUNABLE: dict[str, Any] = {IN_FLIGHT: "within its range"}
"""Marker of a key that may take any value of its range in flight."""
LOWERABLE: dict[str, Any] = {IN_FLIGHT: UP_TO_START}
"""Marker of a key that may not rise above its value at the start of the flight."""
