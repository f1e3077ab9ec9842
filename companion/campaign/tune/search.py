"""The search with Optuna; it can be interrupted at any time and continued."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import Tune
from companion.campaign.case import Case
from companion.campaign.tune.candidates import (
    candidates_near,
    cases,
    start_candidates,
    suggested_values,
)
from companion.campaign.tune.first_flight import learned_config
from companion.campaign.tune.scores import (
    Candidate,
    Row,
    Score,
    SearchResults,
    pooled_rms,
    score_of,
)
from companion.files.yaml_file import ConfigError

if TYPE_CHECKING:
    from optuna import Study, Trial
    from optuna.trial import FrozenTrial

Fly = Callable[[Sequence[Case]], Sequence[Row]]
"""Flies cases; returns one row for each, in the same order."""

STORAGE = "tune.db"
"""Optuna's storage in the folder of the search."""
_STUDY_NAME = "tune"
_MOST_STARTS = 3
"""Largest number of start candidates of a search."""
_FEWEST_NEIGHBOURS = 4
"""Smallest number of candidates that are tried near the last start candidate."""
_FIRST_CASES_DIVISOR = 4
"""Divisor of the number of cases: a candidate first flies a quarter of its cases.

The candidate flies the others only if its error on the first cases is not too large."""
_FEWEST_FIRST_CASES = 2
_HOPELESS_FACTOR = 1.3
"""A candidate is abandoned when its error on the first cases is more than this factor times that of
the best candidate on the same cases."""
_LARGEST_ERROR = 10.0
"""Largest error that is reported to Optuna, m; also the error of a flight that ended early."""
_VALUES_KEY, _SCORE_KEY = "values", "score"
"""Attributes of a trial in Optuna's storage: values of the searched keys, and score."""
_VIOLATION_KEY, _COMPLETE_KEY = "violation", "complete"
"""Attributes of a trial: violation of the constraint, and whether all cases were flown."""


class StorageError(Exception):
    """The storage is damaged or cannot be written; the message gives the reason."""


@contextmanager
def _storage_errors(path: Path) -> Iterator[None]:
    """While the block runs, turn errors of the storage at `path` into a `StorageError`.

    Optuna wraps SQLAlchemy's errors in its own errors, whose text only guesses at the cause.
    """
    from optuna.exceptions import StorageInternalError  # noqa: PLC0415  an extra
    from sqlalchemy.exc import DBAPIError  # noqa: PLC0415  comes with Optuna

    try:
        yield
    except (DBAPIError, StorageInternalError) as error:
        cause = error.__cause__ if isinstance(error, StorageInternalError) else error
        reason = cause.orig if isinstance(cause, DBAPIError) else cause
        raise StorageError(f"{path}: cannot be used: {reason}") from error


class Search:
    """A search that keeps its state in a folder; a new search first flies to get `learned_config`.

    Args:
        campaign: the campaign; gives the cases.
        tune: section `tune` of the campaign.
        folder: folder for the storage.
        fly: flies cases.

    Raises:
        ConfigError: the first case cannot be flown.
        StorageError: the storage in the folder cannot be used.

    Attributes:
        path: file of the storage.
    """

    def __init__(self, campaign: Campaign, tune: Tune, folder: Path, fly: Fly) -> None:
        import optuna  # noqa: PLC0415  an extra

        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self._optuna = optuna
        self._campaign, self._tune, self._fly = campaign, tune, fly
        self.path = folder / STORAGE
        with _storage_errors(self.path):
            self._study: Study = optuna.create_study(
                storage=f"sqlite:///{self.path}",
                study_name=_STUDY_NAME,
                sampler=self._sampler(0),
                load_if_exists=True,
            )
            if not self._study.trials:
                self._enqueue_starts()

    def run(self, trials: int) -> Iterator[SearchResults]:
        """Try candidates until there are `trials` of them, including those of earlier runs.

        Yields:
            the results so far, before each candidate and at the end.

        Raises:
            StorageError: the storage cannot be used any more, perhaps because the disk is full.
        """
        with _storage_errors(self.path):
            yield (results := self.results())
            while results.tried_count < trials:
                # Each trial has its own seed, so an interruption does not change the candidates.
                self._study.sampler = self._sampler(results.tried_count)
                self._try_candidate(self._interrupted_trial() or self._study.ask())
                yield (results := self.results())

    def results(self) -> SearchResults:
        """The results of all trials so far, including those of earlier runs."""
        complete_trials = [
            trial for trial in self._ended_trials() if trial.user_attrs.get(_COMPLETE_KEY)
        ]
        candidates = [
            Candidate(
                trial.number,
                trial.user_attrs[_VALUES_KEY],
                Score._make(map(tuple, trial.user_attrs[_SCORE_KEY])),
            )
            for trial in complete_trials
            if trial.user_attrs[_VIOLATION_KEY] <= 0.0
        ]
        candidates_by_rms = sorted(candidates, key=lambda candidate: candidate.score.rms)
        tried_count = len(self._ended_trials())
        near_best = candidates_by_rms[: max(3, len(candidates_by_rms) // 10)]
        return SearchResults(
            tried_count,
            tried_count - len(complete_trials),
            candidates_by_rms[0] if candidates_by_rms else None,
            near_best,
        )

    @property
    def _neighbour_count(self) -> int:
        """Number of candidates tried near the last start candidate before Optuna suggests any."""
        return max(_FEWEST_NEIGHBOURS, len(self._tune.search))

    def _sampler(self, tried_count: int) -> Any:
        return self._optuna.samplers.TPESampler(
            seed=self._campaign.file.seed + tried_count,
            multivariate=True,
            n_startup_trials=_MOST_STARTS + self._neighbour_count,
        )

    def _enqueue_starts(self) -> None:
        """Enqueue the start candidates of a new search, and candidates near the last of them."""
        config, search = learned_config(self._campaign), self._tune.search
        start_list = list(start_candidates(self._campaign, self._tune, config))
        count, seed = self._neighbour_count, self._campaign.file.seed
        for start in (*start_list, *candidates_near(start_list[-1], search, count, seed)):
            self._study.enqueue_trial(dict(start.values), user_attrs={"start": start.name})

    def _interrupted_trial(self) -> "Trial | None":
        """The trial whose flights were interrupted, to be tried again; None: there is none."""
        trials = self._study.get_trials(states=(self._optuna.trial.TrialState.RUNNING,))
        return self._optuna.trial.Trial(self._study, trials[0]._trial_id) if trials else None

    def _ended_trials(self) -> "list[FrozenTrial]":
        """The trials that have ended, including pruned ones."""
        states = self._optuna.trial.TrialState
        ended_states = states.COMPLETE, states.PRUNED
        return list(self._study.get_trials(deepcopy=False, states=ended_states))

    def _try_candidate(self, trial: "Trial") -> None:
        values = suggested_values(trial, self._tune.search)
        trial.set_user_attr(_VALUES_KEY, values)
        try:
            all_cases = cases(self._campaign, values)
        except ConfigError:  # keys that do not fit together, such as a minimum above a maximum
            self._stop(trial, _LARGEST_ERROR, 1.0)
            return
        first_count = max(_FEWEST_FIRST_CASES, len(all_cases) // _FIRST_CASES_DIVISOR)
        first_count = min(len(all_cases), first_count)
        score = score_of(self._fly(all_cases[:first_count]), self._tune.envelope_m)
        violation = self._shortfall(score, len(all_cases))
        if first_count < len(all_cases) and (violation > 0.0 or self._is_hopeless(score)):
            self._stop(trial, _capped_rms(score), max(violation, 0.0))
            return
        score = score.combined_with(
            score_of(self._fly(all_cases[first_count:]), self._tune.envelope_m)
        )
        trial.set_user_attr(_SCORE_KEY, score)
        self._set_violation(trial, self._shortfall(score, len(all_cases)))
        trial.set_user_attr(_COMPLETE_KEY, True)
        self._study.tell(trial, _capped_rms(score))

    def _stop(self, trial: "Trial", error: float, violation: float) -> None:
        """End a candidate before all of its cases were flown, with its RMS error so far, m."""
        self._set_violation(trial, violation)
        trial.report(error, 0)
        self._study.tell(trial, state=self._optuna.trial.TrialState.PRUNED)

    def _set_violation(self, trial: "Trial", violation: float) -> None:
        """Store the violation of the constraint, for Optuna's sampler; 0 or less: it is met."""
        trial.set_user_attr(_VIOLATION_KEY, violation)
        trial.set_constraint(_VIOLATION_KEY, violation)

    def _shortfall(self, score: Score, cases_count: int) -> float:
        """`inside_share` minus the largest share inside the envelope that is still possible.

        0 or less: `inside_share` can still be reached. `score` covers the cases flown so far, and
        `cases_count` is the number of all cases.
        """
        outside_count = sum(not is_inside for is_inside in score.is_inside)
        return self._tune.inside_share - (cases_count - outside_count) / cases_count

    def _is_hopeless(self, score: Score) -> bool:
        best = self.results().best
        return (
            best is not None
            and score.rms > _HOPELESS_FACTOR * best.score.first_cases(len(score.true_errors)).rms
        )


def _capped_rms(score: Score) -> float:
    """The RMS error for Optuna, m; the error of each flight is at most `_LARGEST_ERROR`."""
    return pooled_rms(np.minimum(score.true_errors, _LARGEST_ERROR))
