"""All targets by name."""

from tests.fuzz import configuration, frames, recordings, telemetry, trajectories
from tests.fuzz.target import Target

TARGETS: dict[str, Target] = {
    module.TARGET.name: module.TARGET
    for module in (configuration, trajectories, frames, telemetry, recordings)
}
