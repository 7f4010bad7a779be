"""How balanced the orders of a study are over its participants (docs/method/protocols.md#order)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from tactileq.experiments.study.design import Trial
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks import plan_session
from tactileq.modeling.files.answer_tables import ANSWER_TABLES


@dataclass(frozen=True, kw_only=True)
class Balance:
    """How often something comes, over participants or within a session.

    Parameters
    ----------
    what : str
        What is counted.
    least, most : int
        Of all its counts.
    of : int
        How often it could have come.
    """

    task: str
    what: str
    least: int
    most: int
    of: int


def balance_of(
    study: Study, task: str, *, drawn: Callable[[str], None] = lambda session: None
) -> list[Balance]:
    """What is balanced in a task when each slot is done once, by the subject of its number.

    Every order is drawn as sessions draw it: some milliseconds each.

    Parameters
    ----------
    drawn : callable
        Called after each session whose order was drawn, with its name.

    Raises
    ------
    InputError
        If the study has no such task.
    """
    plan = study.plan_of(task)
    sessions = [
        [
            _compared(study, task, slot=slot, session=session, drawn=drawn)
            for session in range(1, study.sessions(task) + 1)
        ]
        for slot in range(1, plan.participants + 1)
    ]
    models = study.models_of(task)
    flat = [trials for days in sessions for trials in days]
    if flat[0][0].texture not in study.textures:
        found = []  # no surface, so no models to balance
    elif plan.schedule == "by-day":
        found = [_begin(sessions, models)]
    else:
        found = list(_first(sessions, study, models))
    if hasattr(flat[0][0], "first_surface"):
        found += _surfaces(flat, study, models)
    found += _buttons(flat)
    return [
        Balance(task=task, what=what, least=min(counts), most=max(counts), of=of)
        for what, counts, of in found
    ]


Found = tuple[str, list[int], int]


def _compared(
    study: Study, task: str, *, slot: int, session: int, drawn: Callable[[str], None]
) -> list[Trial]:
    """The main trials of a session, without those that stand apart."""
    order = plan_session(study, task=task, subject=slot, session=session).trials
    drawn(f"{task} {slot}, {session}")
    return [trial for trial in order if trial.phase == "main" and not _is_apart(trial, task)]


def _is_apart(trial: Trial, task: str) -> bool:
    """Whether it is an anchor or a catch trial, which stand apart from the comparison of models."""
    other = getattr(trial, ANSWER_TABLES[task].other_texture, "")
    return other not in ("", trial.texture)


def _begin(sessions: Sequence[Sequence[Sequence[Trial]]], models: Sequence[str]) -> Found:
    begun = Counter(days[0][0].model for days in sessions)
    return "participants who begin with a model", [begun[m] for m in models], len(sessions)


def _first(
    sessions: Sequence[Sequence[Sequence[Trial]]], study: Study, models: Sequence[str]
) -> Iterator[Found]:
    """Of each texture, which model comes first."""
    firsts = []
    for days in sessions:
        first: dict[str, str] = {}
        for trial in days[0]:
            first.setdefault(trial.texture, trial.model)
        firsts.append(first)
    pairs = [(texture, model) for texture in study.textures for model in models]
    over = [sum(first[texture] == model for first in firsts) for texture, model in pairs]
    yield "participants who get a model of a texture first", over, len(sessions)
    within = [list(first.values()).count(model) for first in firsts for model in models]
    yield "textures of a participant of which a model comes first", within, len(study.textures)


def _surfaces(
    sessions: Sequence[Sequence[Trial]], study: Study, models: Sequence[str]
) -> Iterator[Found]:
    """Where the real surface comes first."""
    real: Counter[tuple[str, str]] = Counter()
    every: Counter[tuple[str, str]] = Counter()
    within = []
    for trials in sessions:
        firsts = [trial for trial in trials if getattr(trial, "first_surface", "") == "real"]
        real.update((trial.texture, trial.model) for trial in firsts)
        every.update((trial.texture, trial.model) for trial in trials)
        within.append(len(firsts))
    pairs = [(texture, model) for texture in study.textures for model in models]
    yield (
        "trials of a texture and model with the real surface first",
        [real[pair] for pair in pairs],
        max(every.values()),
    )
    yield "trials of a session with the real surface first", within, len(sessions[0])


def _buttons(sessions: Sequence[Sequence[Trial]]) -> Iterator[Found]:
    """How often each button is right: that of the real texture, the odd surface, or the tone.

    Nothing of a task that has no buttons, or whose layout does not say which one is right.
    """
    over: Counter[int] = Counter()
    within = []
    for trials in sessions:
        places = [place for place in map(_right, trials) if place is not None]
        if len(places) < len(trials):
            return
        right = Counter(places)
        over.update(right)
        within += [right[button] for button in range(len(trials[0].layout))]  # type: ignore[attr-defined]
    yield "trials of a session in which a button is correct", within, len(sessions[0])
    trials_in_all = sum(map(len, sessions))
    buttons = range(len(sessions[0][0].layout))  # type: ignore[attr-defined]
    yield (
        "trials of all sessions in which a button is correct",
        [over[b] for b in buttons],
        trials_in_all,
    )


def _right(trial: Trial) -> int | None:
    layout: tuple[str, ...] = getattr(trial, "layout", ())
    named = (trial.texture, trial.model, "tone")
    places = (layout.index(what) for what in named if layout.count(what) == 1)
    return next(places, None)
