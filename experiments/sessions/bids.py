"""Sessions as BIDS shows them: answers, events and the hand, made from what a session wrote.

Everything here can be made again at any time, with the same bytes (docs/method/protocols.md#bids).
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.sessions import bids_events
from experiments.sessions.bids_people import Held, people_files, readme
from experiments.sessions.bids_tables import json_bytes, table_bytes
from experiments.sessions.data_set import DESCRIPTION_NAME, describe_data_set
from experiments.sessions.files import SessionFiles, sessions_in
from experiments.sessions.manifest import SessionManifest
from experiments.sessions.roster import Roster
from experiments.sessions.state import session_state
from experiments.sessions.traces import HAND_COLUMNS, PRESENTATION_COLUMNS
from modeling import InputError
from modeling.errors import shown
from modeling.files.answer_tables import ANSWER_TABLES
from modeling.files.documents import read_json_object
from modeling.files.reading import read_bytes
from modeling.files.tables import csv_cells
from modeling.files.writing import write_files


def export_session(data_folder: str | Path, manifest_path: str | Path) -> None:
    """Write what BIDS shows of a session, and the tables about people again.

    Parameters
    ----------
    data_folder : path
        Root of the data set.
    manifest_path : path
        The manifest of the session, below sourcedata.

    Raises
    ------
    InputError
        If it is no manifest of a session there, or manifest, log or traces cannot be read.
    OSError
        If the disk does not take the files; then all are as they were.
    """
    files = SessionFiles.of_manifest(Path(manifest_path))
    if files is None:
        raise InputError(
            f"expected the manifest of a session below {Path(data_folder) / 'sourcedata'}, got "
            f"{shown(str(manifest_path))}; give its path."
        )
    held = _held(files)
    if held.state.events:  # killed before its first event, it has nothing to show
        _write_changed(_session_files(files, held))
    _export_people(Path(data_folder), {files: held})


def export_all(data_folder: str | Path) -> tuple[str, ...]:
    """Write what BIDS shows of every session that nobody is running, where it is not there yet.

    Parameters
    ----------
    data_folder : path

    Returns
    -------
    tuple of str
        The sessions that were written, such as sub-01_ses-01_task-absolute.

    Raises
    ------
    InputError
    OSError
        As `export_session`.
    """
    root = Path(data_folder)
    written, read = [], {}
    for files in sessions_in(root):
        read[files] = held = _held(files)
        if held.state.status == "running" or not held.state.events or _is_exported(files):
            continue
        _write_changed(_session_files(files, held))
        written.append(files.stem)
    if read or (root / "participants.tsv").exists():
        _export_people(root, read)
    return tuple(written)


def _held(files: SessionFiles) -> Held:
    return Held(manifest=SessionManifest.load(files.manifest), state=session_state(files.log))


def _beh(files: SessionFiles) -> Path:
    participant, session = files.stem.split("_")[:2]
    return files.root / participant / session / "beh"


def _session_files(files: SessionFiles, held: Held) -> dict[Path, bytes]:
    """All files of a session; last the one that says that the others are there."""
    made = {
        **_answers(files, held),
        **_events(files, held),
        **_hand(files, held),
    }
    sidecar = _beh(files) / f"{files.stem}_beh.json"
    made[sidecar] = json_bytes(
        {
            **_circumstances(held),
            "DerivedFrom": _sources(files),
            "Files": {path.name: hashlib.sha256(data).hexdigest() for path, data in made.items()},
            **{c.name: c.sidecar() for c in ANSWER_TABLES[held.manifest.task]},
        }
    )
    return made


def _answers(files: SessionFiles, held: Held) -> dict[Path, bytes]:
    if held.manifest.task not in ANSWER_TABLES:
        raise InputError(
            f"expected a task of {', '.join(ANSWER_TABLES)} in {files.manifest}, got "
            f"{shown(held.manifest.task)}; update tactileq if the session is newer."
        )
    names = [column.name for column in ANSWER_TABLES[held.manifest.task]]
    return {_beh(files) / f"{files.stem}_beh.tsv": table_bytes(names, held.state.rows)}


def _events(files: SessionFiles, held: Held) -> dict[Path, bytes]:
    rows = bids_events.event_rows(held.state.events, _presentations(files))
    table = _beh(files) / f"{files.stem}_events.tsv"
    columns = {name: dict(told) for name, told in bids_events.COLUMNS.items()}
    columns["trial_type"]["Levels"] = bids_events.trial_types(rows)
    manifest = held.manifest
    sidecar = {
        "TaskName": manifest.task,
        "TaskDescription": manifest.description,
        "StimulusPresentation": {
            "SoftwareName": "tactileq",
            "SoftwareVersion": manifest.program["versions"].get("tactileq", "not stated"),
            "OperatingSystem": manifest.program["platform"],
        },
        **columns,
    }
    return {table: table_bytes(columns, rows), table.with_suffix(".json"): json_bytes(sidecar)}


def _presentations(files: SessionFiles) -> list[dict[str, str]]:
    lines = _whole_lines(files.named("presentations.tsv"))
    if not lines:
        return []
    header, *rows = (csv_cells(line, "a table", delimiter="\t") for line in lines)
    _require_columns(header, PRESENTATION_COLUMNS, files.named("presentations.tsv"))
    return [dict(zip(header, row, strict=False)) for row in rows]


def _hand(files: SessionFiles, held: Held) -> dict[Path, bytes]:
    """A file for each start of the session, whose rig has a clock of its own."""
    path = files.named("hand.tsv")
    lines = _whole_lines(path)
    if len(lines) < 2:
        return {}
    _require_columns(lines[0].split("\t"), HAND_COLUMNS, path)
    import pandas as pd  # late: takes longer to load than all else

    from experiments.sessions import bids_physio

    try:
        hand = pd.read_csv(io.StringIO("\n".join(lines)), sep="\t")
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(
            f"expected a table of readings in {path}, got something else ({error}); restore the "
            "file from a copy."
        ) from None
    onsets = bids_events.onsets_s(held.state.events)
    made: dict[Path, bytes] = {}
    for run, readings in bids_physio.by_run(hand).items():
        stem = f"{files.stem}_recording-start{run}_physio"
        start_s = bids_physio.start_onset_s(readings, held.state.events, onsets, run=run)
        made[_beh(files) / f"{stem}.json"] = json_bytes(
            {
                "SamplingFrequency": bids_physio.RATE_HZ,
                "StartTime": start_s,
                "Columns": list(bids_physio.COLUMNS),
                "TaskName": held.manifest.task,
                "PhysioType": "generic",
                **_simulated(held.manifest),
                **bids_physio.COLUMNS,
            }
        )
        regular = bids_physio.at_regular_times(readings)
        made[_beh(files) / f"{stem}.tsv.gz"] = bids_physio.physio_bytes(regular)
    return made


def _require_columns(header: Sequence[str], columns: Iterable[str], path: Path) -> None:
    if missing := [name for name in columns if name not in header]:
        raise InputError(
            f"expected the column {missing[0]} in {path}, got a table without it; restore the file "
            "from a copy, or leave a session of an earlier version out."
        )


def _whole_lines(path: Path) -> list[str]:
    """The lines of a table that a killed process may have left with half a line at its end."""
    if not path.is_file():
        return []
    text = read_bytes(path, "a table").decode("utf-8", "replace")
    return text.split("\n")[:-1]


def _circumstances(held: Held) -> dict[str, Any]:
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


def _sources(files: SessionFiles) -> dict[str, str | int]:
    """What the files of a session were made from: the hashes, and the sizes of large tables."""
    sources: dict[str, str | int] = {
        name: hashlib.sha256(read_bytes(path, "a file of a session")).hexdigest()
        for name, path in (("manifest", files.manifest), ("log", files.log))
    }
    for name in ("hand", "presentations"):
        path = files.named(f"{name}.tsv")
        sources[f"{name}_bytes"] = path.stat().st_size if path.is_file() else 0
    return sources


def _is_exported(files: SessionFiles) -> bool:
    """Whether all that BIDS shows of a session is there, made from what the session wrote."""
    sidecar = _beh(files) / f"{files.stem}_beh.json"
    try:
        stated = read_json_object(sidecar, advice="")
        named = stated["Files"].items()
        whole = all(
            hashlib.sha256((sidecar.parent / name).read_bytes()).hexdigest() == sha256
            for name, sha256 in named
        )
    except (InputError, OSError, KeyError, AttributeError):
        return False
    return whole and stated.get("DerivedFrom") == _sources(files)


def _export_people(root: Path, read: Mapping[SessionFiles, Held]) -> None:
    """The tables about people, and what stands beside them, of all sessions that are shown.

    `read` are sessions that need not be read again. Nothing of a data set that also holds people
    without source data, as one that was published.
    """
    sessions = [
        held
        for files in sessions_in(root)
        if (_beh(files) / f"{files.stem}_beh.tsv").is_file()
        and (held := read.get(files) or _held(files)).state.events
    ]
    known = {held.participant for held in sessions}
    if any(path.is_dir() and path.name not in known for path in root.glob("sub-*")):
        return
    made = people_files(root, sessions, Roster(root).subjects())
    description = root / DESCRIPTION_NAME
    if sessions and not description.is_file():
        first = min(sessions, key=lambda held: held.state.begun_utc)
        made[description] = json_bytes(describe_data_set(first.manifest))
    _write_changed(made)
    if description.is_file():
        stated = read_json_object(description, advice="restore the file")
        _write_changed({root / "README": readme(stated)})


def _write_changed(contents: Mapping[Path, bytes]) -> None:
    """Write the files that hold something else, all or none."""
    changed = {}
    for path, data in contents.items():
        with suppress(OSError):
            if path.read_bytes() == data:
                continue
        changed[path] = data
    for folder in {path.parent for path in changed}:
        folder.mkdir(parents=True, exist_ok=True)
    write_files(changed)
