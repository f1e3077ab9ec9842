"""All targets by name."""

from tests.fuzz import configuration, frames, telemetry, trajectories
from tests.fuzz.target import Target

TARGETS: dict[str, Target] = {
    target.name: target
    for target in (configuration.TARGET, trajectories.TARGET, frames.TARGET, telemetry.TARGET)

}
