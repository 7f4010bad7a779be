"""What remains to be done in a session: all of it, or what an earlier run left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactileq.experiments.sessions.kept.resume import Resumption
from tactileq.experiments.study.design import Trial


@dataclass(frozen=True, kw_only=True)
class Agenda:
    """The trials that are open, in their order.

    Parameters
    ----------
    training : tuple of Trial
        Empty where training is over.
    training_again : bool
        Whether it was over before, and comes again after a long break.
    owed : tuple of Trial
        Those in which the rig failed and that were not repeated yet.
    next_number : int
        The next free number for trials that are not planned.
    run : int
        From 1.
    rows : tuple of mapping
        The answers so far.
    """

    training: tuple[Trial, ...]
    main: tuple[Trial, ...]
    owed: tuple[Trial, ...] = ()
    next_number: int
    training_again: bool = False
    run: int = 1
    rows: tuple[Mapping[str, Any], ...] = ()

    @staticmethod
    def whole(trials: Sequence[Trial]) -> Agenda:
        """Everything that is planned."""
        return Agenda(
            training=tuple(trial for trial in trials if trial.phase == "training"),
            main=tuple(trial for trial in trials if trial.phase == "main"),
            next_number=len(trials) + 1,
        )

    @staticmethod
    def left(trials: Sequence[Trial], resumption: Resumption) -> Agenda:
        """What an earlier run left of the planned trials."""
        planned = {trial.trial: trial for trial in trials}
        open_trials = tuple(planned[one["trial"]] for one in resumption.next_trials)
        again = resumption.training_due
        training = tuple(trials) if again else open_trials
        return Agenda(
            training=tuple(trial for trial in training if trial.phase == "training"),
            training_again=again,
            main=tuple(trial for trial in open_trials if trial.phase == "main"),
            owed=tuple(planned[one["trial"]] for one in resumption.to_repeat),
            next_number=resumption.next_number,
            run=resumption.run,
            rows=resumption.rows,
        )

    @property
    def trained(self) -> int:
        """Training trials answered already, in the training that continues."""
        if self.training_again:
            return 0
        return sum(row["phase"] == "training" and not row["repeats"] for row in self.rows)
