"""The stated flights, and all in which they differ from the configurations that ship.

A flight is named by what it flies, joined by `+`; behind `@` stands a variant, behind `:` the
planner where it is another than the one that ships: `circle5+eight5`, `circle5@nmpc`,
`corners400:first-order`. At most one circle and one other path fly in a flight: the configuration
has one place for each.
"""

from pathlib import Path
from typing import NamedTuple

import yaml

from tests.real.build import ROOT
from tests.real.vehicle import merged

SIMULATION = {
    # The program arms: nobody holds a transmitter.
    "flight": {"arm": True, "takeoff_height_m": 6.0, "ready_timeout_s": 90.0},
    # Circles of 12 m radius; a simulator has no neighbours.
    "limits": {"fence_radius_m": 100.0, "fence_ceiling_m": 40.0},
}
"""What any flight in a simulation changes."""

ESTIMATORS = {
    "px4": {},
    # Its simulated GPS is later than its estimator takes it to be: fitted to the truth of circles
    # and figure-eights. It belongs to this simulator, so the configuration that ships says 0.
    "ardupilot": {"guidance": {"position_lateness_ms": 20.0}},
}
"""What is told of an autopilot's estimator in its simulation."""

CORNERS = {
    # After the 1.2 s that ship, 1 % of a step is left, and bends the line of the next one; the
    # paper's figure 2 begins at rest. The checks before the flight know no drag, so to them the
    # longer steps lead as far as this fence.
    "corners": {"duration_s": 1.5},
    "limits": {"max_tilt_deg": 45.0, "fence_radius_m": 250.0},
    # Open loop, it flies some metres per corner and up to 9 m/s; what the autopilot does should we
    # fall silent in the middle of it is known and accepted here.
    "flight": {"accept": ["safety.offboard_loss"]},
}
STEPS = {"limits": {"max_tilt_deg": 35.0}}
_SPINNING = {"limits": {"max_tilt_rate_deg_s": 400.0}, "safety": {"max_body_rate_deg_s": 700.0}}
_TILTED = {"limits": {"max_tilt_deg": 52.0, "max_tilt_rate_deg_s": 200.0}}
_FAST = {"limits": {"max_tilt_deg": 58.0, "max_tilt_rate_deg_s": 200.0, "max_thrust": 1.0}}
_PAUSE_S = 4.0
_CLIMB = {"helix": {"radius_m": 4.0, "rise_m": 8.0, "speed_m_s": 3.0, "laps": 2.0}}
"""It climbs by 0.9 m/s."""


class Part(NamedTuple):
    """One maneuver of a flight.

    Attributes:
        maneuvers: its name in `flight.maneuvers`.
        settings: what it needs.
        trajectory: what `flight.trajectory` is to hold, or None.
        predictive: the same maneuver as a trajectory, which is all that predictive control flies.
    """

    maneuvers: str
    settings: dict
    trajectory: dict | None = None
    predictive: dict | None = None


def _corners(north: float, east: float, settings: dict) -> Part:
    """0.4 and 0.5 are the steps of the paper's figure 2: from corner to corner 80° of tilt."""
    corners = {"corners": {"north_coefficient": north, "east_coefficient": east}}
    return Part("corners", merged(merged(CORNERS, corners), settings))


def _circle(radius: float, speed: float, laps: float, settings: dict) -> Part:
    circle = {"radius_m": radius, "speed_m_s": speed, "laps": laps}
    same = {"circle": {**circle, "acceleration_m_s2": 3.0, "heading": "fixed"}}
    return Part("circle", merged(settings, {"circle": circle}), predictive=same)


def _eight(half_width: float, speed: float, settings: dict) -> Part:
    eight = {"half_width_m": half_width, "peak_speed_m_s": speed, "laps": 4.0}
    return Part("trajectory", settings, {"figure_eight": eight})


PARTS = {
    "hover": Part("hover", {}),
    "steps": Part("steps", STEPS),
    "corners400": _corners(0.4, 0.5, _SPINNING),
    "corners90": _corners(0.4, 0.5, {}),
    "corners400-small": _corners(0.3, 0.35, _SPINNING),
    "corners90-small": _corners(0.3, 0.35, {}),
    "circle2": _circle(3.0, 2.0, 3.0, {}),
    "circle5": _circle(5.0, 5.0, 4.0, {"limits": {"max_tilt_deg": 45.0}}),
    "circle8": _circle(8.0, 8.0, 4.0, _FAST),
    "circle10": _circle(12.0, 10.0, 4.0, _FAST),
    "eight5": _eight(3.0, 5.0, _TILTED),
    "eight8": _eight(6.0, 8.0, _FAST),
    "climb": Part("trajectory", {}, _CLIMB),
}
MOVING = ("circle", "trajectory")
VARIANTS: dict[str, dict] = {
    "nmpc": {"guidance": {"kind": "nmpc"}},
    "wind": {},
    "identified": {},
}
"""Another guidance; wind of 3 m/s; with the file that this vehicle's latest `identify` wrote."""


class Named(NamedTuple):
    """The name of a flight, taken apart."""

    parts: list[str]
    variant: str
    planner: str


def named(flight: str) -> Named:
    """`circle5+eight5@nmpc:planner`, taken apart.

    Raises:
        ValueError: there is no such maneuver or variant.
    """
    rest, _, planner = flight.partition(":")
    rest, _, variant = rest.partition("@")
    parts = rest.split("+")
    unknown = [name for name in parts if name not in PARTS]
    if unknown or variant not in ("", *VARIANTS):
        known = f"{', '.join(PARTS)}; variants {', '.join(VARIANTS)}"
        raise ValueError(f"no flight {flight!r}; there are {known}")
    return Named(parts, variant, planner)


def configuration(flight: str, base: list[Path], folder: Path, changes: dict) -> dict:
    """What is flown, on top of the files `base`; a trajectory is written to `folder`."""
    config = merged({"include": [str(path) for path in base]}, SIMULATION)
    asked, maneuvers = named(flight), []
    for name in asked.parts:
        part = PARTS[name]
        if asked.variant == "nmpc" and part.predictive is not None:
            part = part._replace(maneuvers="trajectory", trajectory=part.predictive)
        config = _within(config, part.settings)
        if part.trajectory is not None:
            path = folder / f"{name}.yaml"
            path.write_text(yaml.safe_dump(part.trajectory))
            config["flight"]["trajectory"] = str(path)
        # Each begins, and is left, in a calm hold.
        maneuvers += [part.maneuvers] if part.maneuvers == "hover" else ["hover", part.maneuvers]
    if maneuvers[-1] != "hover" and part.trajectory is not _CLIMB:  # which ends elsewhere
        maneuvers.append("hover")
    config = merged(config, {"flight": {"maneuvers": maneuvers}, "hover": {"duration_s": _PAUSE_S}})
    if asked.parts == ["hover"]:
        config["hover"]["duration_s"] = 30.0
    config = merged(config, VARIANTS.get(asked.variant, {}))
    if asked.planner:
        config = merged(config, {"planner": {"name": asked.planner}})
    return merged(config, changes)


def _within(config: dict, settings: dict) -> dict:
    """Both; of two limits the wider one."""
    limits = dict(config.get("limits", {}))
    for name, value in settings.get("limits", {}).items():
        limits[name] = max(value, limits.get(name, value))
    return merged(merged(config, settings), {"limits": limits})


def shipped(autopilot: str) -> Path:
    """The configuration that ships for it."""
    return ROOT / "configs" / f"{autopilot}.yaml"
