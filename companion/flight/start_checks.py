"""Checks that refuse an unusable configuration before the flight begins."""

from companion.config import Config
from companion.control.inner_loop import planner
from companion.control.outer_loop import make_guidance, predictive_settings
from companion.extras import require
from companion.files.yaml_file import ConfigError
from companion.flight.opening import link_settings
from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.safety.plugin_monitors import plugin_monitors


def check_link(config: Config) -> None:
    """Check the endpoints of the vehicle and of the clients, and the signing key.

    Raises:
        ConfigError: an endpoint is not understood; the message names its key.
        SigningError: the key cannot be used.
    """
    vehicle_endpoint = link_settings(config).endpoint
    clients = [("serve.clients", client) for client in config.serve.clients]
    for key, endpoint in [("link.endpoint", vehicle_endpoint), *clients]:
        try:
            parse_endpoint(endpoint)
        except EndpointError as error:
            raise ConfigError(f"{key}: {error}") from error


def check_control(config: Config) -> None:
    """Check that the planner, the guidance and the monitors from plug-in packages can be made.

    Raises:
        ConfigError: one of them does not fit the vehicle or the limits, or the planner or
            guidance of a plug-in package raises an exception.
    """
    planner(config)
    make_guidance(config)
    plugin_monitors(config)
    if config.guidance.kind == "nmpc":
        predictive_settings(config)


def require_extras(config: Config) -> None:
    """Check that the optional packages of a flight are installed. Raises `MissingExtraError`."""
    require_solver(config)
    require_backend(config)


def require_solver(config: Config) -> None:
    """Check that the package of predictive control is installed. Raises `MissingExtraError`."""
    if config.guidance.kind == "nmpc":
        require("casadi", "nmpc", "guidance.kind: nmpc")


def require_backend(config: Config) -> None:
    """Check that the package of the link's backend is installed. Raises `MissingExtraError`."""
    if config.link.backend == "mavsdk":
        require("mavsdk", "mavsdk", "link.backend: mavsdk")
