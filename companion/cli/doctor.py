"""The command `companion doctor`."""

import argparse
import json
import shlex
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from companion.api.connection import run
from companion.attitude import PLANNER_NAMES
from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.terminal import read_line
from companion.config import Config
from companion.config.files import changed, load, with_assignments
from companion.config.known_drag import KnownDrag, drag_of_vehicle
from companion.control.expected_response import expected_response, hold_sentence
from companion.files.yaml_file import ConfigError
from companion.files.yaml_file import load as load_yaml
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.opening import make_link
from companion.flight.start_checks import check_link, require_backend
from companion.guidance import ManeuverSequence
from companion.mavlink.errors import LinkLost, LinkTimeout
from companion.preflight.all_checks import run_checks
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding, Key
from companion.preflight.parameter_fixes import (
    Answer,
    ChangeOutcome,
    UndoContents,
    UndoFile,
    apply_fixes,
    require_disarmed,
    restore,
)
from companion.preflight.parameter_survey import survey_parameters
from companion.preflight.report import as_dict, findings_lists, outcome_as_dict, outcome_line
from companion.preflight.session import PreflightSession, open_session, request_identity
from companion.vehicle.parameter_rules import CheckResult

_ANSWERS = {answer.value[0]: answer for answer in Answer}


def doctor(options: argparse.Namespace) -> int:
    """Find what is wrong with a vehicle before it flies, and fix it if asked to."""
    config = _with_options(load(options.config), options)
    if options.yes and not options.fix:
        raise ConfigError("--yes needs --fix: it answers the questions that --fix asks")
    if options.fix and not options.yes and not sys.stdin.isatty():
        raise ConfigError(
            "--fix asks before each change, and standard input is no terminal; add --yes"
        )
    undo = None if options.undo is None else load_yaml(options.undo, UndoContents)
    doctor_run = _DoctorRun(config, Console(stderr=options.json, highlight=False, markup=False))
    try:
        if undo is None:
            work = doctor_run.run_checks(options.wait, fix=options.fix, without_asking=options.yes)
        else:
            work = doctor_run.restore(undo, options.undo)
        exit_code = run(work, in_lockstep=config.link.lockstep)
    except KeyboardInterrupt:
        exit_code = doctor_run.report_interrupt()
    if options.json:
        print(json.dumps(doctor_run.result, allow_nan=False))
    return exit_code


def _with_options(config: Config, options: argparse.Namespace) -> Config:
    """The configuration as changed by the options of the command line."""
    config = with_assignments(config, options.set)
    link: dict[str, Any] = {"endpoint": options.endpoint} if options.endpoint else {}
    if options.lockstep:
        link["lockstep"] = True
    checked_config = changed(config, {"link": link}, "the command line")
    check_link(checked_config)
    require_backend(checked_config)
    return checked_config


def _maneuvers(config: Config, drag: KnownDrag) -> tuple[ManeuverSequence | None, list[Finding]]:
    """The maneuvers of the flight; or None, and the finding why this vehicle cannot fly them."""
    try:
        return configured_maneuvers(config, drag), []
    except ConfigError as error:
        refusal_text = f"the configured maneuvers cannot be flown: {error}"
        explanation = "`companion fly` refuses to fly them"
        return None, [Finding(Key.MANEUVERS, CheckResult.INEFFECTIVE, refusal_text, explanation)]


def _response_findings(config: Config) -> list[Finding]:
    """The finding on the expected response: whether the gain is too large for the vehicle."""
    if config.planner_name not in PLANNER_NAMES:
        return []
    response = expected_response(config)
    result = CheckResult.INEFFECTIVE if response.gain_is_too_high else CheckResult.SAFE
    source = "planner, rate loop and limits"
    explanation = f"{response.sentence()}; {hold_sentence(config)}"
    return [Finding(Key.RESPONSE, result, response.gain_sentence(), explanation, source=source)]


class _DoctorRun:
    """One run of the command; `result` is what `--json` prints."""

    def __init__(self, config: Config, console: Console) -> None:
        self._config, self._console = config, console
        self._make_link = partial(make_link, config, None)
        self._outcomes: list[ChangeOutcome] = []
        self.result: dict[str, Any] = {}

    async def run_checks(self, wait: float, *, fix: bool, without_asking: bool) -> int:
        """Check the vehicle and report; with `fix`, set parameters and check again.

        `wait` is the longest wait until the vehicle is ready, s. Returns the exit code.
        """
        config = self._config
        async with open_session(config, self._make_link) as vehicle:
            timeout = config.flight.connect_timeout_s
            self.say(
                f"Waiting for the vehicle on {config.link.endpoint}, for at most {timeout:g} s …"
            )
            findings = await vehicle.wait_for_vehicle()
            if findings:
                return self._report(findings)
            try:
                evidence = await vehicle.gather(wait)
            except (LinkTimeout, LinkLost) as error:
                return self._report(vehicle.unanswered_findings(error))
            drag = drag_of_vehicle(config, config.recording.directory, evidence.identity.uid)
            maneuvers, refused_findings = _maneuvers(config, drag)
            evidence = replace(evidence, maneuvers=maneuvers, known_drag=drag)
            findings = [
                *refused_findings,
                *run_checks(config, evidence),
                *_response_findings(config),
            ]
            exit_code = self._report(findings)
            if fix:
                exit_code = await self._fix(
                    vehicle, evidence, findings, without_asking=without_asking
                )
        return exit_code

    def report_interrupt(self) -> int:
        """Report Ctrl-C, and which parameters were set before it; return the exit code."""
        self.say("Interrupted; every parameter that was set is listed above.")
        changes = [outcome_as_dict(outcome) for outcome in self._outcomes]
        self.result |= {"result": "interrupted", "changes": changes}
        return EXIT_FAILURE

    async def restore(self, undo: UndoContents, path: Path) -> int:
        """Restore the parameters that an undo file lists."""
        async with open_session(self._config, self._make_link) as vehicle:
            findings = await vehicle.wait_for_vehicle()
            if findings:
                return self._report(findings)
            link = vehicle.link
            if not undo.matches_vehicle(link, await request_identity(link)):
                raise ConfigError(
                    f"{path} was written for another vehicle ({undo.autopilot}, system "
                    f"{undo.system}, hardware id {undo.uid or 'unknown'}); nothing was set; "
                    "connect that vehicle, or name the undo file of this one"
                )
            await restore(link, undo, self._report_outcome)
        self.result = {"changes": [outcome_as_dict(outcome) for outcome in self._outcomes]}
        return EXIT_FAILURE if any(outcome.refusal for outcome in self._outcomes) else EXIT_OK

    async def _fix(
        self,
        vehicle: PreflightSession,
        evidence: Evidence,
        findings: list[Finding],
        *,
        without_asking: bool,
    ) -> int:
        link, config = vehicle.link, self._config
        fixable_findings = [finding for finding in findings if finding.change is not None]
        if not fixable_findings:
            if self.result["result"] == "ok":
                self.say("`--fix` has no parameter to set.")
                return EXIT_OK
            self.say("`--fix` has no parameter to set: the findings need other remedies.")
            return EXIT_FAILURE
        require_disarmed(link)
        undo = UndoFile(config.recording.directory, link, evidence.identity)
        try:
            await apply_fixes(
                link,
                fixable_findings,
                _accept_all if without_asking else self._ask,
                undo,
                self._report_outcome,
            )
        finally:
            if undo.path.exists():
                path = shlex.quote(str(undo.path))
                self.say(f"Undo with: companion doctor --config FILE --undo {path}")
        evidence = replace(
            evidence, survey=await survey_parameters(link, link.autopilot.parameters)
        )
        _, refused_findings = _maneuvers(config, evidence.known_drag)
        exit_code = self._report(
            [*refused_findings, *run_checks(config, evidence), *_response_findings(config)]
        )
        self.result["changes"] = [outcome_as_dict(outcome) for outcome in self._outcomes]
        self.result["undo"] = str(undo.path) if undo.path.exists() else None
        return exit_code

    async def _ask(self, finding: Finding) -> Answer:
        change = finding.change
        assert change is not None
        self.say(f"{finding.result.value}: {finding.sentence()}")
        while True:
            self._console.print(
                f"Set {change.parameter} from {change.old:g} to {change.new:g}? "
                "[y]es, [n]o, [a]ll, [q]uit ",
                end="",
            )
            line = await read_line()
            if not line:  # the end of the input
                return Answer.QUIT
            answer = _ANSWERS.get(line.strip().lower()[:1])
            if answer is not None:
                return answer

    def _report(self, findings: list[Finding]) -> int:
        self._console.print(findings_lists(self._config, findings))
        self.result = as_dict(self._config, findings)
        return EXIT_OK if self.result["result"] == "ok" else EXIT_FAILURE

    def _report_outcome(self, outcome: ChangeOutcome) -> None:
        self._outcomes.append(outcome)
        self.say(outcome_line(outcome))

    def say(self, text: str) -> None:
        """Print a message for the user."""
        self._console.print(text, soft_wrap=True)


async def _accept_all(_: Finding) -> Answer:
    return Answer.ALL
