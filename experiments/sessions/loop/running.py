"""One session with all its parts: enrolment, order, rig, store, data set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.program import program_facts
from tactileq.experiments.sessions.kept.resume import resumption
from tactileq.experiments.sessions.kept.roster import LastSeal, Roster, RosterEntry
from tactileq.experiments.sessions.kept.stored_sessions import held_session
from tactileq.experiments.sessions.kept.texts import TextsByLanguage, sha256_of_texts
from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.experiments.sessions.loop.agenda import Agenda
from tactileq.experiments.sessions.loop.order import draw_session
from tactileq.experiments.sessions.loop.people import ConsentRefused, Intake, SessionAborted
from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.sessions.loop.trial_loop import People, SessionResult, run_trials
from tactileq.experiments.sessions.store.admission import check_clock
from tactileq.experiments.sessions.store.exposure import exposed_g2_s
from tactileq.experiments.sessions.store.session_store import SessionStore, require_openable
from tactileq.experiments.study.design import SessionPlan
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study, plan_sha256
from tactileq.experiments.study.trays import require_trays
from tactileq.modeling import InputError
from tactileq.modeling.files.places import matching
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
        Called with each rule that is broken for that reason, and where the clock was set back.
    resume : bool
        Whether to continue with a session that was aborted or interrupted.
    sources : mapping of set of models to path
        Where the models came from.
    texts : mapping of language to mapping of key to text
        What participants read, in each language of the study; empty where nobody reads.

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
    texts: TextsByLanguage = field(default_factory=dict)

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
    ConsentRefused
        If the participant does not consent: the session has not begun, the roster counts it, and
        nothing else is kept.
    InputError
        If a model or the texts of a language are missing, the session cannot begin or be resumed,
        or the rig cannot be opened.
    StoreError
        If the disk does not take the answers.
    """
    said = circumstances or Circumstances()
    overrides = Overrides(said.override, tell=said.tell)
    said = _prepared(study, models, rig, said=said, overrides=overrides)
    root = Path(data_folder)
    check_clock(root, tell=said.tell or _untold)
    rig.open()
    try:
        # Asks git, hashes models: nobody else can enroll while the roster is locked.
        simulated = people.respondent.simulated
        stated = _stated(study, task, models=models, rig=rig, simulated=simulated, said=said)
        enrolling = Roster(root).enrolling(
            subject,
            study.plan_of(task.name).participants,
            simulated=simulated,
            pilot=said.pilot,
        )
        _require_consent(
            _study_of(study, root, task, subject=subject, session=session, resume=said.resume),
            root,
            subject,
            people=people,
        )
        # Enrolled only if the session may begin.
        with enrolling as person:
            plan = draw_session(study, task, subject=subject, session=session, slot=person.slot)
            after = {} if person.after is None else asdict(person.after)
            manifest = _manifest(plan, stated, code=person.code, after=after)
            opened = SessionStore.resume if said.resume else SessionStore.create
            store = opened(root, manifest, overrides=overrides, texts=said.texts)
        with _sealed(store, root):
            stored = _stored_plan(plan, task, stored=store.manifest, models=models)
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


def require_ready(
    task: Task,
    study: Study,
    *,
    subject: int,
    session: int,
    models: ModelSets,
    rig: TextureRig,
    simulated: bool,
    data_folder: str | Path,
    circumstances: Circumstances | None = None,
) -> None:
    """Refuse a session that `run_session` would, as far as that needs neither rig nor respondent.

    It is asked before a window is opened. Nothing is written, and `run_session` asks it all again:
    another console may have begun the session meanwhile.

    Parameters
    ----------
    simulated : bool
        Whether a program will answer.

    Raises
    ------
    InputError
        As `run_session`.
    """
    said = circumstances or Circumstances()
    overrides = Overrides(said.override)  # which are told when the session begins
    said = _prepared(study, models, rig, said=said, overrides=overrides)
    check_clock(Path(data_folder), tell=_untold)  # it is told of when the session begins
    slot = Roster(data_folder).slot_for(
        subject, study.plan_of(task.name).participants, simulated=simulated
    )
    plan = draw_session(study, task, subject=subject, session=session, slot=slot)
    stated = _stated(study, task, models=models, rig=rig, simulated=simulated, said=said)
    manifest = _manifest(plan, stated, code="", after=None)
    in_force = require_openable(data_folder, manifest, overrides=overrides, resume=said.resume)
    _stored_plan(plan, task, stored=in_force, models=models)


def _prepared(
    study: Study,
    models: ModelSets,
    rig: TextureRig,
    *,
    said: Circumstances,
    overrides: Overrides,
) -> Circumstances:
    """The circumstances with their language; refuses what could not be presented or read."""
    said = replace(said, language=study.language_of_session(said.language))
    _require_texts(study, said.texts)
    models.require(study, allow=overrides.allow)
    require_trays(study, allow=overrides.allow)
    for stimulus in models.stimuli:
        rig.check_stimulus(stimulus)
    return said


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
    simulated: bool,
    said: Circumstances,
) -> dict[str, Any]:
    """The part of a manifest that does not depend on the participant."""
    sha256 = models.sha256(study.textures)
    return {
        "task": task.name,
        "language": said.language,
        "texts_sha256": sha256_of_texts(said.texts) or None,
        "pilot": said.pilot,
        "simulated_participant": simulated,
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


def _manifest(
    plan: SessionPlan, stated: Mapping[str, Any], *, code: str, after: Mapping[str, str] | None
) -> SessionManifest:
    return SessionManifest(
        **stated,
        subject=plan.subject,
        session=plan.session,
        slot=plan.slot,
        code=code,
        after=after,
        trials=tuple(trial.to_dict() for trial in plan.trials),
    )


def _require_texts(study: Study, texts: TextsByLanguage) -> None:
    """Refuse texts, where there are any, in other languages than the study's."""
    if texts and set(texts) != set(study.languages):
        raise InputError(
            f"expected texts in each language of the study ({', '.join(study.languages)}), got "
            f"them in {', '.join(texts)}; give those of all its languages, or none."
        )


def _study_of(
    study: Study, root: Path, task: Task, *, subject: int, session: int, resume: bool
) -> Study:
    """The study that a session goes by: of one that is resumed, the one that it began with."""
    files = SessionFiles(root=root, task=task.name, subject=subject, session=session)
    if not resume or not files.manifest.exists():
        return study
    return Study.from_dict(held_session(files).manifest.study)


def _require_consent(study: Study, root: Path, subject: int, *, people: People) -> None:
    """Ask for consent before anything of the participant is kept, unless it was given before.

    Raises
    ------
    ConsentRefused
    """
    version = study.consent.version
    if not version or _was_welcomed(root, subject, version):
        return
    people.respondent.hear(_unheard, people.experimenter.page)
    try:
        if people.respondent.consents(version):
            return
    except SessionAborted:
        pass  # who leaves the page has not consented
    Roster(root).decline()
    with suppress(SessionAborted):
        people.respondent.announce("consent.closing")
    raise ConsentRefused("consent refused")


def _untold(sentence: str) -> None:
    """Nobody is there to be told."""


def _unheard(event: str, **fields: object) -> None:
    """Of who has not consented nothing is noted."""


def _intake(study: Study, root: Path, person: RosterEntry) -> Intake:
    """What to ask first; of who gave this consent before, only whether the code is theirs."""
    return Intake(
        consent=study.consent.version,
        code=person.code,
        known=_was_welcomed(root, person.subject, study.consent.version),
        questions=study.questions,
    )


def _was_welcomed(root: Path, subject: int, consent: str) -> bool:
    """Whether somebody was welcomed in an earlier session, having given this consent."""
    logs = matching(root / "sourcedata" / f"sub-{subject:02d}", "ses-*/*_log.jsonl")
    return any(_welcomes(log, consent) for log in logs)


def _welcomes(log: Path, consent: str) -> bool:
    """Whether somebody was welcomed in this session, and gave this consent."""
    try:
        events = read_log(log).events
    except InputError:
        return False  # asked again, rather than not at all
    return any(e["event"] == "welcome" and e.get("consent") == consent for e in events)


def _stored_plan(
    plan: SessionPlan, task: Task, *, stored: SessionManifest, models: ModelSets
) -> SessionPlan:
    """The plan that the stored manifest holds, whatever the study file says by now.

    Raises
    ------
    InputError
        If there is no model any more for what it plans.
    """
    study = Study.from_dict(stored.study)
    if study.sha256 != plan.study.sha256:
        models.require(study, allow=lambda what, sentence: None)
    trials = tuple(task.trial_of(values) for values in stored.trials)
    return replace(plan, study=study, trials=trials)


def _agenda(task: Task, store: SessionStore) -> Agenda:
    """What is to be done of the trials that the manifest on disk plans."""
    trials = [task.trial_of(values) for values in store.manifest.trials]
    if not store.before.runs:
        return Agenda.whole(trials)
    gap_min = store.manifest.study["longest_gap_min"]
    return Agenda.left(trials, resumption(store.manifest, store.before, longest_gap_min=gap_min))
