"""One session with all its parts: enrolment, order, rig, store, data set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.program import program_facts
from tactileq.experiments.sessions.kept.resume import resumption
from tactileq.experiments.sessions.kept.roster import LastSeal, Roster, RosterEntry
from tactileq.experiments.sessions.kept.stored_sessions import held_session
from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.experiments.sessions.loop.agenda import Agenda
from tactileq.experiments.sessions.loop.order import draw_session
from tactileq.experiments.sessions.loop.people import Intake
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult, run_trials
from tactileq.experiments.sessions.store.exposure import exposed_g2_s
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.study.design import SessionPlan
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study, plan_sha256
from tactileq.experiments.study.trays import require_trays
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.rig.shared.interface import TextureRig


@dataclass(frozen=True, kw_only=True)
class Circumstances:
    """The circumstances of a session, in addition to its study, task and numbers.

    Parameters
    ----------
    pilot : bool
        Whether its answers do not count.
    language : str
        One of the study's; empty for its first.
    override : str, optional
        Reason to continue where a rule is broken; stored.
    tell : callable, optional
        Called with each rule that is broken for that reason.
    resume : bool
        Whether to continue with a session that was aborted or interrupted.
    sources : mapping of set of models to path
        Where the models came from.

    Raises
    ------
    InputError
        For a reason that says nothing.
    """

    pilot: bool = False
    language: str = ""
    override: str | None = None
    tell: Callable[[str], None] | None = None
    resume: bool = False
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Overrides(self.override)  # refuses a reason that says nothing before anything is opened


def run_session(
    task: Task,
    study: Study,
    *,
    subject: int,
    session: int,
    models: ModelSets,
    rig: TextureRig,
    people: People,
    data_folder: str | Path,
    circumstances: Circumstances | None = None,
) -> tuple[SessionResult, Path]:
    """Run one session of a task and store it.

    Parameters
    ----------
    subject, session : int
        From 1; with the study's seed they fix the order of the trials.
    models : ModelSets
        Every model of every texture of the study.
    rig : TextureRig
        Presents the surfaces; opened here before anything is written, silent and closed
        afterwards, whatever happens.
    people : People
        Who answers, and who mounts the samples.
    data_folder : path
        Root of the data set.

    Returns
    -------
    SessionResult
        Not completed if somebody ended it early.
    Path
        Its manifest, beside which its log lies; `tactileq.experiments.sessions.bids.export` makes
        tables of them.

    Raises
    ------
    InputError
        If a model is missing, the session cannot begin or be resumed, or the rig cannot be opened.
    StoreError
        If the disk does not take the answers.
    """
    said = circumstances or Circumstances()
    overrides = Overrides(said.override, tell=said.tell)
    models.require(study, allow=overrides.allow)
    require_trays(study, allow=overrides.allow)
    _require_language(study, said.language)
    root = Path(data_folder)
    for stimulus in models.stimuli:
        rig.check_stimulus(stimulus)
    rig.open()
    try:
        # Asks git, hashes models: nobody else can enroll while the roster is locked.
        stated = _stated(study, task, models=models, rig=rig, people=people, said=said)
        enrolling = Roster(root).enrolling(
            subject,
            study.plan_of(task.name).participants,
            simulated=people.respondent.simulated,
            pilot=said.pilot,
        )
        # Enrolled only if the session may begin.
        with enrolling as person:
            plan = draw_session(study, task, subject=subject, session=session, slot=person.slot)
            manifest = SessionManifest(
                **stated,
                subject=subject,
                session=session,
                slot=person.slot,
                code=person.code,
                after={} if person.after is None else asdict(person.after),
                trials=tuple(trial.to_dict() for trial in plan.trials),
            )
            files = manifest.files(root)
            if said.resume and files.manifest.exists():
                held_session(files)  # nothing goes on that cannot be read to its end
            opened = SessionStore.resume if said.resume else SessionStore.create
            store = opened(root, manifest, overrides=overrides)
        with _sealed(store, root):
            stored = _stored_plan(plan, task, store=store, models=models)
            result = run_trials(
                stored,
                task,
                models=models,
                rig=rig,
                people=people,
                store=store,
                intake=_intake(stored.study, root, person),
                agenda=_agenda(task, store),
                pilot=said.pilot,
                exposed_g2_s=exposed_g2_s(root, subject, on=date.today()),
            )
    finally:
        rig.close()
    return replace(result, seal=store.seal), store.files.manifest


@contextmanager
def _sealed(store: SessionStore, root: Path) -> Iterator[None]:
    """Close a session at the end, and note in the roster the seal that it ends with.

    Where the disk takes no more, the log is what counts: the next manifest names the last seal
    that was noted.
    """
    try:
        with store:
            yield
    finally:
        with suppress(StoreError, InputError):
            if store.seal:
                Roster(root).note_seal(LastSeal(store.files.stem, store.seal))


def _stated(
    study: Study,
    task: Task,
    *,
    models: ModelSets,
    rig: TextureRig,
    people: People,
    said: Circumstances,
) -> dict[str, Any]:
    """The part of a manifest that does not depend on the participant."""
    sha256 = models.sha256(study.textures)
    return {
        "task": task.name,
        "language": said.language or study.languages[0],
        "pilot": said.pilot,
        "simulated_participant": people.respondent.simulated,
        "simulated_rig": rig.simulated,
        "study": study.to_dict(),
        "study_sha256": study.sha256,
        "plan_sha256": plan_sha256(study, sha256),
        "models_sha256": sha256,
        "model_sources": dict(said.sources),
        "identical": models.equal_models(study.textures, study.models_of(task.name)),
        "rig": rig.stated,
        "description": task.description,
        **program_facts(),
    }


def _require_language(study: Study, language: str) -> None:
    if language and language not in study.languages:
        raise InputError(
            f"expected a language of the study ({', '.join(study.languages)}), got "
            f"{shown(language)}; choose one, or add it to the study."
        )


def _intake(study: Study, root: Path, person: RosterEntry) -> Intake:
    """What to ask first; of who gave this consent before, only whether the code is theirs."""
    logs = (root / "sourcedata" / f"sub-{person.subject:02d}").glob("ses-*/*_log.jsonl")
    return Intake(
        consent=study.consent.version,
        code=person.code,
        known=any(_welcomes(log, study.consent.version) for log in logs),
        questions=study.questions,
    )


def _welcomes(log: Path, consent: str) -> bool:
    """Whether somebody was welcomed in this session, and gave this consent."""
    try:
        events = read_log(log).events
    except InputError:
        return False  # asked again, rather than not at all
    return any(e["event"] == "welcome" and e.get("consent") == consent for e in events)


def _stored_plan(
    plan: SessionPlan, task: Task, *, store: SessionStore, models: ModelSets
) -> SessionPlan:
    """The plan that the manifest on disk holds, whatever the study file says by now.

    Raises
    ------
    InputError
        If there is no model any more for what it plans.
    """
    study = Study.from_dict(store.manifest.study)
    if study.sha256 != plan.study.sha256:
        models.require(study, allow=lambda what, sentence: None)
    trials = tuple(task.trial_of(values) for values in store.manifest.trials)
    return replace(plan, study=study, trials=trials)


def _agenda(task: Task, store: SessionStore) -> Agenda:
    """What is to be done of the trials that the manifest on disk plans."""
    trials = [task.trial_of(values) for values in store.manifest.trials]
    if not store.before.runs:
        return Agenda.whole(trials)
    gap_min = store.manifest.study["longest_gap_min"]
    return Agenda.left(trials, resumption(store.manifest, store.before, longest_gap_min=gap_min))
