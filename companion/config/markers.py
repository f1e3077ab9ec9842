"""Markers of keys: what else holds for a key, beside its type and range.

They stand in the JSON Schema under the name `in_flight`, where the live page and the reference read
them.
"""

from typing import Any

IN_FLIGHT = "in_flight"
"""Name of the marker of a key that may change in flight."""

UP_TO_START = "up to its value at the start"
"""For limits that were used to check the vehicle before take-off."""

ANY: dict[str, Any] = {IN_FLIGHT: "within its range"}
LOWERED: dict[str, Any] = {IN_FLIGHT: UP_TO_START}
