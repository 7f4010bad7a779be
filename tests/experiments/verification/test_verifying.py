"""Verification of data: what is tampered with is found, and nothing in what is not."""

from __future__ import annotations

import json
import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tactileq.experiments.sessions.kept import data_set
from tactileq.experiments.sessions.kept.log import line_of, read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.stored_sessions import held_sessions
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.sessions.store.withdrawing import withdraw
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling import InputError
from tests.experiments.verification.small_studies import (
    Stopping,
    eventful_study,
    run_all,
    run_one,
    small_study,
)
from tests.experiments.verification.tampering import (
    FIRST,
    SHOWN,
    STORED,
    edit_json,
    edit_text,
    lines,
    reseal,
    reseal_whole,
    sha256,
    source,
    table,
    write,
)
from tests.refusals import refused

Kind = Callable[[Path], None]
TEXTURES = ("canvas", "PVC")
# Of the kinds, those that are found even where every seal that names another is made anew.
FOUND_ANYWAY = (
    "log_ratings",
    "log_response_times_of_a_minute",
    "log_choices_all_right",
    "log_trial_deleted",
    "log_answer_added",
    "log_answer_invalid",
    "log_of_another_person",
    "log_deleted",
    "manifest_order",
    "manifest_slot",
    "manifest_not_simulated",
    "manifest_study",
    "session_replaced_by_another_persons",
    "session_copied_as_a_third_persons",
    "roster_slot",
    "roster_deleted",
)
# Those that are not found where the roster is sealed anew: docs/method/verification.md#tampering
NOT_FOUND_ANEW = (
    "person_withdrawn_who_did_not",
    "roster_dropout_added",
    "roster_lines_exchanged",
)


def test_nine_in_ten_kinds_are_found_where_logs_and_roster_are_sealed_anew() -> None:
    assert set(NOT_FOUND_ANEW) < set(STORED)
    assert len(NOT_FOUND_ANEW) <= 0.1 * len(STORED)


@pytest.fixture(scope="module")
def finished(models: ModelSets, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data of a study that has ended."""
    root = tmp_path_factory.mktemp("study") / "data"
    run_all(root, small_study(TEXTURES), models)
    return root


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "data"))


def test_nothing_differs_in_a_finished_study(finished: Path) -> None:
    found = verify_data(finished)
    assert found.differences == ()
    assert len(found.sessions) == 4
    assert len(found.seal) == 8
    assert found.unsealed == ()


@pytest.mark.parametrize("kind", [*STORED, *SHOWN])
def test_tampering_is_found(kind: str, copied: Path) -> None:
    {**STORED, **SHOWN}[kind](copied)
    assert verify_data(copied).differences


@pytest.mark.parametrize("kind", [kind for kind in STORED if kind not in NOT_FOUND_ANEW])
def test_tampering_is_found_where_logs_and_roster_are_sealed_anew(kind: str, copied: Path) -> None:
    STORED[kind](copied)
    reseal(copied)
    assert verify_data(copied).differences


@pytest.mark.parametrize("kind", FOUND_ANYWAY)
def test_what_contradicts_itself_is_found_whoever_seals_it(kind: str, copied: Path) -> None:
    STORED[kind](copied)
    reseal_whole(copied)
    assert verify_data(copied).differences


@pytest.mark.parametrize("anew", [reseal, reseal_whole])
def test_sealing_anew_what_was_not_changed_is_no_difference(anew: Kind, copied: Path) -> None:
    anew(copied)
    found = verify_data(copied)
    assert (found.differences, len(found.sessions)) == ((), 4)


def described(root: Path, **values: object) -> list[str]:
    """Places that differ once the description states these; None takes a key away."""
    path = root / "dataset_description.json"
    known = json.loads(path.read_text("utf-8"))
    kept = {name: value for name, value in {**known, **values}.items() if value is not None}
    path.write_text(json.dumps(kept), encoding="utf-8")
    return [one.place for one in verify_data(root).differences]


@pytest.mark.parametrize("name", ["BIDSVersion", "DatasetType", "GeneratedBy"])
def test_no_flipped_bit_in_what_the_program_describes_itself_by_is_accepted(
    name: str, copied: Path
) -> None:
    path = copied / "dataset_description.json"
    whole = path.read_bytes()
    (stated,) = re.finditer(rb'  "%s": .*?(?=,?\n(  "|}))' % name.encode(), whole, re.DOTALL)
    letters = [at for at in range(*stated.span()) if whole[at : at + 1].isalnum()]
    assert len(letters) > len(name)
    for at in letters:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        found = [one.place for one in verify_data(copied).differences]
        assert found == ["dataset_description.json"], path.read_bytes()[at - 20 : at + 20]


@pytest.mark.parametrize(
    "values",
    [
        {"BIDSVersion": None},
        {"BIDSVersion": ["1.10.0"]},
        {"DatasetType": "derivative"},
        {"GeneratedBy": None},
        {"GeneratedBy": []},
        {"GeneratedBy": {"Name": "tactileq"}},
        {"GeneratedBy": [{"Name": "tactileq", "Version": "0.0.9"}]},
    ],
)
def test_another_program_or_version_than_that_of_the_sessions_is_found(
    values: dict[str, object], copied: Path
) -> None:
    assert described(copied, **values) == ["dataset_description.json"]


def test_what_is_for_people_to_fill_in_is_theirs(copied: Path) -> None:
    assert not described(copied, License="CC0", Authors=["A. Person"], Funding=["none"])
    made = json.loads((copied / "dataset_description.json").read_text("utf-8"))["GeneratedBy"]
    assert not described(copied, GeneratedBy=[{"Name": "pandas"}, *made])


def test_data_of_an_earlier_version_are_as_that_one_described_them(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither a new version of BIDS nor one of the program makes them different."""
    later = (*data_set.BIDS_VERSIONS, "1.99.0")
    monkeypatch.setattr(data_set, "BIDS_VERSIONS", later)
    monkeypatch.setattr("tactileq.experiments.verification.verifying.BIDS_VERSIONS", later)
    assert verify_data(copied).differences == ()
    assert not described(copied, BIDSVersion="1.99.0")


def test_an_earlier_version_may_have_run_a_session_that_was_withdrawn(copied: Path) -> None:
    earlier = [{"Name": "tactileq", "Version": "0.0.9"}]
    assert described(copied, GeneratedBy=earlier)
    first = min(held_sessions(copied)[0], key=lambda one: one.state.begun_utc)
    withdraw(copied, first.files.subject)
    assert not described(copied, GeneratedBy=earlier)
    assert described(copied, GeneratedBy=[{"Name": "tactileo", "Version": "0.0.9"}])


def test_no_flipped_bit_in_a_log_is_accepted(copied: Path) -> None:
    log = source(copied, FIRST, "log.jsonl")
    whole = log.read_bytes()
    bits = random.Random(5).sample(range(8 * len(whole)), 600)
    for bit in [*bits, *range(8 * len(whole) - 8, 8 * len(whole))]:  # and in the last line's end
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        log.write_bytes(bytes(flipped))
        with pytest.raises(InputError):
            read_log(log)


@pytest.mark.parametrize("seed", range(5))
def test_nothing_differs_where_much_happened(seed: int, models: ModelSets, tmp_path: Path) -> None:
    told = eventful_study(tmp_path / "data", models, seed=seed)
    assert told
    assert verify_data(tmp_path / "data").differences == ()


def test_a_running_session_is_left_out(models: ModelSets, tmp_path: Path) -> None:
    study, root = small_study(TEXTURES), tmp_path / "data"
    run_one(root, study, models, subject=1)
    _, manifest = run_one(root, study, models, subject=2, respondent=Stopping(2, after=2))
    with SessionStore.resume(root, SessionManifest.load(manifest)) as store:
        store.log("break_began")
        found = verify_data(root)
    assert found.differences == ()
    assert found.sessions == (FIRST,)
    assert found.running == (FIRST.replace("sub-01", "sub-02"),)


def test_a_difference_names_file_and_trial(copied: Path) -> None:
    STORED["log_ratings"](copied)
    reseal_whole(copied)
    answers = lines(source(copied, FIRST, "log.jsonl"))
    trial = next(a["trial"] for a in answers if a["event"] == "answer" and a["trial"] > 1)
    first = verify_data(copied).differences[0]
    assert (first.place, first.trial) == (
        f"sourcedata/sub-01/ses-01/{FIRST}_log.jsonl",
        trial,
    )
    assert "magnitude_similarity" in first.sentence
    assert first.participant == "sub-01"


def test_who_is_left_out_is_not_compared(copied: Path) -> None:
    STORED["hand_edited"](copied)
    assert verify_data(copied).without(["sub-01"]).differences == ()
    assert verify_data(copied).without(["sub-02"]).differences


def test_the_torn_log_of_who_is_left_out_costs_nobody_else(copied: Path) -> None:
    """The next session's manifest names the seal of its last line, as does the roster."""
    log = source(copied, FIRST, "log.jsonl")
    log.write_bytes(log.read_bytes()[:-200])
    assert verify_data(copied).without(["sub-01"]).differences == ()
    assert verify_data(copied).without(["sub-02"]).differences


def test_logs_of_earlier_versions_are_unsealed_and_otherwise_verified(copied: Path) -> None:
    """As they were before there were seals."""
    for log in copied.glob("sourcedata/sub-*/*/*_log.jsonl"):
        manifest = log.with_name(log.name.replace("log.jsonl", "manifest.json"))
        edit_json(manifest, lambda values: values.pop("after"))
        kept = [event for event in lines(log) if event["event"] != "stored"]
        kept[0]["manifest_sha256"] = sha256(manifest)
        write(log, [{n: v for n, v in event.items() if n != "seal"} for event in kept])
    roster = copied / "sourcedata/roster.jsonl"
    enrolled = [event for event in lines(roster) if event["event"] == "enrolled"]
    write(roster, [{n: v for n, v in event.items() if n != "seal"} for event in enrolled])
    from tactileq.experiments.sessions.bids.export import export_all

    export_all(copied)
    found = verify_data(copied)
    assert found.differences == ()
    assert len(found.unsealed) == 4
    assert found.seal == ""
    STORED["log_ratings"](copied)
    assert any(d.trial for d in verify_data(copied).differences)


def test_a_log_without_seals_is_refused_where_its_program_wrote_some(copied: Path) -> None:
    log = source(copied, FIRST, "log.jsonl")
    events = [{n: v for n, v in event.items() if n != "seal"} for event in lines(log)]
    log.write_bytes(b"".join(line_of(event) for event in events))
    (first, *_) = verify_data(copied).differences
    assert "seals" in first.sentence


def test_published_data_are_compared_with_the_hashes_in_their_sidecars(copied: Path) -> None:
    shutil.rmtree(copied / "sourcedata")
    found = verify_data(copied)
    assert (found.differences, len(found.sessions), found.with_source) == ((), 4, False)
    answers = table(copied, FIRST, "beh.tsv")
    whole = answers.read_bytes()
    edit_text(answers, r"\t\d+\.\d+\t", "\t99.99\t")
    added = answers.with_name(answers.name.replace("beh.tsv", "notes.tsv"))
    added.write_text("a\n")
    lost = table(copied, FIRST, "events.tsv")
    lost.unlink()
    places = {difference.place for difference in verify_data(copied).differences}
    assert places == {path.relative_to(copied).as_posix() for path in (answers, added, lost)}
    answers.write_bytes(whole)
    answers.with_suffix(".json").write_text("{}\n")
    assert any("SHA-256" in d.sentence for d in verify_data(copied).differences)


def test_after_everybody_withdrew_nothing_differs(copied: Path) -> None:
    from tactileq.experiments.sessions.store.withdrawing import withdraw

    for subject in (1, 2):
        withdraw(copied, subject)
    found = verify_data(copied)
    assert (found.differences, found.sessions) == ((), ())


def test_a_folder_that_is_no_study_is_refused(tmp_path: Path) -> None:
    with refused(InputError, expected="study", got=tmp_path):
        verify_data(tmp_path)
    with refused(InputError, got=tmp_path / "none"):
        verify_data(tmp_path / "none")


def test_each_manifest_names_the_session_that_ended_before(finished: Path) -> None:
    roster = lines(finished / "sourcedata/roster.jsonl")
    ended = [(e["session"], e["log_seal"]) for e in roster if e["event"] == "sealed"]
    assert len(ended) == 4
    named = [
        json.loads(source(finished, stem, "manifest.json").read_text())["after"]
        for stem, _ in ended
    ]
    assert named[0] == {}
    assert [(one["session"], one["seal"]) for one in named[1:]] == ended[:-1]
    for stem, seal in ended:
        assert lines(source(finished, stem, "log.jsonl"))[-1]["seal"] == seal


def test_what_participants_read_must_be_there_as_it_was(models: ModelSets, tmp_path: Path) -> None:
    texts = {"en": {"rest.title": "Time for a break"}}
    run_one(tmp_path, small_study(TEXTURES), models, texts=texts)
    run_one(tmp_path, small_study(TEXTURES), models, task="relative")  # of which none is known
    assert verify_data(tmp_path).differences == ()
    (file,) = tmp_path.glob("sourcedata/texts_en_*.toml")
    edit_text(file, "Time", "No time")
    (found,) = verify_data(tmp_path).differences
    assert found.place == file.relative_to(tmp_path).as_posix()
    file.unlink()
    (found,) = verify_data(tmp_path).differences
    assert (found.place, found.sentence.rpartition(" ")[2]) == (f"sourcedata/{file.name}", "none")


def test_other_texts_without_a_reason_are_found(models: ModelSets, tmp_path: Path) -> None:
    study = small_study(TEXTURES)
    run_one(tmp_path, study, models, texts={"en": {"rest.title": "Time for a break"}})
    other = {"en": {"rest.title": "Have a rest"}}
    again = {"subject": 2, "texts": other, "override": "a spelling mistake"}
    run_one(tmp_path, study, models, respondent=Stopping(2, after=2), **again)
    again["texts"] = {"en": {"rest.title": "Rest your hand"}}
    run_one(tmp_path, study, models, resume=True, **again)
    assert len(list(tmp_path.glob("sourcedata/texts_*"))) == 3
    assert verify_data(tmp_path).differences == ()
    description = tmp_path / "dataset_description.json"
    stated = json.loads(description.read_text())
    stated["TextsSHA256"]["en"] = "0" * 64
    description.write_text(json.dumps(stated))
    (found,) = verify_data(tmp_path).differences
    assert found.place == description.name
