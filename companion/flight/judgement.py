"""What must be true of the vehicle before each step towards the air: one judgement, asked anew."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf

from companion.config import Config
from companion.flight.same_vehicle import SameVehicle
from companion.guidance import ManeuverSequence
from companion.preflight.all_checks import blocking, run_checks, unsafe
from companion.preflight.evidence import Evidence, Identity, Stage
from companion.preflight.finding import Finding
from companion.preflight.session import gather, wanted_rates
from companion.safety.ending import FlightEnded
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.streams import StreamRate

_COUNTED_FOR = 1.0
"""Arriving telemetry is counted for this long, s; the parameters are read meanwhile."""
_LASTS = 1.0
"""What was counted and read counts for this long, s; then it is counted and read again."""


class Preflight:
    """Judges the vehicle as `companion doctor` does, for each stage of a flight.

    What was good at the checks may not be so when a pilot arms minutes later. So the same checks
    are made at the checks, before we arm, when anybody has armed, before take-off, and before we
    take over. Statuses are judged as they are; rates are counted and parameters read again unless
    that was done within the last second.

    Attributes:
        note: takes what is amiss without blocking a flight, once each.
        meet: is told who the vehicle is, as soon as it tells.

    Args:
        config: what the vehicle is to be flown with.
        link: to it.
        same_vehicle: whether it still is the vehicle that was checked.
        maneuvers: what is to be flown; nobody else asks it for references.
    """

    def __init__(
        self, config: Config, link: Link, same_vehicle: SameVehicle, maneuvers: ManeuverSequence
    ) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self.meet: Callable[[Identity], None] = lambda _: None
        self._config, self._link, self._same_vehicle = config, link, same_vehicle
        self._maneuvers = maneuvers
        self._clock = asyncio.get_running_loop().time
        self._granted: Mapping[str, StreamRate] = {}
        self._evidence: Evidence | None = None
        self._gathered_at = -inf
        self._told: set[str] = set()

    async def ask_for_telemetry(self) -> None:
        """Ask for the telemetry that a flight needs, and tell what is not granted.

        Raises:
            CommandTimeout: the autopilot did not answer.
            LinkLost: the connection dropped meanwhile.
        """
        self._evidence = None  # it may be another vehicle's
        wanted = wanted_rates(self._config, self._link)
        self._granted = await self._link.set_rates(wanted, window_s=0.1)
        for message, rate in self._granted.items():
            if rate.granted < rate.asked:
                self._tell(f"{message}: asked for {rate.asked:g} Hz, granted {rate.granted:g} Hz")

    async def require(self, stage: Stage) -> Evidence:
        """Judge the vehicle for `stage`; what it was judged by.

        Raises:
            ChecksVoid: it may be another vehicle than was checked.
            FlightEnded: with what forbids the flight.
            LinkLost: the connection dropped meanwhile.
        """
        before = evidence = self._evidence
        if evidence is None or self._clock() - self._gathered_at > _LASTS:
            evidence = await gather(
                self._link,
                self._granted,
                _COUNTED_FOR,
                stage=stage,
                known=None if before is None else before.survey,
            )
            self._evidence, self._gathered_at = evidence, self._clock()
            self._same_vehicle.note_identity(evidence.identity)
        self._same_vehicle.require()
        self.meet(evidence.identity)
        evidence = replace(evidence, stage=stage, maneuvers=self._maneuvers)
        self._heed(run_checks(self._config, evidence, again=before is not None))
        return evidence

    def _heed(self, findings: list[Finding]) -> None:
        """Refuse what is unsafe, unless the configuration excepts it; say what else is amiss."""
        refused = blocking(self._config, findings)
        amiss = [
            finding.key
            for finding in findings
            if finding.result is CheckResult.INEFFECTIVE and finding not in refused
        ]
        if amiss:
            self._tell(f"not as it should be: {', '.join(amiss)}; `companion doctor` tells why")
        for finding in unsafe(findings):
            if finding not in refused:
                self._tell(f"unsafe, but excepted by flight.accept: {finding.sentence()}")
        if refused:
            raise FlightEnded("; and ".join(finding.sentence() for finding in refused))

    def _tell(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self.note(text)
