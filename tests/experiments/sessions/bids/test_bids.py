"""What BIDS shows of sessions: complete, the same each time, mended, and valid."""

from __future__ import annotations

import errno
import gzip
import io
import json
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.observers.whole_study import simulate_study
from tactileq.experiments.sessions.bids.events import onsets_s
from tactileq.experiments.sessions.bids.export import (
    Exported,
    differing_tables,
    export_all,
    export_session,
    require_tables,
)
from tactileq.experiments.sessions.bids.physio import RATE_HZ, at_regular_times
from tactileq.experiments.sessions.bids.tables import cell, table_bytes
from tactileq.experiments.sessions.bids.validator import bids_issues
from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import Log, read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import held_sessions
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import InputError, simplify
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.files.columns import Column
from tactileq.rig.desk.twin import SimulatedRig
from tests.experiments.sessions.conftest import STUDY, session_on_disk
from tests.refusals import refused

PERSON = {"age": 31, "sex": "not said", "handedness": "right", "hours_of_sleep": 7.5}


def contents(folder: Path) -> dict[str, bytes]:
    """Every file but what the sessions themselves wrote."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "sourcedata" not in path.parts
    }


def table(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, sep="\t", keep_default_na=False, na_values=["n/a"])


def beh(files: SessionFiles, ending: str) -> Path:
    participant, session, _ = files.stem.split("_")
    return files.root / participant / session / "beh" / f"{files.stem}_{ending}"


@pytest.fixture(scope="module")
def whole_study(tmp_path_factory) -> Path:
    """All tasks; complete, aborted, crashed and resumed sessions of two people."""
    data = tmp_path_factory.mktemp("study") / "data"
    write_session = partial(session_on_disk, data)
    write_session(answers=PERSON)
    for session in (1, 2):
        write_session("relative", session=session)
    write_session("oddity", answered=3, status="aborted", reason='tired, "really"\tyes\n=1+1')
    write_session("threshold", answered=4, status=None)
    write_session(subject=2, answered=3, status=None, answers={**PERSON, "sex": "female"})
    write_session(subject=2, resume=True, answered=2, status="aborted")
    write_session(subject=2, resume=True, invalid=[6])
    write_session("threshold", subject=2, answered=0, status=None)
    export_all(data)
    return data


@pytest.fixture
def study_on_disk(whole_study, tmp_path) -> Path:
    """A copy of it in the folder of `write_session`."""
    return Path(shutil.copytree(whole_study, tmp_path / "data"))


@pytest.mark.parametrize("kind", [True, False])
def test_the_validator_finds_no_error(study_on_disk, write_session, tmp_path, kind):
    if not kind:
        (tmp_path / "data").rename(tmp_path / "simulated")
        people = {"simulated_participant": False, "simulated_rig": False}
        files = write_session(answers={**PERSON, "age": 99}, **people)
        write_session("relative", answered=3, status=None, pilot=False, **people)
        export_all(files.root)
    found = bids_issues(tmp_path / "data")
    assert [issue for issue in found if issue["severity"] == "error"] == []
    # What it would like to know besides, and nobody here knows.
    allowed = {"JSON_KEY_RECOMMENDED", "SIDECAR_KEY_RECOMMENDED"} | {
        "NO_AUTHORS",
        "TOO_FEW_AUTHORS",
    }
    assert {issue["code"] for issue in found} <= allowed


def test_the_validator_finds_no_error_in_a_simulated_study(tmp_path, truths, threshold):
    simplified = {
        name: simplify(truth, threshold, criterion="paper-fft").model
        for name, truth in truths.items()
    }
    plan = {"participants": 1, "schedule": "interleaved", "training_trials": 1}
    simulate_study(
        Study(
            name="Every task",
            seed=5,
            textures=tuple(truths),
            trays=dict(zip(truths, "ABC", strict=True)),
            tasks={
                "absolute": TaskPlan(**plan, anchors={"canvas": "PVC"}),
                "relative": TaskPlan(**plan, repeats=1),
                "oddity": TaskPlan(**plan, repeats=2, catch={"canvas": "PVC"}, catch_trials=2),
                "threshold": TaskPlan(**plan, repeats=1),
            },
        ),
        real=truths,
        models=ModelSets(sets={"full": truths, "simplified": simplified}),
        rig=SimulatedRig(truths, seed=1),
        data_folder=tmp_path / "data",
        seed=7,
        threshold=threshold,
    )
    assert {path.name.split("_")[2] for path in tmp_path.rglob("*_beh.tsv")} == {
        f"task-{task}" for task in ANSWER_TABLES
    }
    found = bids_issues(tmp_path / "data")
    assert [issue for issue in found if issue["severity"] == "error"] == []
    for path in tmp_path.rglob("*_events.tsv"):
        shown = table(path).query("trial_type == 'presented'")
        assert shown["presentation"].is_unique
        modelled = (shown["surface"] == "virtual") & ("threshold" not in path.name)  # tones are not
        assert shown["model_sha256"].notna().tolist() == modelled.tolist()


def test_the_validator_would_find_one(study_on_disk):
    path = next(study_on_disk.glob("sub-01/ses-01/beh/*absolute_beh.tsv"))
    path.write_bytes(path.read_bytes().replace(b"\tmain\t", b"\twarm-up\t"))
    errors = [issue["code"] for issue in bids_issues(study_on_disk) if issue["severity"] == "error"]
    assert "TSV_VALUE_INCORRECT_TYPE" in errors


def test_every_answer_stands_in_its_table(write_session):
    files = write_session(invalid=[4])
    export_session(files.root, files.manifest)
    found = table(beh(files, "beh.tsv"))
    assert list(found) == [column.name for column in ANSWER_TABLES["absolute"].columns]
    planned = json.loads(files.manifest.read_text())["trials"]
    assert found["texture"].tolist() == [trial["texture"] for trial in planned]
    assert found["virtual_texture"].tolist() == [trial["virtual_texture"] for trial in planned]
    assert found["trial"].tolist() == list(range(1, 10))
    assert found["valid"].tolist() == [1, 1, 1, 0, 1, 1, 1, 1, 1]
    assert found["frequency_similarity"].tolist() == [0.3] * 9
    assert set(found["run"]) == {1}
    sidecar = json.loads(beh(files, "beh.json").read_text())
    assert all(sidecar[name]["Description"] for name in found)
    assert (sidecar["Masking"], sidecar["Status"]) == ("pink noise", "complete")
    assert sidecar["SimulatedParticipant"] is True


def test_a_session_without_catch_trials_has_no_column_of_them(write_session):
    """As those of earlier versions, whose tables stay what their logs say, to the byte."""
    files = write_session("oddity")
    export_session(files.root, files.manifest)
    needed = [c.name for c in ANSWER_TABLES["oddity"].columns if not c.optional]
    assert list(table(beh(files, "beh.tsv"))) == needed
    assert "odd_texture" not in json.loads(beh(files, "beh.json").read_text())


def test_every_column_of_every_table_is_described(study_on_disk):
    tables = [p for p in study_on_disk.rglob("*.tsv") if "sourcedata" not in p.parts]
    assert len(tables) == 3 + 2 * 7  # participants, two of sessions; seven sessions with answers
    for path in tables:
        described = json.loads(path.with_suffix(".json").read_text())
        missing = [name for name in table(path) if not described.get(name, {}).get("Description")]
        assert missing == []
    physio = sorted(study_on_disk.rglob("*_physio.json"))
    assert len(physio) == 5 + 3
    for path in physio:
        described = json.loads(path.read_text())
        assert all(described[name]["Description"] for name in described["Columns"])


def test_exporting_again_gives_the_same_bytes(study_on_disk, tmp_path):
    before = contents(study_on_disk)
    assert export_all(study_on_disk) == Exported()
    assert contents(study_on_disk) == before
    for path in study_on_disk.glob("sub-*"):
        for file in sorted(path.rglob("*"), reverse=True):
            file.rmdir() if file.is_dir() else file.unlink()
    for name in ("participants.tsv", "participants.json", "README", "dataset_description.json"):
        (study_on_disk / name).unlink()
    made = export_all(study_on_disk)
    assert (made.changed, made.damaged) == ((), ())
    assert {str(path.relative_to(study_on_disk)) for path in made.new} == before.keys()
    again = contents(study_on_disk)
    assert again.keys() == before.keys()
    changed = [name for name in before if before[name] != again[name]]
    assert changed in ([], ["dataset_description.json"])
    name = "dataset_description.json"
    assert json.loads(again[name]) == json.loads(before[name])


def _gone(path: Path) -> None:
    path.unlink()


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _empty(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("spoil", [_gone, _cut, _empty])
@pytest.mark.parametrize(
    "ending", ["beh.tsv", "beh.json", "events.tsv", "recording-start1_physio.tsv.gz"]
)
def test_a_half_exported_session_is_mended(write_session, spoil, ending):
    files = write_session()
    export_all(files.root)
    before = contents(files.root)
    path = beh(files, ending)
    spoil(path)
    spoilt = contents(files.root)
    with refused(InputError, got=[path, "tactileq study status", files.root]):
        require_tables(files.root, otherwise="")
    require_tables(files.root, subject=2, otherwise="")
    assert differing(files.root) == [path]
    assert contents(files.root) == spoilt  # who only reads changes nothing
    made = export_all(files.root)
    assert (made.new, made.changed) == (((path,), ()) if spoil is _gone else ((), (path,)))
    assert contents(files.root) == before
    require_tables(files.root, otherwise="")


def test_what_was_answered_since_is_added(write_session):
    files = write_session(answered=3, status="aborted")
    export_all(files.root)
    assert len(table(beh(files, "beh.tsv"))) == 3
    write_session(resume=True)
    with refused(InputError, got=["more", files.root]):
        require_tables(files.root, otherwise="")
    assert files.root / "sub-01/sub-01_sessions.tsv" in differing(files.root)
    assert beh(files, "beh.tsv") in export_all(files.root).changed
    found = table(beh(files, "beh.tsv"))
    assert found["run"].tolist() == [1, 1, 1, 2, 2, 2, 2, 2, 2]
    sessions = table(files.root / "sub-01" / "sub-01_sessions.tsv")
    assert sessions["absolute"].tolist() == ["complete"]
    names = {path.name for path in beh(files, "beh.tsv").parent.iterdir()}
    assert {f"{files.stem}_recording-start{run}_physio.tsv.gz" for run in (1, 2)} <= names


def test_a_running_session_is_left_alone(write_session):
    files = write_session(answered=3, status="aborted")
    with SessionStore.resume(files.root, SessionManifest.load(files.manifest)):
        assert differing(files.root) == []
        assert export_all(files.root).damaged == ()
        assert not beh(files, "beh.tsv").exists()
    assert beh(files, "beh.tsv") in export_all(files.root).new
    with SessionStore.resume(files.root, SessionManifest.load(files.manifest)):
        assert differing(files.root) == []  # those of before say how it stood then


def test_a_full_disk_leaves_the_files_as_they_were(write_session, file_size_limit):
    files = write_session(answered=3, status="aborted")
    export_all(files.root)
    before = contents(files.root)
    write_session(resume=True)
    with file_size_limit(1000), pytest.raises(OSError) as failed:  # noqa: PT011 - its number
        export_session(files.root, files.manifest)
    assert failed.value.errno == errno.EFBIG
    assert contents(files.root) == before
    assert not list(files.root.rglob("*.unfinished"))


def test_events_tell_what_happened_in_order(write_session):
    files = write_session(answered=3, status="aborted", reason='He said "no", so')
    write_session(resume=True)
    export_session(files.root, files.manifest)
    events = table(beh(files, "events.tsv"))
    assert events["onset"].is_monotonic_increasing
    assert events["onset"].iloc[0] < 0.1
    log = [json.loads(line) for line in files.log.read_text().splitlines()]
    assert sorted(events["trial_type"]) == sorted(event["event"] for event in log)
    ended = events[events["trial_type"] == "ended"]
    assert ended["status"].tolist() == ["aborted", "complete"]
    assert ended["told"].iloc[0] == 'He said "no", so'
    shown = events[events["trial_type"] == "presented"]
    assert len(shown) == 2 * 9
    assert shown["duration"].between(0.3, 0.7).all()
    assert shown["presentation"].tolist() == [float(n) for n in range(1, 19)]
    assert shown[shown["surface"] == "virtual"]["button"].tolist() == [1.0] * 9
    assert set(shown["limited_peak"]) == {0.0}
    levels = json.loads(beh(files, "events.json").read_text())["trial_type"]["Levels"]
    assert set(levels) == set(events["trial_type"])


@pytest.mark.parametrize("name", ["hand", "presentations"])
def test_a_damaged_row_costs_itself_and_is_named(write_session, name):
    files = write_session()
    export_all(files.root)
    path = files.named(f"{name}.tsv")
    lines = path.read_bytes().split(b"\n")
    lines[4], lines[7] = lines[4].replace(b"\t", b" "), b"9" + lines[7]  # a run that never was
    path.write_bytes(b"\n".join(lines))
    made = export_all(files.root)
    assert made.damaged == (f"{files.stem}: line 5 and 1 more line of {path.name}",)
    sidecar = json.loads(beh(files, "beh.json").read_text())
    assert sidecar["Damaged"] == {name: [f"line 5 and 1 more line of {path.name}"]}
    assert len(table(beh(files, "beh.tsv"))) == 9
    shown = table(beh(files, "events.tsv")).query("trial_type == 'presented'")
    assert shown["presentation"].isna().sum() == (2 if name == "presentations" else 0)
    assert export_all(files.root) == Exported(damaged=made.damaged)
    assert differing(files.root) == []


def test_a_table_of_an_earlier_version_is_named_and_costs_what_follows_from_it(write_session):
    files = write_session()
    for name in ("hand", "presentations"):
        path = files.named(f"{name}.tsv")
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(line.split("\t", 1)[1] for line in lines))
    made = export_all(files.root)
    assert [told.split(",")[0] for told in made.damaged] == [
        f"{files.stem}: line 1 of {files.stem}_{name}.tsv" for name in ("presentations", "hand")
    ]
    assert len(table(beh(files, "beh.tsv"))) == 9
    assert not list(files.beh.glob("*_physio.tsv.gz"))


def test_a_time_that_cannot_be_asks_for_no_memory(write_session):
    files = write_session(answered=3, status="aborted")
    path = files.named("hand.tsv")
    lines = path.read_bytes().splitlines(keepends=True)
    cells = lines[9].split(b"\t")
    lines[9] = b"\t".join([*cells[:3], b"3.2e+14", *cells[4:]])  # 291 TiB at 250 Hz
    path.write_bytes(b"".join(lines))
    (told,) = export_all(files.root).damaged
    assert told.startswith(f"{files.stem}: line 10, 3.2e+14 s after")
    assert len(table(beh(files, "beh.tsv"))) == 3


def test_a_run_begins_when_its_date_says_and_never_before_the_last_one():
    def event(run: int, t_s: float, utc: str) -> dict[str, object]:
        return {"run": run, "t_s": t_s, "utc": f"2026-11-22T{utc}Z", "event": "x"}

    events = [
        event(1, 0.25, "09:00:00.000"),
        event(1, 10.25, "09:00:59.000"),  # its clock was set: the monotonic one counts
        event(2, 0.5, "09:30:00.000"),
        event(2, 1.5, "09:30:01.000"),
        event(3, 0.0, "08:00:00.000"),  # set back by hours
    ]
    assert onsets_s(events) == [0.0, 10.0, 1800.0, 1801.0, 1801.0]


def test_the_hand_is_the_same_signal_at_a_regular_rate(write_session):
    files = write_session()
    export_session(files.root, files.manifest)
    path = beh(files, "recording-start1_physio.tsv.gz")
    told = json.loads(beh(files, "recording-start1_physio.json").read_text())
    found = pd.read_csv(
        io.BytesIO(gzip.decompress(path.read_bytes())), sep="\t", names=told["Columns"]
    )
    assert path.read_bytes()[4:8] == bytes(4)  # no time of compression
    first_s = table(files.named("hand.tsv"))["time_s"].iloc[0]
    time_s = first_s + np.arange(len(found)) / told["SamplingFrequency"]
    known = found["trial"].notna()
    # Half a second of strokes and nine and a half of nothing in every ten.
    assert 0.05 < known.mean() < 0.15
    speed = found["speed_mm_s"][known]
    # Between readings 5 ms apart a sine of 1 Hz bends by 100 (2π)² (5 ms)² / 8 at most.
    np.testing.assert_allclose(speed, 100 * np.sin(2 * np.pi * time_s[known]), atol=0.0125)
    virtual = found["surface"] == 2
    assert found["force_n"][virtual].notna().all()
    assert (found["surface"][known & ~virtual] == 1).all()
    assert set(found["trial"].dropna()) == set(range(1, 10))
    shown = table(beh(files, "events.tsv")).query("trial_type == 'presented'")
    onset = told["StartTime"] + np.flatnonzero(found["presentation"] == 1)[0] / RATE_HZ
    assert abs(onset - shown["onset"].iloc[0]) < 1 / RATE_HZ


def test_nothing_is_made_up_in_a_gap_or_beside_what_is_missing():
    hand = pd.DataFrame(
        {
            "trial": [1, 1, 1, 1, 2],
            "presentation": [1, 1, 1, 1, 2],
            "time_s": [1.0, 1.004, 1.010, 1.050, 1.052],
            "speed_mm_s": [0.0, 4.0, 10.0, 50.0, 7.0],
            "force_n": [1.0, np.nan, 1.0, 1.0, 1.0],
            "surface": ["real", "real", "virtual", "virtual", "none"],
            "force_assumed": [0, 0, 0, 1, 0],
        }
    )
    found = at_regular_times(hand)
    assert len(found) == 14  # 52 ms at 250 Hz
    assert found["speed_mm_s"][:3].tolist() == [0.0, 4.0, 8.0]
    assert found["speed_mm_s"][3:12].isna().all()  # 40 ms without a reading
    assert found["trial"][3:12].isna().all()
    assert found["speed_mm_s"][13] == 7.0
    assert found["force_n"][:3].isna().tolist() == [False, True, True]
    assert found["surface"].dropna().tolist() == [1, 1, 1, 0]


@given(st.lists(st.text(), min_size=1, max_size=5))
def test_text_survives_the_table(values):
    data = table_bytes(
        [Column("number"), Column("note")], [{"number": 1, "note": text} for text in values]
    )
    found = pd.read_csv(io.BytesIO(data), sep="\t", keep_default_na=False, dtype=str)
    # Tabs, line ends and other control characters, which no cell of BIDS can hold, are pictured.
    pictured = {n: 0x2400 + n for n in range(32)} | {127: 0x2421}
    expected = [text.translate(pictured) or "n/a" for text in values]
    assert found["note"].tolist() == expected
    assert data.count(b"\n") == len(values) + 1


def test_what_stands_in_a_cell():
    values = [True, None, "", float("nan"), 0.1 + 0.2, 7, 'a "b"', "=1+1", "a,b", "和紙", "\ud800"]
    told = ["true", "n/a", "n/a", "n/a", "0.3", "7", '"a ""b"""', "=1+1", "a,b", "和紙", "\\ud800"]
    assert [cell(value) for value in values] == told


def test_people_and_their_sessions_are_listed(study_on_disk):
    people = table(study_on_disk / "participants.tsv")
    assert people["participant_id"].tolist() == ["sub-01", "sub-02"]
    assert people["age"].tolist() == [31, 31]
    assert people["sex"].tolist() == ["not said", "female"]
    assert people["hours_of_sleep"].tolist() == [7.5, 7.5]
    assert people["slot"].tolist() == [1, 2]
    assert people["consent_version"].tolist() == ["2026-11"] * 2
    assert "SIM-" not in (study_on_disk / "participants.tsv").read_text()  # no pseudonyms
    sessions = table(study_on_disk / "sub-01" / "sub-01_sessions.tsv")
    assert sessions["session_id"].tolist() == ["ses-01", "ses-02"]
    assert sessions["day"].tolist() == [0, 0]
    assert sessions["oddity"].tolist()[0] == "aborted"
    assert sessions["threshold"].tolist()[0] == "crashed"
    other = table(study_on_disk / "sub-02" / "sub-02_sessions.tsv")
    assert other["absolute"].tolist() == ["complete"]


def test_a_data_set_without_source_data_is_left_alone(study_on_disk):
    shutil.rmtree(study_on_disk / "sourcedata")
    before = contents(study_on_disk)
    assert differing(study_on_disk) == []
    assert export_all(study_on_disk) == Exported()
    assert contents(study_on_disk) == before


def test_a_folder_of_somebodys_does_not_stop_the_tables_about_people(study_on_disk):
    table = study_on_disk / "participants.tsv"
    before = table.read_bytes()
    shutil.copytree(study_on_disk / "sub-01", study_on_disk / "sub-01_copy")
    (study_on_disk / "sub-99").mkdir()
    table.write_bytes(before[: before.rindex(b"\n", 0, -1) + 1])
    assert differing(study_on_disk) == [table]
    export_all(study_on_disk)
    assert table.read_bytes() == before


def test_what_is_no_manifest_is_refused(tmp_path, write_session):
    files = write_session()
    for path in (files.log, tmp_path / "nothing_manifest.json"):
        with refused(InputError, expected=["manifest", files.root / "sourcedata"], got=path):
            export_session(files.root, path)


def test_levels_are_stored_untranslated_and_described_in_english(write_session) -> None:
    asked = {
        "name": "craft",
        "levels": ["一", "二"],
        "text": {"ja": "手仕事は?", "en": "Any craft?"},
        "levels_text": {"en": ["None", "Some"]},
    }
    study = {**STUDY, "questions": [asked]}
    files = write_session(answers={"craft": "二"}, study=study, language="en")
    export_all(files.root)
    people = pd.read_csv(files.root / "participants.tsv", sep="\t")
    assert people["craft"].tolist() == ["二"]
    described = json.loads((files.root / "participants.json").read_text(encoding="utf-8"))
    assert described["craft"]["Levels"] == {"一": "None", "二": "Some"}
    assert described["craft"]["Description"] == "Any craft?"


def test_who_left_questions_unanswered_has_a_level_or_no_number_and_the_sidecar_says_so(
    write_session: Callable[..., SessionFiles],
) -> None:
    root = write_session(answers=PERSON).root
    export_all(root)
    answered = json.loads((root / "participants.json").read_text(encoding="utf-8"))
    unsaid = dict.fromkeys(PERSON, "not said")
    files = write_session(subject=2, answers=unsaid)
    export_session(root, files.manifest)
    # Whose session comes later answers all: what is said of the others stays.
    files = write_session(subject=3, answers=PERSON)
    export_session(root, files.manifest)
    assert export_all(root) == Exported()
    people = pd.read_csv(root / "participants.tsv", sep="\t")
    assert people["age"].tolist()[0] == 31
    for number in ("age", "hours_of_sleep"):
        assert pd.api.types.is_numeric_dtype(people[number])
        assert people[number].isna().tolist() == [False, True, False]
    for choice in ("sex", "handedness"):
        assert people[choice].tolist() == [PERSON[choice], "not said", PERSON[choice]]
    described = json.loads((root / "participants.json").read_text(encoding="utf-8"))
    assert described["sex"] == answered["sex"]  # of its own levels one says so
    assert set(described["handedness"]["Levels"]) == {*answered["handedness"]["Levels"], "not said"}
    assert "n/a" in described["age"]["Description"]
    assert "n/a" not in answered["age"]["Description"]  # as before, where everybody answered


def test_a_damaged_session_keeps_what_is_shown_of_it_and_costs_nobody_else_anything(
    study_on_disk, write_session
):
    (log,) = study_on_disk.glob("sourcedata/sub-01/ses-01/*_task-absolute_log.jsonl")
    log.write_bytes(log.read_bytes().replace(b'"trial": 4', b'"trial": "4"'))
    before = contents(study_on_disk)
    (told,) = export_all(study_on_disk).damaged
    assert f"of {log}, got trial = '4'; restore" in told
    assert contents(study_on_disk) == before
    write_session("relative", subject=2)
    assert beh_of(study_on_disk, "sub-02", "relative") in export_all(study_on_disk).new
    after = contents(study_on_disk)
    assert {name: after[name] for name in before if "sub-02_sessions" not in name} == {
        name: data for name, data in before.items() if "sub-02_sessions" not in name
    }
    for named in ({}, {"task": "absolute"}, {"subject": 1}):
        with refused(InputError, names="leave sub-01 out"):
            require_tables(study_on_disk, **named, otherwise="leave {who} out")
    for others in ({"task": "threshold"}, {"subject": 2}):
        require_tables(study_on_disk, **others, otherwise="")


def differing(root: Path) -> list[Path]:
    return differing_tables(root, *held_sessions(root))[0]


def beh_of(root: Path, participant: str, task: str) -> Path:
    return root / participant / "ses-01/beh" / f"{participant}_ses-01_task-{task}_beh.tsv"


def test_a_table_without_source_beside_others_with_it_is_left_alone(study_on_disk):
    """As in data that were given to others without a part."""
    for path in study_on_disk.glob("sourcedata/sub-01/ses-02/*"):
        path.unlink()
    before = contents(study_on_disk)
    assert differing(study_on_disk) == []
    assert export_all(study_on_disk) == Exported()
    assert contents(study_on_disk) == before


def test_after_a_session_only_its_participants_logs_are_read(
    write_session: Callable[..., SessionFiles], monkeypatch: pytest.MonkeyPatch
) -> None:
    """So an export takes no longer the more people have taken part."""
    for subject in (1, 2, 3):
        files = write_session(subject=subject)
        export_session(files.root, files.manifest)
    second = write_session("relative", subject=2)
    read: list[str] = []

    def noted(path: Path) -> Log:
        read.append(Path(path).name[:6])
        return read_log(path)

    monkeypatch.setattr("tactileq.experiments.sessions.kept.state.read_log", noted)
    export_session(second.root, second.manifest)
    assert set(read) == {"sub-02"}
    monkeypatch.undo()
    assert export_all(second.root) == Exported()  # nothing is left to be made
