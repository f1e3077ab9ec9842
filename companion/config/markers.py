"""Markers of keys: further properties of a key, besides type and range.

The JSON Schema holds them as `in_flight`; the live page and the reference read them there.
"""

from typing import Any

IN_FLIGHT = "in_flight"
"""Name of the marker of a key that may change in flight."""

UP_TO_START = "up to its value at the start"
"""Permitted change of the limits with which the vehicle was checked before take-off."""

ANY: dict[str, Any] = {IN_FLIGHT: "within its range"}
LOWERED: dict[str, Any] = {IN_FLIGHT: UP_TO_START}
