"""One visit to the doctor: connect, wait a little for the vehicle to be ready, listen, judge."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress

from companion.config import Config
from companion.mavlink.errors import LinkError, LinkTimeout, UnsupportedAutopilot
from companion.mavlink.frame_filter import Notice
from companion.preflight import vehicle_checks
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding, Key
from companion.preflight.gathering import gather, wanted_rates
from companion.preflight.link_checks import signing_findings
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import Verdict

_LISTENING = 3.0
"""s; enough to count what comes at 2 Hz."""
_POLL = 0.05


class Patient:
    """A vehicle at the other end of an open link.

    Args:
        config: What it is to be flown with.
        link: To it.
        notices: What the link says of itself.
    """

    def __init__(self, config: Config, link: Link, notices: Sequence[str]) -> None:
        self._config, self._notices = config, notices
        self.link = link

    async def met(self) -> list[Finding]:
        """Wait for the heartbeat; what is found where there is nothing more to be asked."""
        try:
            await self.link.wait_connected(self._config.flight.connect_timeout_s)
        except LinkTimeout as error:
            return self.silent(error)
        except UnsupportedAutopilot as error:
            return [_met(Key.SUPPORTED, Verdict.UNSAFE, str(error))]
        return []

    def silent(self, error: LinkError) -> list[Finding]:
        """What is found where nobody answers any more: the likely cause first."""
        hints = signing_findings(self._notices, Verdict.NOT_CONNECTED)
        state = self.link.state
        if state.heartbeat is None:
            return [*hints, _met(Key.HEARTBEAT, Verdict.NOT_CONNECTED, str(error))]
        unanswered = Finding(
            Key.ANSWERS,
            Verdict.NOT_CONNECTED,
            f"the vehicle is heard and does not answer: {error}",
            "what it would do with our setpoints is not known",
            "see whether what we send reaches it: wiring, ports, a router, signing",
            "COMMAND_ACK",
        )
        alarms = (vehicle_checks.armed(state), *vehicle_checks.failsafe(state))
        amiss = (finding for finding in alarms if finding.verdict is Verdict.UNSAFE)
        return [*hints, unanswered, *amiss]

    async def evidence(self, patience: float) -> Evidence:
        """Ask for telemetry, wait up to `patience` s for readiness, listen.

        Raises:
            CommandTimeout: It does not answer commands; `silent` says what that means.
            LinkLost: The connection dropped meanwhile; the same.
        """
        link = self.link
        granted = await link.set_rates(wanted_rates(self._config, link), window_s=0.1)
        with suppress(TimeoutError):
            async with asyncio.timeout(patience):
                while self._waits():  # noqa: ASYNC110 - telemetry sets no events
                    await asyncio.sleep(_POLL)
        return await gather(link, granted, _LISTENING, thorough=True, notices=self._notices)

    def _waits(self) -> bool:
        state = self.link.state
        return not state.armed and self.link.autopilot.not_ready(state.readiness) is not None


@asynccontextmanager
async def patient(config: Config, link_to: Callable[[Notice], Link]) -> AsyncIterator[Patient]:
    """Open the link; nothing but heartbeats and clock requests leaves before something is asked.

    Args:
        config: What the vehicle is to be flown with.
        link_to: Makes the link, which tells of itself to what it is given.

    Raises:
        EndpointError: the endpoint cannot be opened.
        LinkTimeout: lockstep is asked for, and the vehicle is not in lockstep.
    """
    notices: list[str] = []
    async with link_to(notices.append) as link:
        yield Patient(config, link, notices)


def _met(key: Key, verdict: Verdict, words: str) -> Finding:
    found, _semicolon, mend = words.partition("; ")
    return Finding(key, verdict, found, mend=mend, source="HEARTBEAT")
