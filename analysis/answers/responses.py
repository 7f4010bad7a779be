"""The answers of a study as used by all analyses: present, missing and excluded answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from tactileq.analysis.answers.plan import AnalysisPlan
from tactileq.analysis.labels import MODELS
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.answer_tables import ANSWER_TABLES

SETUP_SEPARATOR = "/"  # a set-up's name and a participant's: leipzig/sub-01


@dataclass(frozen=True)
class PlannedTask:
    """What a study plans of a task.

    Parameters
    ----------
    sessions : int
        Of all participants.
    models : tuple of str
        The sets of models that it compares, the reference first.
    repeats : int
        Answers to each texture with each model; to each texture where trials hold both models.
    trials : int
        Main trials of all sessions together; 0 where the data do not say.
    """

    participants: int
    sessions: int
    models: tuple[str, ...] = MODELS
    repeats: int = 1
    trials: int = 0


@dataclass(frozen=True, eq=False)
class Responses:
    """Every answer of one study, checked.

    Parameters
    ----------
    answers : mapping of task to DataFrame
        Main trials of each task that `tactileq.modeling.files.answer_tables` declares, one row
        each: participant_id, session, and the task's columns (numbers NaN where not answered).
    simulated_participants : bool
        True where no person took part.
    simulated_rig : bool
        True where no real rig was used, so that no participant felt a real surface.
    training : mapping of task to DataFrame
        The training trials, same columns; no statistic uses them.
    anchors : mapping of task to DataFrame
        Of tasks that can have them the main trials that show whether people tell surfaces apart,
        same columns: anchors, whose virtual surface modelled another texture than the real one's,
        and catch trials, whose odd one modelled another texture than the other two; no statistic
        of the models uses them.
    left_out : mapping of task to DataFrame
        The main trials of participants who were left out by hand (`leave_out`); of a session of
        theirs that cannot be read, or has no answer, one row with participant and session alone.
    name : str
        The study's name.
    models : mapping of texture to mapping of set to SHA-256
        The models that were presented; empty where the data do not say.
    equal : mapping of texture to sequence of sequence of str
        Sets whose models of a texture are equal, group by group, as the sessions say.
    plan : AnalysisPlan
        What was claimed before the first answer.
    study_sha256 : str
        Of the study that was run; empty where the data do not say.
    planned : mapping of task to PlannedTask
        How many are to take part, where the data set's description states it.
    under_way : mapping of task to frozenset of str
        Participants with a session that lacks answers and may go on, as they have not dropped out.
    dropped_out : frozenset of str
        Participants who will not return and are replaced by others.
    setups : int
        Number of set-ups that ran the study, each as planned, with the planned numbers in total.
    verified : tuple of str
        A line for each set-up: how many of its sessions are as they were stored.
    unverified : str
        Why answers are analyzed that are not; empty where they are.
    warnings : tuple of str
        What was dropped on reading and why, and which sessions ended early; one sentence each.
    """

    answers: Mapping[str, pd.DataFrame]
    simulated_participants: bool
    simulated_rig: bool
    training: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    anchors: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    left_out: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    name: str = ""
    models: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    equal: Mapping[str, Sequence[Sequence[str]]] = field(default_factory=dict)
    plan: AnalysisPlan = field(default_factory=lambda: AnalysisPlan(claims=()))
    study_sha256: str = ""
    planned: Mapping[str, PlannedTask] = field(default_factory=dict)
    under_way: Mapping[str, frozenset[str]] = field(default_factory=dict)
    dropped_out: frozenset[str] = frozenset()
    setups: int = 1
    verified: tuple[str, ...] = ()
    unverified: str = ""
    warnings: tuple[str, ...] = field(default=())

    def identical(self, pair: tuple[str, str] = MODELS) -> frozenset[str]:
        """Textures whose models are the same in both sets: nothing to compare."""
        same = {
            texture
            for texture, sets in self.models.items()
            if all(name in sets for name in pair) and sets[pair[0]] == sets[pair[1]]
        }
        stated = {
            texture
            for texture, groups in self.equal.items()
            if any(set(pair) <= set(group) for group in groups)
        }
        return frozenset(same | stated)

    @property
    def textures(self) -> tuple[str, ...]:
        """Textures that were asked about, in the order of the answers."""
        asked = (t for table in self.answers.values() for t in table["texture"].dropna())
        return tuple(dict.fromkeys(asked))

    def done(self, task: str) -> PlannedTask:
        """How many participants and sessions have answered main trials of a task so far.

        Without those who dropped out, since others take their places.
        """
        return _done(self._kept(task))

    def trials_done(self, task: str) -> int:
        """How many main trials those of `done` have answered so far, `anchors` included."""
        anchors = self.anchors.get(task, self.answers[task][:0])
        return len(self._kept(task)) + len(self._without_dropouts(anchors))

    def _kept(self, task: str) -> pd.DataFrame:
        return self._without_dropouts(self.answers[task])

    def _without_dropouts(self, table: pd.DataFrame) -> pd.DataFrame:
        return table[~table["participant_id"].isin(list(self.dropped_out))]

    @property
    def unfinished(self) -> tuple[str, ...]:
        """Tasks that were begun, with fewer participants or sessions than planned or under way.

        Those who were left out by hand have taken part, those who dropped out have not. Each set-up
        counts by itself.
        """
        return tuple(task for task in self.planned if self._is_unfinished(task))

    def _is_unfinished(self, task: str) -> bool:
        here, planned = self._kept(task), self.planned[task]
        here = pd.concat([here, self.left_out.get(task, here[:0])])
        done = [_done(rows) for _, rows in here.groupby(setup_of(here["participant_id"]))]
        begun = len(done) > 0 or len(self.answers[task]) > 0
        fewer = len(done) < self.setups or any(
            one.participants * self.setups < planned.participants
            or one.sessions * self.setups < planned.sessions
            for one in done
        )
        return begun and (fewer or bool(self.under_way.get(task)))

    @property
    def simulated(self) -> bool:
        """True where participants or rig were simulated."""
        return self.simulated_participants or self.simulated_rig


def _done(answers: pd.DataFrame) -> PlannedTask:
    sessions = answers.reindex(columns=["participant_id", "session"]).drop_duplicates()
    return PlannedTask(answers["participant_id"].nunique(), len(sessions))


def leave_out(responses: Responses, reasons: Mapping[str, str]) -> Responses:
    """The answers without those of some participants, named in `warnings` with the reasons.

    Parameters
    ----------
    reasons : mapping of participant to reason
        Participants as in the data, such as sub-05.

    Raises
    ------
    InputError
        For a participant who gave no answers, or an empty reason.
    """
    tables = (responses.answers, responses.training, responses.anchors)
    every = [*tables, responses.left_out]
    known = {who for kind in every for t in kind.values() for who in t["participant_id"]}
    for who, why in reasons.items():
        if who not in known or not why.strip():
            raise InputError(
                f"expected a participant with answers and a reason to leave them out, got "
                f"{shown(who)} with {shown(why)}; name one as the data do, such as "
                f"{min(known, default='sub-01')}."
            )
    answers, training, anchors = (
        {task: t[~t["participant_id"].isin(list(reasons))] for task, t in kind.items()}
        for kind in tables
    )
    left_out = tuple(f"{who} was left out by hand: {why}." for who, why in reasons.items())
    return replace(
        responses,
        answers={task: table.reset_index(drop=True) for task, table in answers.items()},
        training=training,
        anchors=anchors,
        left_out={
            task: pd.concat(
                [
                    table[table["participant_id"].isin(list(reasons))],
                    responses.left_out.get(task, table[:0]),
                ]
            )
            for task, table in responses.answers.items()
        },
        under_way={task: who - reasons.keys() for task, who in responses.under_way.items()},
        warnings=(*responses.warnings, *left_out),
    )


def stands_apart(table: pd.DataFrame, task: str) -> pd.Series:
    """Which answers are to anchors or catch trials; none of a table that cannot say.

    Parameters
    ----------
    table : DataFrame
        Answers to the task, with the column texture.

    Returns
    -------
    Series of bool
    """
    other = table.get(ANSWER_TABLES[task].other_texture)
    if other is None:
        return pd.Series(False, index=table.index)
    return other.notna() & (other != table["texture"])


def setup_of(participants: pd.Series) -> pd.Series:
    """The set-up before each participant's name; empty where there is only one."""
    parts = participants.str.split(SETUP_SEPARATOR, n=1)
    return parts.map(lambda found: found[0] if len(found) > 1 else "")
