"""What BIDS shows of one session: answers, events and the hand, made from what it wrote.

docs/method/protocols.md#bids
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids import events
from tactileq.experiments.sessions.bids.earlier import has_earlier_text
from tactileq.experiments.sessions.bids.tables import json_bytes, table_bytes
from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import StoredSession
from tactileq.experiments.sessions.kept.trace_rows import TraceRows, hand_rows, presentation_rows
from tactileq.experiments.sessions.kept.traces import HAND_COLUMNS
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerColumn
from tactileq.modeling.files.columns import names
from tactileq.modeling.files.columns import sidecar as sidecar_of
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.hashes import sha256_of_paths

Made = dict[Path, bytes]


def session_files(held: StoredSession, *, anew: bool = False) -> tuple[Made, tuple[str, ...]]:
    """All files of a session, and which rows of its traces are damaged and not in them.

    The last file is the sidecar that says that the others are there, and what is not in them. The
    hand at a regular rate takes longest to make: unless all is to be made anew, it is taken as it
    is there where the sidecar says that it was made from the same files, by this version.
    """
    files = held.files
    runs = {event["run"] for event in held.state.events}
    sources = _sources(files)
    sidecar = files.answers.with_suffix(".json")
    shown, lost_rows = presentation_rows(files.named("presentations.tsv"), runs=runs)
    there = None if anew else _hand_there(sidecar, sources)
    hand, lost_readings = there or _hand(held, runs)
    made = {**_answers(held), **_events(held, shown), **hand}
    lost = {"presentations": lost_rows, "hand": lost_readings}
    damaged = {name: list(said) for name, said in lost.items() if said}
    made[sidecar] = json_bytes(
        {
            **_circumstances(held),
            "DerivedFrom": sources,
            **({"Damaged": damaged} if damaged else {}),
            "Files": {path.name: hashlib.sha256(data).hexdigest() for path, data in made.items()},
            **sidecar_of(_columns(held)),
        }
    )
    return made, (*lost_rows, *lost_readings)


def _answers(held: StoredSession) -> Made:
    return {held.files.answers: table_bytes(_columns(held), held.state.rows)}


def _columns(held: StoredSession) -> list[AnswerColumn]:
    """The columns of the answers, without optional ones that no answer has."""
    columns = ANSWER_TABLES[held.manifest.task].columns
    return [c for c in columns if not c.optional or any(c.name in row for row in held.state.rows)]


def _events(held: StoredSession, presentations: list[dict[str, str]]) -> Made:
    rows = events.event_rows(held.state.events, presentations)
    table = held.files.beh / f"{held.files.stem}_events.tsv"
    described = sidecar_of(events.EVENT_COLUMNS)
    described["trial_type"]["Levels"] = events.trial_types(rows)
    manifest = held.manifest
    sidecar = {
        "TaskName": manifest.task,
        "TaskDescription": manifest.description,
        "StimulusPresentation": {
            "SoftwareName": "tactileq",
            "SoftwareVersion": manifest.versions.get("tactileq", "not stated"),
            "OperatingSystem": manifest.platform,
        },
        **described,
    }
    return {
        table: table_bytes(events.EVENT_COLUMNS, rows),
        table.with_suffix(".json"): json_bytes(sidecar),
    }


def _hand(held: StoredSession, runs: set[int]) -> tuple[Made, tuple[str, ...]]:
    """A file for each start of the session, whose rig has a clock of its own."""
    path = held.files.named("hand.tsv")
    found = hand_rows(path, runs=runs)
    if not found.rows:
        return {}, found.damaged
    # late: pandas takes longer to load than all else
    from tactileq.experiments.sessions.bids import physio

    onsets = events.onsets_s(held.state.events)
    made, damaged = {}, [*found.damaged]
    for run, readings in physio.by_run(_readings(found)).items():
        if wrong := physio.damaged_readings(readings):
            damaged.append(f"{wrong} {path.name}, so no table of start {run}")
            continue
        stem = held.files.beh / f"{held.files.stem}_recording-start{run}_physio"
        start_s = physio.start_onset_s(readings, held.state.events, onsets, run=run)
        made[Path(f"{stem}.json")] = json_bytes(
            {
                "SamplingFrequency": physio.RATE_HZ,
                "StartTime": start_s,
                "Columns": names(physio.PHYSIO_COLUMNS),
                "TaskName": held.manifest.task,
                "PhysioType": "generic",
                **_simulated(held.manifest),
                **sidecar_of(
                    physio.COMMANDED_COLUMNS
                    if "Walls" in held.manifest.rig
                    else physio.PHYSIO_COLUMNS
                ),
            }
        )
        regular = physio.at_regular_times(readings)
        made[Path(f"{stem}.tsv.gz")] = physio.physio_bytes(regular)
    return made, tuple(damaged)


def _readings(found: TraceRows) -> Any:
    """A DataFrame of the hand's readings, its index the lines of the file."""
    import pandas as pd

    text = io.BytesIO(b"\n".join(found.rows))
    hand = pd.read_csv(text, sep="\t", header=None, names=names(HAND_COLUMNS))
    return hand.set_axis(list(found.lines), axis=0)


def _hand_there(sidecar: Path, sources: Mapping[str, str]) -> tuple[Made, tuple[str, ...]] | None:
    """The hand's files as they were made from the same sources; None where they are not there.

    None, too, where an earlier version described their columns otherwise.
    """
    try:
        stated = read_json_object(sidecar, advice="")
        names = [name for name in stated["Files"] if "_recording-" in name]
        made = {sidecar.parent / name: (sidecar.parent / name).read_bytes() for name in names}
        damaged = [str(row) for row in stated.get("Damaged", {}).get("hand", [])]
        hashes = [hashlib.sha256(data).hexdigest() for data in made.values()]
        as_made = hashes == [stated["Files"][name] for name in names]
    except (InputError, OSError, KeyError, AttributeError, TypeError, ValueError):
        return None
    if not as_made or stated.get("DerivedFrom") != sources:
        return None
    if any(has_earlier_text(data) for path, data in made.items() if path.suffix == ".json"):
        return None
    return made, tuple(damaged)


def _circumstances(held: StoredSession) -> dict[str, Any]:
    """What was the same in all trials."""
    manifest = held.manifest
    study = manifest.study
    plan = study.get(manifest.task, {})
    overrides = [*manifest.overrides]
    for event in held.state.events:
        if event["event"] == "opened":
            overrides += [o for o in event.get("overrides", ()) if o not in overrides]
    return {
        "TaskName": manifest.task,
        "TaskDescription": manifest.description,
        "StudyName": study.get("name", "not stated"),
        "Masking": study.get("masking", "not stated"),
        "SurfaceVisible": study.get("surface_visible", "not stated"),
        "Schedule": plan.get("schedule", "not stated"),
        "Status": held.state.status,
        "Starts": held.state.runs,
        **_simulated(manifest),
        "Pilot": manifest.pilot,
        "StudySHA256": manifest.study_sha256,
        "PlanSHA256": manifest.plan_sha256,
        "ModelsSHA256": manifest.models_sha256,
        **({"TextsSHA256": manifest.texts_sha256} if manifest.texts_sha256 else {}),
        "Identical": manifest.identical,
        "Overrides": overrides,
        "Rig": manifest.rig,
    }


def _simulated(manifest: SessionManifest) -> dict[str, bool]:
    return {
        "Simulated": manifest.simulated,
        "SimulatedParticipant": manifest.simulated_participant,
        "SimulatedRig": manifest.simulated_rig,
    }


def _sources(files: SessionFiles) -> dict[str, str]:
    """SHA-256 of what the files of a session are made from."""
    paths = {
        "manifest": files.manifest,
        "log": files.log,
        **{name: files.named(f"{name}.tsv") for name in ("hand", "presentations")},
    }
    hashes = sha256_of_paths(paths.values())
    return {name: hashes[str(path)] for name, path in paths.items() if str(path) in hashes}
