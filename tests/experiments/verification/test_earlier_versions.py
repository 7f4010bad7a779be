"""Data of earlier versions: resumed, verified, exported, read; tampering with them is found."""

from __future__ import annotations

import json
import runpy
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tactileq.commands.results.analyze import read_answers
from tactileq.experiments.sessions.bids.earlier import is_earlier
from tactileq.experiments.sessions.bids.export import export_all, require_tables
from tactileq.experiments.sessions.bids.session import session_files
from tactileq.experiments.sessions.bids.tables import json_bytes
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import held_sessions
from tactileq.experiments.sessions.store.withdrawing import withdraw
from tactileq.experiments.study.models import load_model_sets
from tactileq.experiments.study.study import Study
from tactileq.experiments.verification.verifying import verify_data
from tests.experiments.verification.small_studies import Person, run_one
from tests.experiments.verification.tampering import (
    FIRST,
    SHOWN,
    STORED,
    edit_json,
    hash_anew,
    lines,
    sha256,
    source,
    table,
    write,
)

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "tests" / "data" / "earlier_versions"
VERSIONS = sorted(path.parent.name for path in FOLDER.glob("*/data"))
UNSEALED = ("9e8d67df", "e91fb878")
KILLED = "sub-02_ses-01_task-absolute"


@pytest.fixture
def root(version: str, tmp_path: Path) -> Path:
    """A copy of what a version left."""
    return Path(shutil.copytree(FOLDER / version / "data", tmp_path / "data"))


def resume(root: Path) -> None:
    study = Study.load(FOLDER / "study.toml")
    models = load_model_sets(study, FOLDER)
    result, _ = run_one(
        root, study, models, subject=2, respondent=Person(2), resume=True, sources=study.models
    )
    assert result.completed


@pytest.mark.parametrize("version", VERSIONS)
def test_a_session_that_an_earlier_version_began_is_resumed_to_its_end(root: Path) -> None:
    before = lines(source(root, KILLED, "log.jsonl"))
    resume(root)
    after = lines(source(root, KILLED, "log.jsonl"))
    assert after[: len(before)] == before
    found = verify_data(root)
    assert (found.differences, len(found.sessions)) == ((), 4)
    assert export_all(root).damaged == ()
    found = verify_data(root)
    assert (found.differences, found.earlier) == ((), ())
    stored = SessionManifest.load(source(root, KILLED, "manifest.json"))
    main = [trial["trial"] for trial in stored.trials if trial["phase"] == "main"]
    answers = read_answers({"": root}, ()).answers["absolute"]
    own = answers[answers["participant_id"] == "sub-02"]
    assert sorted(own["trial"]) == sorted(main)
    withdraw(root, 2)
    assert verify_data(root).differences == ()


@pytest.mark.parametrize("version", VERSIONS)
def test_nothing_differs_in_an_untouched_study_of_an_earlier_version(root: Path) -> None:
    found = verify_data(root).without(["sub-02"])
    assert found.differences == ()
    require_tables(root, subject=1, otherwise="")
    shown = {path: path.read_bytes() for path in root.glob("sub-01/**/*.tsv*")}
    assert len(shown) == 8
    export_all(root)
    assert verify_data(root).earlier == ()
    assert {path: path.read_bytes() for path in shown} == shown


@pytest.mark.parametrize("version", UNSEALED)
def test_what_an_earlier_version_made_is_named_apart_from_differences(root: Path) -> None:
    found = verify_data(root)
    assert {d.participant for d in found.differences} == {"sub-02"}  # whose tables nobody made yet
    assert table(root, FIRST, "beh.json").relative_to(root).as_posix() in found.earlier
    assert "README" in found.earlier
    assert {Path(place).suffix for place in found.earlier} == {".json", ""}
    assert found.without(["sub-01"]).earlier == ("participants.json", "README")
    assert found.without(["sub-02"]).earlier == found.earlier


@pytest.mark.parametrize("version", VERSIONS[:1])
def test_the_hand_that_is_not_made_again_is_described_anew(root: Path) -> None:
    """Its table takes longest to make, and is taken as it is there where its sources are."""
    export_all(root)
    sidecar = table(root, FIRST, "recording-start1_physio.json")
    whole = sidecar.read_bytes()
    words = "What was presented at the last reading"
    edit_json(sidecar, lambda values: values["surface"].update(Description=words))
    hash_anew(root, FIRST)
    found = verify_data(root)
    assert (found.differences, len(found.earlier)) == ((), 2)
    export_all(root)
    assert sidecar.read_bytes() == whole
    assert verify_data(root).earlier == ()


@pytest.mark.parametrize("version", VERSIONS)
def test_every_text_of_an_earlier_version_is_known(version: str) -> None:
    earlier = json.loads((FOLDER / version / "texts.json").read_text(encoding="utf-8"))
    before = {place: text for place, text in _leaves(earlier)}
    known = json.loads((ROOT / "experiments/sessions/bids/earlier_texts.json").read_text("utf-8"))
    now = dict(_leaves(runpy.run_path(str(ROOT / "tools/earlier_version.py"))["texts"]()))
    unknown = {
        before[place]
        for place in before.keys() & now
        if before[place] != now[place] and before[place] not in known.get(now[place], ())
    }
    assert unknown == set()


def _leaves(
    values: Any, place: tuple[object, ...] = ()
) -> Iterator[tuple[tuple[object, ...], Any]]:
    """Every value in nested ones, with the keys that lead to it."""
    if isinstance(values, dict | list):
        for key, value in values.items() if isinstance(values, dict) else enumerate(values):
            yield from _leaves(value, (*place, key))
    else:
        yield place, values


# What is tampered with does not hide behind the words of an earlier version.


@pytest.mark.parametrize("version", UNSEALED[:1])
def test_no_changed_value_of_a_sidecar_passes_for_an_earlier_version(root: Path) -> None:
    held, _ = held_sessions(root)
    made = {p: d for one in held[:3] for p, d in session_files(one, anew=True)[0].items()}
    sidecars = [path for path in made if path.suffix == ".json"]
    assert all(is_earlier(path, made[path]) for path in sidecars)
    for path in sidecars:
        whole = path.read_bytes()
        for changed in _with_one_changed(json.loads(whole)):
            path.write_bytes(json_bytes(changed))
            assert not is_earlier(path, made[path]), changed
        path.write_bytes(whole.replace(b"{\n", b'{\n  "Simulated": false,\n', 1))  # a key twice
        assert not is_earlier(path, made[path])
        path.write_bytes(whole)
    for path in made.keys() - set(sidecars):
        path.write_bytes(path.read_bytes() + b"\n")
        assert not is_earlier(path, made[path])


def _with_one_changed(values: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The values with each one in turn changed, and with each one left out."""
    for place, value in list(_leaves(values)):
        for leave_out in (False, True):
            changed = json.loads(json.dumps(values))
            *way, last = place
            within = changed
            for key in way:
                within = within[key]
            if leave_out:
                del within[last]
            else:
                within[last] = (not value) if isinstance(value, bool) else f"{value}0"
            yield changed


# Kinds of `STORED` that change the forced choice or a seal, which these data do not have.
NOT_THERE = (
    "log_choices_and_buttons",
    "log_choices_all_right",
    "log_answer_invalid_by_a_fault",
    "session_deleted_that_was_last",
)
OF_SESSIONS = ("log_", "manifest_", "session_", "hand_", "presentations_")


@pytest.fixture(scope="module")
def resumed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data that an earlier version made most of, of two people."""
    root = tmp_path_factory.mktemp("resumed") / "data"
    shutil.copytree(FOLDER / UNSEALED[0] / "data", root)
    resume(root)
    found = verify_data(root)
    assert found.differences == ()
    assert found.earlier
    return root


@pytest.mark.parametrize(
    "kind", [*SHOWN, *(k for k in STORED if k.startswith(OF_SESSIONS) and k not in NOT_THERE)]
)
def test_tampering_with_data_of_an_earlier_version_is_found(
    kind: str, resumed: Path, tmp_path: Path
) -> None:
    root = Path(shutil.copytree(resumed, tmp_path / "data"))
    {**STORED, **SHOWN}[kind](root)
    assert verify_data(root).differences


@pytest.mark.parametrize("version", UNSEALED)
def test_an_order_that_no_version_drew_is_found(root: Path) -> None:
    """The buttons of the odd one are changed, so that all answers are right."""
    stem = "sub-01_ses-01_task-oddity"

    def change(values: dict[str, Any]) -> None:
        for trial in values["trials"]:
            same = next(name for name in trial["layout"] if name != trial["model"])
            trial.update(odd_position=3, layout=[same, same, trial["model"]])

    edit_json(source(root, stem, "manifest.json"), change)
    manifest = SessionManifest.load(source(root, stem, "manifest.json"))
    events = lines(source(root, stem, "log.jsonl"))
    events[0]["manifest_sha256"] = sha256(source(root, stem, "manifest.json"))
    planned = {trial["trial"]: trial for trial in manifest.trials}
    for event in events:
        if event["event"] == "answer":
            layout = "|".join(planned[event["trial"]]["layout"])
            event["row"].update(odd_position=3, layout=layout, correct=1)
    write(source(root, stem, "log.jsonl"), events)
    export_all(root)
    places = {Path(one.place).name for one in verify_data(root).differences}
    assert places == {f"{stem}_manifest.json"}


@pytest.mark.parametrize("version", UNSEALED)
def test_a_choice_is_what_was_felt_last_where_logs_do_not_say_it(root: Path) -> None:
    stem = "sub-01_ses-01_task-oddity"
    events = lines(source(root, stem, "log.jsonl"))
    assert all(event["event"] != "chosen" for event in events)
    for event in events:
        if event["event"] == "answer":
            right = event["row"]["odd_position"]
            event["row"].update(answer=right, correct=1)
    write(source(root, stem, "log.jsonl"), events)
    export_all(root)
    assert any(one.trial for one in verify_data(root).differences)


@pytest.mark.parametrize(
    ("there", "same"),
    [("'=a\t'+b\tc\n", True), ("'=a\t+b\tc\n", False), ("'=a\t'+b\t'c\n", False)],
)
def test_a_cell_that_was_guarded_against_spreadsheets_is_the_same(
    tmp_path: Path, there: str, *, same: bool
) -> None:
    table = tmp_path / "a.tsv"
    table.write_text(f"x\ty\tz\n{there}")
    assert is_earlier(table, b"x\ty\tz\n=a\t+b\tc\n") is same
