"""Mock vehicles at the doctor's, set up as the shipped configurations of the two say."""

from contextlib import asynccontextmanager, contextmanager

import yaml

from companion.config.files import load
from companion.files import bounded_yaml
from companion.flight.opening import make_link
from companion.mavlink.transport.opening import open_transport
from companion.preflight.session import open_session
from companion.vehicle.parameter_rules import CheckResult
from tests.flight import fly as memory
from tests.flight.fly import CONFIGS, merged
from tests.flight.sockets import mock_vehicle

FAMILIES = ("px4", "ardupilot")


NO_PORT = 1
"""Of a vehicle in memory."""


def shipped(family, settings):
    """Of configs/mock-FAMILY.yaml, the parameters, and other settings."""
    mock = yaml.safe_load((CONFIGS / f"mock-{family}.yaml").read_text())["mock"]
    return merged({"parameters": mock["parameters"], "full_rate": True}, settings)


@contextmanager
def shipped_vehicle(folder, family, **settings):
    """The vehicle of configs/mock-FAMILY.yaml, in lockstep and soon ready to be armed."""
    with mock_vehicle(folder, autopilot=family, **shipped(family, settings)) as vehicle:
        yield vehicle


@contextmanager
def shipped_in_memory(family, **settings):
    """The same vehicle in memory; `met` with `open_wire` meets it."""
    known = shipped(family, settings)
    with memory.mock_vehicle(autopilot=family, in_lockstep=True, **known) as vehicle:
        yield vehicle


def config_file(folder, mock, **changes):
    """configs/mock-FAMILY.yaml with the vehicle's place and other changes."""
    data = yaml.safe_load((CONFIGS / f"mock-{mock.autopilot}.yaml").read_text())
    del data["mock"]
    times = yaml.safe_load((CONFIGS / data.pop("include")).read_text())["vehicle"]
    places = {
        "link": {
            "endpoint": f"udpin://127.0.0.1:{getattr(mock, 'port', NO_PORT)}",
            "lockstep": mock.in_lockstep,
        },
        "recording": {"directory": str(folder / "flights")},
        "vehicle": {"identified": "a flight of the mock vehicle", **times},
    }
    path = folder / "my.yaml"
    path.write_text(bounded_yaml.dump(merged(merged(data, places), changes)))
    return path


@asynccontextmanager
async def met(config, opener=open_transport):
    """A vehicle that was heard."""

    def link(notice):
        return make_link(config, None, notice, opener)

    async with open_session(config, link) as vehicle:
        assert await vehicle.wait_for_vehicle() == []
        yield vehicle


def configured(folder, mock, **changes):
    return load(config_file(folder, mock, **changes))


def amiss(findings):
    """CheckResult by key of all that is not safe."""
    return {
        str(finding.key): finding.result
        for finding in findings
        if finding.result is not CheckResult.SAFE
    }
