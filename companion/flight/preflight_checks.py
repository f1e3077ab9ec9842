"""The preflight checks of a flight, repeated before arming, take-off and takeover."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf

from companion.config import Config
from companion.config.known_drag import KnownDrag
from companion.flight.rate_requester import low_rate_text
from companion.flight.vehicle_identity import ReplacementDetector
from companion.guidance import ManeuverSequence
from companion.preflight.all_checks import blocking_findings, run_checks, unsafe_findings
from companion.preflight.evidence import Evidence, Identity, Stage
from companion.preflight.finding import Finding, Key
from companion.preflight.parameters import parameters
from companion.preflight.session import gather, wanted_rates
from companion.preflight.stream_checks import minimum_rates
from companion.safety.actions import FlightEnded
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.streams import StreamRate

_COUNTING_TIME = 1.0
"""Time over which telemetry rates are counted while the parameters are read, s."""
_MAX_EVIDENCE_AGE = 1.0
"""Time for which counted rates and read parameters stay valid, s."""
_PASSING_FINDINGS = frozenset(
    {Key.AGE, Key.LOSS, Key.ROUND_TRIP, "link.min_attitude_rate_hz", "link.min_position_rate_hz"}
)
"""Findings that a short disturbance of the link causes."""


class _LinkDisturbedError(FlightEnded):
    """Only findings block that a short disturbance of the link causes."""


class PreflightChecks:
    """Checks the vehicle like `companion doctor`, for each stage of a flight.

    A pilot may arm minutes after the checks passed. So the same checks run in the phase `checks`,
    before we arm, after anybody armed, before take-off, and before the takeover. The checks use the
    newest status of the vehicle, and rates and parameters that are at most a second old.

    Attributes:
        note: called once with each message that does not end the flight: warnings, unsafe findings
            in `flight.accept`, and message rates that the autopilot refused.
        load_drag: called with the vehicle's identity; returns what is known of its drag.

    Args:
        maneuvers: copy of the maneuvers of the flight, used only by the checks.
    """

    def __init__(
        self,
        config: Config,
        link: Link,
        replacement_detector: ReplacementDetector,
        maneuvers: ManeuverSequence,
    ) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self.load_drag: Callable[[Identity], KnownDrag] = lambda _: KnownDrag()
        self._config, self._link, self._replacement_detector = config, link, replacement_detector
        self._maneuvers = maneuvers
        self._clock = asyncio.get_running_loop().time
        self._granted_rates: Mapping[str, StreamRate] = {}
        self._evidence: Evidence | None = None
        self._gathered_at = -inf
        self._noted_texts: set[str] = set()
        self._warned_keys: set[str] = set()

    async def ask_for_telemetry(self) -> None:
        """Request the telemetry that a flight needs, and report rates that the autopilot refuses.

        Raises:
            CommandTimeout: the autopilot did not answer.
            LinkLost: the connection was lost.
        """
        self._evidence = None  # the old evidence may belong to another vehicle
        wanted = wanted_rates(self._config, self._link)
        self._granted_rates = await self._link.set_rates(wanted, window_s=0.1)
        for message, rate in self._granted_rates.items():
            if rate.granted < rate.requested:
                self._note_once(
                    f"{message}: asked for {rate.requested:g} Hz, granted {rate.granted:g} Hz"
                )

    async def require(self, stage: Stage) -> Evidence:
        """Check the vehicle for `stage`; return the data that were checked.

        Raises:
            VehicleReplaced: the vehicle may have been replaced by another one.
            FlightEnded: a finding blocks the flight.
            LinkLost: the connection was lost.
        """
        earlier_evidence = evidence = self._evidence
        if evidence is None or self._clock() - self._gathered_at > _MAX_EVIDENCE_AGE:
            evidence = await self._gather(stage, earlier_evidence)
            if self._report_low_rates(evidence):
                await self.ask_for_telemetry()
                evidence = await self._gather(stage, earlier_evidence)
            self._evidence, self._gathered_at = evidence, self._clock()
            self._replacement_detector.note_identity(evidence.identity)
        self._replacement_detector.require()
        drag = self.load_drag(evidence.identity)
        planned_maneuvers = self._maneuvers if self._maneuvers.parts else None
        evidence = replace(evidence, stage=stage, maneuvers=planned_maneuvers, known_drag=drag)
        self._act_on(run_checks(self._config, evidence, repeated=earlier_evidence is not None))
        return evidence

    async def require_within(self, seconds: float, stage: Stage) -> None:
        """Like `require`, but repeat the checks for `seconds` while only a disturbed link blocks.

        A gap of some tenths of a second is soon over.
        """
        give_up_at = self._clock() + seconds
        while True:
            try:
                await self.require(stage)
            except _LinkDisturbedError as disturbed:
                if self._clock() > give_up_at:
                    raise
                self._note_once(f"{disturbed.reason}; the checks are repeated")
                self._gathered_at = -inf
            else:
                return

    async def _gather(self, stage: Stage, earlier_evidence: Evidence | None) -> Evidence:
        return await gather(
            self._link,
            self._granted_rates,
            _COUNTING_TIME,
            stage=stage,
            earlier_survey=None if earlier_evidence is None else earlier_evidence.survey,
        )

    def _report_low_rates(self, evidence: Evidence) -> bool:
        """Report low rates of attitude or position messages; return whether a rate is too low.

        A ground station that connects after the telemetry was requested lowers the rates.
        """
        streams = evidence.streams
        low_streams = [
            name
            for name, (_, minimum) in minimum_rates(self._config.link).items()
            if name in streams and streams[name].achieved < minimum
        ]
        for name in low_streams:
            self.note(low_rate_text(name, streams[name].requested))
        return bool(low_streams)

    def on_parameter(self, name: str, value: float) -> None:
        """Warn if a station sets a checked parameter of the armed vehicle to an unsafe value.

        The flight goes on, because its end may need the failsafe that the change has made unsafe.
        """
        earlier_evidence = self._evidence
        if earlier_evidence is None or self._link.state.armed is not True:
            return
        survey = earlier_evidence.survey
        present_name = next((new for new, old in survey.present_names.items() if old == name), "")
        if survey.values.get(present_name, value) == value:
            return
        changed_survey = survey._replace(values={**survey.values, present_name: float(value)})
        self._evidence = replace(earlier_evidence, survey=changed_survey)
        known_findings = unsafe_findings(parameters(self._config, earlier_evidence))
        for finding in unsafe_findings(parameters(self._config, self._evidence)):
            if finding not in known_findings:
                self._note_once(
                    "another station set a parameter to an unsafe value in flight: "
                    f"{finding.sentence()}"
                )

    def _act_on(self, findings: list[Finding]) -> None:
        """End the flight if findings block it; report the other unsafe or ineffective findings."""
        blocking = blocking_findings(self._config, findings)
        warnings = [
            finding.key
            for finding in findings
            if finding.result is CheckResult.INEFFECTIVE
            and finding not in blocking
            and finding.key not in self._warned_keys
        ]
        if warnings:
            self._warned_keys.update(warnings)
            self._note_once(
                f"preflight warnings: {', '.join(warnings)}; `companion doctor` says what to set, "
                "docs/troubleshooting.md explains each"
            )
        for finding in unsafe_findings(findings):
            if finding not in blocking:
                self._note_once(f"unsafe, but accepted by flight.accept: {finding.sentence()}")
        if blocking:
            disturbed = all(finding.key in _PASSING_FINDINGS for finding in blocking)
            failure = _LinkDisturbedError if disturbed else FlightEnded
            raise failure("; and ".join(finding.sentence() for finding in blocking))

    def _note_once(self, text: str) -> None:
        if text not in self._noted_texts:
            self._noted_texts.add(text)
            self.note(text)
