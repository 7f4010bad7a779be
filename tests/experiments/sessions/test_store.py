"""The store: nothing answered is lost, nothing is overwritten, no value breaks a table."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.sessions.store import SessionStore, StoreError, cell
from experiments.study.design import SessionPlan
from experiments.study.study import Study
from experiments.tasks import plan_session
from modeling import InputError

ROOT = Path(__file__).parents[3]
COLUMNS = {"trial": {"Description": "number"}, "note": {"Description": "anything"}}
MODELS = {"canvas": {"full": "0a", "simplified": "1b"}}
FileSizeLimit = Callable[[int], AbstractContextManager[None]]
Rows = Callable[[Path], list[dict[str, str]]]


def create(
    folder: Path,
    plan: SessionPlan,
    *,
    simulated: bool = True,
    rig: bool | None = None,
    models: Mapping[str, Mapping[str, str]] | None = None,
) -> SessionStore:
    """A session whose participant and (unless told otherwise) rig are simulated or not."""
    return SessionStore.create(
        folder,
        plan=plan,
        columns=COLUMNS,
        description="a test",
        models=MODELS if models is None else models,
        simulated_participant=simulated,
        simulated_rig=simulated if rig is None else rig,
    )


def plan_of(study: Study, *, subject: int = 1, task: str = "absolute") -> SessionPlan:
    return plan_session(study, task=task, subject=subject, session=1)


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_after_sigkill_every_answered_trial_is_on_disk(tmp_path: Path, rows: Rows) -> None:
    script = Path(__file__).with_name("killed_session.py")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [sys.executable, str(script), str(tmp_path)], env=environment, timeout=60, check=False
    )
    assert ended.returncode == -signal.SIGKILL
    beh = tmp_path / "sub-01" / "ses-01" / "beh" / "sub-01_ses-01_task-absolute_beh.tsv"
    source = tmp_path / "sourcedata" / "sub-01" / "ses-01"
    answers = rows(beh)
    order = json.loads((source / "sub-01_ses-01_task-absolute_order.json").read_text())
    assert [row["magnitude_similarity"] for row in answers] == ["10", "20", "30"]
    assert [row["texture"] for row in answers] == [t["texture"] for t in order["trials"][:3]]
    log = rows(source / "sub-01_ses-01_task-absolute_log.tsv")
    assert log[-1]["event"] == "surfaces presented"
    assert "trial 4" in log[-1]["detail"]
    shown = rows(source / "sub-01_ses-01_task-absolute_presentations.tsv")
    assert {row["trial"] for row in shown} == {"1", "2", "3"}


def test_a_session_is_made_once_whoever_asks_at_the_same_time(tmp_path: Path, study: Study) -> None:
    create(tmp_path, plan_of(study, subject=2)).close()

    def attempt(_: int) -> str:
        try:
            with create(tmp_path, plan_of(study)) as store:
                store.append({"trial": 1, "note": "kept"})
        except InputError as refusal:
            return str(refusal)
        return "made"

    with ThreadPoolExecutor(8) as pool:
        outcomes = list(pool.map(attempt, range(16)))
    assert outcomes.count("made") == 1
    refusals = {outcome for outcome in outcomes if outcome != "made"}
    assert all("expected a session that has not been run" in refusal for refusal in refusals)
    path = tmp_path / "sub-01" / "ses-01" / "beh" / "sub-01_ses-01_task-absolute_beh.tsv"
    assert path.read_text() == "trial\tnote\n1\tkept\n"


def test_a_refused_session_changes_nothing(tmp_path: Path, study: Study) -> None:
    with create(tmp_path, plan_of(study)) as store:
        store.append({"trial": 1, "note": "kept"})
        before = contents(tmp_path)
        with pytest.raises(InputError, match="choose another session"):
            create(tmp_path, plan_of(study))
        assert contents(tmp_path) == before


def test_a_leftover_file_is_not_overwritten(tmp_path: Path, study: Study) -> None:
    beh = tmp_path / "sub-01" / "ses-01" / "beh"
    beh.mkdir(parents=True)
    leftover = beh / "sub-01_ses-01_task-absolute_beh.tsv"
    leftover.write_text("precious")
    with pytest.raises(InputError, match="expected a session that has not been run"):
        create(tmp_path, plan_of(study))
    assert leftover.read_text() == "precious"
    assert not list(tmp_path.rglob("*_order.json"))


def test_the_order_is_whole_before_the_first_trial(tmp_path: Path, study: Study) -> None:
    plan = plan_of(study, task="relative")
    with create(tmp_path, plan):
        (path,) = tmp_path.rglob("*_order.json")
        stored = json.loads(path.read_text(encoding="utf-8"))
    remade = plan_session(
        Study.from_dict(stored["study"]),
        task=stored["task"],
        subject=stored["subject"],
        session=stored["session"],
    )
    assert remade == plan
    assert stored["trials"] == json.loads(json.dumps(plan.to_dict()))["trials"]


def test_sessions_in_turn_share_one_data_set(tmp_path: Path, study: Study, rows: Rows) -> None:
    for subject, task in [(1, "absolute"), (1, "relative"), (3, "relative"), (2, "absolute")]:
        create(tmp_path, plan_of(study, subject=subject, task=task)).close()
    participants = rows(tmp_path / "participants.tsv")
    assert [row["participant_id"] for row in participants] == ["sub-01", "sub-03", "sub-02"]
    assert {row["simulated"] for row in participants} == {"true"}
    description = json.loads((tmp_path / "dataset_description.json").read_text())
    assert description["Name"] == study.name
    assert description["Simulated"] is True
    assert description["BIDSVersion"] == "1.10.0"
    assert description["DatasetType"] == "raw"


def test_simulated_and_real_sessions_never_share_a_folder(tmp_path: Path, study: Study) -> None:
    create(tmp_path, plan_of(study), simulated=False).close()
    before = contents(tmp_path)
    with pytest.raises(InputError, match="Simulated True"):
        create(tmp_path, plan_of(study, subject=2), simulated=True)
    with pytest.raises(InputError, match="Name 'Another'"):
        create(tmp_path, plan_of(replace(study, name="Another"), subject=2), simulated=False)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("participant", [True, False])
@pytest.mark.parametrize("rig", [True, False])
def test_it_is_told_what_was_simulated(
    tmp_path: Path, study: Study, rows: Rows, participant: bool, rig: bool
) -> None:
    create(tmp_path, plan_of(study), simulated=participant, rig=rig).close()
    (sidecar,) = tmp_path.rglob("*_beh.json")
    for path in (sidecar, tmp_path / "dataset_description.json"):
        told = json.loads(path.read_text())
        assert told["Simulated"] is (participant or rig)
        assert told["SimulatedParticipant"] is participant
        assert told["SimulatedRig"] is rig
    listed = rows(tmp_path / "participants.tsv")
    assert [row["simulated"] for row in listed] == [str(participant).lower()]
    with pytest.raises(InputError, match="choose another data folder"):
        create(tmp_path, plan_of(study, subject=2), simulated=not participant, rig=rig)


def test_the_sidecar_tells_the_circumstances(tmp_path: Path, study: Study) -> None:
    told = replace(study, masking="pink noise", surface_visible="hidden")
    create(tmp_path, plan_of(told)).close()
    (path,) = (tmp_path / "sub-01").rglob("*_beh.json")
    sidecar = json.loads(path.read_text())
    assert sidecar["TaskName"] == "absolute"
    assert sidecar["StudyName"] == study.name
    assert (sidecar["Masking"], sidecar["SurfaceVisible"]) == ("pink noise", "hidden")
    assert sidecar["Schedule"] == "interleaved"
    assert sidecar["note"]["Description"] == "anything"


@given(st.text())
def test_no_text_breaks_a_row(value: str) -> None:
    written = cell(value)
    assert written
    assert len(written.splitlines()) == 1
    assert not set(written) & set('\t\r\n"')
    written.encode("utf-8")


def test_a_table_with_hostile_values_reads_back(tmp_path: Path, study: Study) -> None:
    hostile = ['"unbalanced', "tab\there", "line\nend\r\n", "back\\slash", "", "\ud800", "ünï"]
    with create(tmp_path, plan_of(study)) as store:
        for number, value in enumerate(hostile, start=1):
            store.append({"trial": number, "note": value})
    table = pd.read_csv(store.path, sep="\t", keep_default_na=False)
    assert table["trial"].tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert table["note"].tolist() == [
        "\\x22unbalanced",
        "tab\\there",
        "line\\nend\\r\\n",
        "back\\\\slash",
        "n/a",
        "\\ud800",
        "ünï",
    ]


def test_numbers_and_nothing_in_a_cell() -> None:
    assert [cell(v) for v in (True, False, 3, 2.5, None, float("nan"), 0.1 + 0.2)] == [
        *("true", "false", "3", "2.5", "n/a", "n/a", "0.3"),
    ]
    with pytest.raises(InputError, match="finite"):
        cell(float("inf"))


def test_a_row_with_other_columns_is_refused(tmp_path: Path, study: Study) -> None:
    with create(tmp_path, plan_of(study)) as store, pytest.raises(InputError, match="columns"):
        store.append({"trial": 1})


def test_a_refused_write_leaves_whole_rows_and_one_sentence(
    tmp_path: Path, study: Study, file_size_limit: FileSizeLimit
) -> None:
    with create(tmp_path, plan_of(study)) as store:
        store.append({"trial": 1, "note": "kept"})
        before = store.path.read_bytes()
        refused = None
        with file_size_limit(len(before) + 5):
            try:
                store.append({"trial": 2, "note": "too long for the disk"})
            except StoreError as error:
                refused = str(error)
        assert store.path.read_bytes() == before
        assert refused is not None
        assert "rows before it are safe" in refused
        assert "\n" not in refused
        store.append({"trial": 2, "note": "there is room again"})
    assert store.path.read_text().endswith("1\tkept\n2\tthere is room again\n")


def test_a_folder_that_is_a_file_is_told_in_one_sentence(tmp_path: Path, study: Study) -> None:
    (tmp_path / "data").write_text("a file")
    with pytest.raises(StoreError, match="Nothing was presented"):
        create(tmp_path / "data", plan_of(study))
    assert (tmp_path / "data").read_text() == "a file"


def test_a_changed_study_needs_another_data_folder(tmp_path: Path, study: Study) -> None:
    create(tmp_path, plan_of(study)).close()
    changed = replace(study, seed=study.seed + 1)
    with pytest.raises(InputError, match=r"another seed.*choose another data folder"):
        create(tmp_path, plan_of(changed, subject=2))
    assert not list(tmp_path.rglob("sub-02*"))
