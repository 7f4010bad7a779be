"""Sessions on disk, written by the store as the trial loop does, without a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.program import program_facts
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.rig.shared.interface import HandRows, PresentationRecord
from tests.experiments.sessions.store.enrolling import enrolled

SURFACES = ("canvas", 'say "velvet", or', "和紙")
SETS = ("full", "simplified")
QUESTIONS = [
    {"name": "age", "least": 18, "most": 99},
    {"name": "sex", "levels": ["female", "male", "other", "not said"]},
    {"name": "handedness", "levels": ["left", "right", "ambidextrous"]},
    {"name": "hours_of_sleep", "least": 0, "most": 24, "text": {"en": "How long?", "ja": "何時間"}},
]
STUDY: dict[str, Any] = {
    "name": "Three surfaces",
    "data_license": "CC0",
    "masking": "pink noise",
    "surface_visible": "hidden",
    "models": {name: name for name in SETS},
    "questions": QUESTIONS,
    "absolute": {"participants": 2, "schedule": "interleaved", "training_trials": 1},
    "relative": {"participants": 2, "schedule": "by-day", "models": list(SETS)},
    "oddity": {"participants": 2, "schedule": "interleaved", "models": list(SETS)},
    "threshold": {"participants": 2, "schedule": "interleaved"},
}
MODELS = {texture: {name: f"{name}-{texture}" for name in SETS} for texture in SURFACES}
WriteSession = Callable[..., SessionFiles]


def planned(task: str) -> list[dict[str, Any]]:
    """Two training trials and seven or so main ones."""
    pairs = [(texture, model) for texture in SURFACES for model in SETS]
    drafts = [("training", *pairs[0]), ("training", *pairs[3])]
    drafts += [("main", texture, model) for texture, model in pairs]
    trials = []
    for number, (phase, texture, model) in enumerate(drafts, start=1):
        trial: dict[str, Any] = {"trial": number, "phase": phase, "texture": texture}
        trial |= {"model": model, "tray": "ABC"[SURFACES.index(texture)]}
        if task == "absolute":
            trial |= {"virtual_texture": texture, "first_surface": ("real", "virtual")[number % 2]}
        elif task == "relative":
            trial |= {"layout": [*SURFACES[number % 3 :], *SURFACES[: number % 3]]}
        elif task == "oddity":
            other = SETS[1 - SETS.index(model)]
            trial |= {"layout": [model, other, other], "odd_position": 1}
        else:
            trial |= {"texture": "", "model": "", "tray": "", "frequency_hz": 30.0 * number}
        trials.append(trial)
    if task == "absolute":  # an anchor
        trials.append({**trials[-1], "trial": len(trials) + 1, "virtual_texture": "canvas"})
    return trials


def answer_to(trial: Mapping[str, Any], task: str) -> dict[str, Any]:
    """The task's own columns."""
    number = trial["trial"]
    if task == "absolute":
        own = {name: trial[name] for name in ("virtual_texture", "first_surface")}
        scales = {"magnitude_similarity": 50.5 + number, "frequency_similarity": 0.1 + 0.2}
        return {**own, **scales, "toggles": 3, "response_time_s": 2.5}
    if task == "relative":
        answer = trial["layout"][0]
        right = int(answer == trial["texture"])
        shared = {"answer": answer, "correct": right, "presses": 4, "response_time_s": 3.25}
        return {"layout": "|".join(trial["layout"]), **shared}
    if task == "oddity":
        own = {"layout": "|".join(trial["layout"]), "odd_position": trial["odd_position"]}
        return {**own, "answer": 2, "correct": 0, "presses": 5, "response_time_s": 1.5}
    own = {
        "frequency_hz": trial["frequency_hz"],
        "amplitude_g": 0.0125,
        "highest_g": 0.5,
        "interval": 1,
    }
    return {**own, "answer": 1, "correct": 1, "response_time_s": 0.75}


def a_manifest(
    *, task: str, subject: int, session: int, code: str, slot: int, **others: Any
) -> SessionManifest:
    values: dict[str, Any] = {
        "language": "en",
        "pilot": False,
        "simulated_participant": True,
        "simulated_rig": True,
        "study": STUDY,
        "plan_sha256": "0" * 64,
        "models_sha256": MODELS,
        "model_sources": {name: name for name in SETS},
        "identical": {},
        "rig": {},
        "description": f"The task {task}.",
        **program_facts(),
        "trials": planned(task),
    }
    values |= others
    values = {"study_sha256": sha256_of_values(values["study"]), **values}
    return SessionManifest(
        task=task, subject=subject, session=session, code=code, slot=slot, **values
    )


def strokes(trial: int, *, start_s: float) -> tuple[HandRows, list[PresentationRecord]]:
    """Half a second of a sine on each surface, read at irregular times above 200 a second."""
    rng = np.random.default_rng(trial)
    time_s = start_s + np.cumsum(rng.uniform(0.002, 0.005, 280))
    middle_s = float(time_s[140])
    rows = HandRows(
        time_s=time_s,
        speed_mm_s=100.0 * np.sin(2.0 * np.pi * time_s),
        force_n=np.where(time_s < middle_s, np.nan, 1.0 + 0.5 * np.cos(2.0 * np.pi * time_s)),
        surface=np.where(time_s < middle_s, 1, 2),
        presentation=np.where(time_s < middle_s, 2 * trial - 1, 2 * trial),
        force_assumed=np.zeros(280, dtype=bool),
    )
    between = [float(time_s[0]), middle_s, float(time_s[-1])]
    shown = [
        PresentationRecord(
            number=2 * trial - 1 + place,
            surface=("real", "virtual")[place],
            texture=SURFACES[0],
            model_sha256=("", "full-canvas")[place],
            start_s=between[place],
            end_s=between[place + 1],
        )
        for place in (0, 1)
    ]
    return rows, shown


def run_trial(
    store: SessionStore, trial: Mapping[str, Any], task: str, *, row: Mapping[str, Any]
) -> None:
    """What the loop tells the store of one trial, whose number is the row's."""
    number = int(row["trial"])
    rows, shown = strokes(number, start_s=10.0 * number)
    store.log("mount_requested", trial=number, tray=trial["tray"])
    store.log("mount_confirmed", trial=number, tray=trial["tray"])
    for place, record in enumerate(shown):
        which = {"index": 0} if place else {}
        start = {"surface": record.surface, "start_s": record.start_s, **which}
        store.log("presented", trial=number, **start)
    store.answer(number, {**row, **answer_to(trial, task)})
    store.trace(number, rows, presentations=shown, faults=())


def session_on_disk(
    folder: Path,
    task: str = "absolute",
    *,
    subject: int = 1,
    session: int = 1,
    answered: int | None = None,
    status: str | None = "complete",
    reason: str = "",
    answers: Mapping[str, Any] | None = None,
    resume: bool = False,
    invalid: Sequence[int] = (),
    **others: Any,
) -> SessionFiles:
    """Run a session, or go on with one: `answered` trials, then its end, if it has one."""
    simulated = others.get("simulated_participant", True)
    person = enrolled(Roster(folder), subject, 3, simulated=simulated)
    manifest = a_manifest(
        task=task, subject=subject, session=session, code=person.code, slot=person.slot, **others
    )
    begin = SessionStore.resume if resume else SessionStore.create
    with begin(folder, manifest) as store:
        if answers is not None:
            store.log("welcome", consent="2026-11", answers=dict(answers))
        store.log("phase", phase="training", again=False)
        done = {row["trial"] for row in store.before.rows}
        left = [trial for trial in manifest.trials if trial["trial"] not in done]
        for trial in left[:answered]:
            row = {name: trial[name] for name in ("trial", "phase", "texture", "model", "tray")}
            facts = {"run": store.run, "valid": int(trial["trial"] not in invalid)}
            kind = {"pilot": manifest.pilot, "simulated": manifest.simulated}
            run_trial(store, trial, task, row={**row, **facts, "repeats": None, **kind})
        if status is not None:
            store.finish(status, reason, by="participant")
    return manifest.files(folder)


@pytest.fixture
def write_session(tmp_path: Path) -> WriteSession:
    """`session_on_disk` in the folder `data`."""
    return partial(session_on_disk, tmp_path / "data")


def _manifest(**changed: Any) -> SessionManifest:
    phases = ["training", "training", "main", "main", "main", "main"]
    values: dict[str, Any] = {
        "task": "absolute",
        "subject": 1,
        "session": 1,
        "slot": 1,
        "code": "TAKI-46",
        "language": "en",
        "pilot": False,
        "simulated_participant": False,
        "simulated_rig": False,
        "study": {"name": "Small", "seed": 3, "data_license": "CC0"},
        "plan_sha256": "bb",
        "models_sha256": {"canvas": {"full": "cc", "simplified": "dd"}},
        "model_sources": {"full": "models", "simplified": "simplified"},
        "identical": {},
        "rig": {"firmware": "1.2", "latency_s": 0.1 + 0.2},
        "description": "Compare a real and a virtual surface",
        **program_facts(),
        "trials": [
            {"trial": n, "phase": phase, "texture": "canvas", "layout": ["MDF", "PVC"]}
            for n, phase in enumerate(phases, start=1)
        ],
    }
    values |= changed
    return SessionManifest(**{"study_sha256": sha256_of_values(values["study"]), **values})


@pytest.fixture
def manifest_of() -> Callable[..., SessionManifest]:
    """A manifest of two training and four main trials, with what is given changed."""
    return _manifest
