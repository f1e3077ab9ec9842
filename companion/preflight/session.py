"""One preflight session: connect, wait for readiness, listen, and judge.

The session reads telemetry and parameters, requests message rates, and has the autopilot run its
pre-arm checks. Nothing here arms the vehicle or sends a setpoint.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import replace

from companion.config import Config
from companion.mavlink.errors import CommandRefused, LinkError, LinkTimeout, UnsupportedAutopilot
from companion.mavlink.frame_filter import Notice
from companion.mavlink.messages import dialect, message_id
from companion.mavlink.stats import LinkStats
from companion.preflight import vehicle_checks
from companion.preflight.evidence import Evidence, Identity, LinkQuality, Stage
from companion.preflight.finding import Finding, Key
from companion.preflight.link_checks import signing_findings
from companion.preflight.link_listener import LinkListener
from companion.preflight.parameter_survey import Survey, survey_parameters
from companion.vehicle.clock_estimates import DelayUnknown
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.streams import StreamRate

_LISTENING_TIME = 3.0
"""Time for listening, s; enough to count messages at 2 Hz."""
_POLL_PERIOD = 0.05
"""Period of the checks for readiness, s."""
_WARNING_SEVERITY = 4
"""MAV_SEVERITY of a warning; a lower number is worse."""
_RELEASE_SUFFIXES = {0: "-dev", 64: "-alpha", 128: "-beta", 192: "-rc", 255: ""}
"""Version suffix by FIRMWARE_VERSION_TYPE, the lowest byte of `flight_sw_version`."""


def wanted_rates(config: Config, link: Link) -> dict[str, float]:
    """The message rates that a flight requests, Hz."""
    return {
        **link.autopilot.wanted_rates,
        "ATTITUDE_QUATERNION": config.link.attitude_rate_hz,
        "LOCAL_POSITION_NED": config.link.position_rate_hz,
    }


async def gather(
    link: Link,
    granted: Mapping[str, StreamRate],
    seconds: float,
    *,
    stage: Stage = Stage.GROUND,
    prearm_checks: bool = False,
    notices: Sequence[str] = (),
    earlier_survey: Survey | None = None,
) -> Evidence:
    """Listen for `seconds`, and read the parameters at the same time.

    Args:
        link: link to a vehicle whose heartbeat was received.
        granted: the message rates that were requested and granted, by message.
        seconds: time for counting messages, s.
        stage: state in which the vehicle is checked.
        prearm_checks: also run the autopilot's pre-arm checks, whose texts say what forbids arming.
        notices: notices of the link, read when listening ends.
        earlier_survey: the same vehicle's parameters, if they were read before.

    Raises:
        LinkLost: the connection was lost.
    """
    loop = asyncio.get_running_loop()
    stats_before, start_time = replace(link.stats), loop.time()
    with LinkListener(link, loop.time) as listener:
        parameter_survey, achieved, identity = await asyncio.gather(
            survey_parameters(link, link.autopilot.parameters, earlier_survey=earlier_survey),
            link.measure_rates(granted, seconds),
            _identity_and_texts(link) if prearm_checks else request_identity(link),
        )
    counts = link.stats.by_message
    return Evidence(
        autopilot=link.autopilot,
        state=link.state,
        survey=parameter_survey,
        streams={name: rate._replace(achieved=achieved[name]) for name, rate in granted.items()},
        received_counts={name: counts.get(message_id(name), 0) for name in granted},
        counting_time=seconds,
        link=_link_quality(link, stats_before, tuple(notices)),
        samples=listener.samples,
        other_nodes=listener.other_nodes,
        reset_count=listener.reset_count,
        identity=identity,
        stage=stage,
        warnings=_warnings(link, start_time),
    )


def _warnings(link: Link, since: float) -> tuple[str, ...]:
    """The autopilot's texts of severity warning or worse since this time, s on our clock."""
    texts = (text for text in link.state.texts if text.severity <= _WARNING_SEVERITY)
    return tuple(text.text for text in texts if text.time >= since)


async def request_identity(link: Link) -> Identity:
    """Request AUTOPILOT_VERSION; return an empty `Identity` if it does not come.

    Raises:
        LinkLost: the connection was lost.
    """
    try:
        received = await link.request_message("AUTOPILOT_VERSION")
    except (CommandRefused, LinkTimeout):
        return Identity()
    version_number, uid, uid2 = received.flight_sw_version, received.uid, received.uid2
    version = ".".join(str(version_number >> shift & 0xFF) for shift in (24, 16, 8))
    return Identity(
        version=version + _RELEASE_SUFFIXES.get(version_number & 0xFF, ""),
        capabilities=received.capabilities,
        uid=bytes(uid2).hex() if any(uid2) else f"{uid:016x}" if uid else None,
    )


async def _identity_and_texts(link: Link) -> Identity:
    """Run the pre-arm checks, whose results come as texts, and identify the autopilot."""
    if not link.state.armed:
        # ArduPilot sends these texts by itself only every 30 s.
        with suppress(CommandRefused, LinkTimeout):
            await link.command(dialect.MAV_CMD_RUN_PREARM_CHECKS, retries=1)
    return await request_identity(link)


def _link_quality(link: Link, stats_before: LinkStats, notices: tuple[str, ...]) -> LinkQuality:
    stats_now = link.stats
    return LinkQuality(
        frame_count=stats_now.frames - stats_before.frames,
        lost_count=stats_now.lost - stats_before.lost,
        damaged_count=stats_now.bad_crc - stats_before.bad_crc,
        not_finite_count=stats_now.non_finite - stats_before.non_finite,
        reconnect_count=stats_now.reconnects - stats_before.reconnects,
        round_trip=link.timesync.round_trip_s,
        jitter=link.timesync.jitter_s,
        notices=notices,
        timesync_on_other_clock=link.clock.delay.why_unknown is DelayUnknown.OTHER_CLOCK,
        repeated_count=stats_now.repeated - stats_before.repeated,
    )


class PreflightSession:
    """Checks one vehicle over an open link."""

    def __init__(self, config: Config, link: Link, notices: Sequence[str]) -> None:
        self._config, self._notices = config, notices
        self.link = link

    async def wait_for_vehicle(self) -> list[Finding]:
        """Wait for the heartbeat; return findings only if further checks are impossible.

        Raises:
            LinkLost: the connection was lost.
        """
        try:
            await self.link.wait_connected(self._config.flight.connect_timeout_s)
        except LinkTimeout as error:
            return self.unanswered_findings(error)
        except UnsupportedAutopilot as error:
            return [_finding_from_error(Key.SUPPORTED, CheckResult.UNSAFE, error)]
        return []

    def unanswered_findings(self, error: LinkError) -> list[Finding]:
        """Findings about a vehicle that does not answer, the likely cause first."""
        hints = signing_findings(self._notices, CheckResult.NOT_CONNECTED)
        state = self.link.state
        if state.heartbeat is None:
            return [*hints, _finding_from_error(Key.HEARTBEAT, CheckResult.NOT_CONNECTED, error)]
        no_answer = Finding(
            Key.ANSWERS,
            CheckResult.NOT_CONNECTED,
            f"the vehicle is heard but does not answer: {error}",
            "what it would do with our setpoints is unknown",
            "check that our messages reach it: wiring, ports, a router, signing",
            "COMMAND_ACK",
        )
        alarms = (vehicle_checks.armed(state), *vehicle_checks.failsafe(state))
        unsafe = (finding for finding in alarms if finding.result is CheckResult.UNSAFE)
        return [*hints, no_answer, *unsafe]

    async def gather(self, ready_timeout: float) -> Evidence:
        """Request telemetry, wait up to `ready_timeout` s for readiness, and listen.

        Raises:
            CommandTimeout: the vehicle does not answer commands; see `unanswered_findings`.
            LinkLost: the connection was lost; see `unanswered_findings`.
        """
        link = self.link
        granted = await link.set_rates(wanted_rates(self._config, link), window_s=0.1)
        with suppress(TimeoutError):
            async with asyncio.timeout(ready_timeout):
                while self._is_waiting():  # noqa: ASYNC110 - telemetry sets no events
                    await asyncio.sleep(_POLL_PERIOD)
        return await gather(
            link, granted, _LISTENING_TIME, prearm_checks=True, notices=self._notices
        )

    def _is_waiting(self) -> bool:
        state = self.link.state
        return not state.armed and self.link.autopilot.why_not_ready(state.readiness) is not None


@asynccontextmanager
async def open_session(
    config: Config, make_link: Callable[[Notice], Link]
) -> AsyncIterator[PreflightSession]:
    """Open the link. Until the session requests something, we send only heartbeats and TIMESYNC.

    `make_link`: makes the link, from a function that the link calls with each notice for the user.

    Raises:
        EndpointError: the endpoint cannot be opened.
        SigningError: the signing key cannot be used.
        LinkTimeout: the configuration demands lockstep, and the vehicle is not in lockstep.
    """
    notices: list[str] = []
    async with make_link(notices.append) as link:
        yield PreflightSession(config, link, notices)


def _finding_from_error(key: Key, result: CheckResult, error: LinkError) -> Finding:
    fact, _semicolon, fix = str(error).partition("; ")
    return Finding(key, result, fact, fix=fix, source="HEARTBEAT")
