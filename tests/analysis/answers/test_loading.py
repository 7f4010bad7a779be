"""Reading answers: what is kept, what is dropped with a word, what is refused."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tactileq.analysis.answers.loading import load_responses
from tactileq.analysis.answers.responses import PlannedTask, Responses, leave_out
from tactileq.analysis.answers.setups import pool_setups
from tactileq.modeling import InputError
from tests.analysis.conftest import TEXTURES
from tests.refusals import refused


def test_main_trials_and_training_are_kept_apart(study_folder, write_task, absolute_rows):
    write_task("absolute", absolute_rows)
    responses = load_responses(study_folder)
    assert len(responses.answers["absolute"]) == 14
    assert set(responses.answers["absolute"]["phase"]) == {"main"}
    assert responses.training["absolute"]["texture"].tolist() == ["canvas"]
    assert responses.answers["absolute"]["participant_id"].unique().tolist() == ["sub-01"]
    assert responses.answers["absolute"]["magnitude_similarity"].tolist() == [
        50.0 + n for n in range(1, 15)
    ]
    assert responses.answers["relative"].empty
    assert "correct" in responses.answers["relative"]
    assert not responses.simulated
    assert responses.name == "Seven surfaces"
    assert responses.warnings == ()


def test_several_participants_and_both_tasks(
    study_folder, write_task, absolute_rows, relative_rows
):
    for participant in ("sub-02", "sub-01"):
        write_task("absolute", absolute_rows, participant=participant)
        write_task("relative", relative_rows, participant=participant)
    responses = load_responses(str(study_folder))
    assert len(responses.answers["absolute"]) == 28
    assert (
        responses.answers["relative"]["participant_id"].tolist() == ["sub-01"] * 7 + ["sub-02"] * 7
    )
    assert responses.answers["relative"]["correct"].sum() == 8


def test_missing_values_become_nan(study_folder, write_task, absolute_rows):
    absolute_rows[3][6] = "n/a"
    write_task("absolute", absolute_rows)
    ratings = load_responses(study_folder).answers["absolute"]["magnitude_similarity"]
    assert math.isnan(ratings[2])
    assert ratings.notna().sum() == 13


@pytest.mark.parametrize("kept", range(1, 60, 7))
def test_a_file_that_was_cut_is_refused(study_folder, write_task, absolute_rows, kept):
    path = write_task("absolute", absolute_rows)
    path.write_bytes(path.read_bytes()[:-kept])
    if kept == 1:  # only the last line end is missing
        assert len(load_responses(study_folder).answers["absolute"]) == 14
        return
    with pytest.raises(InputError) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_a_session_without_an_answer_has_none(study_folder, write_task, absolute_rows):
    write_task("absolute", absolute_rows)
    write_task("absolute", [], participant="sub-02")
    responses = load_responses(study_folder)
    assert responses.answers["absolute"]["participant_id"].unique().tolist() == ["sub-01"]


def test_quoted_text_is_read_as_it_was(study_folder, write_task, absolute_rows):
    """As a table of BIDS holds it: in quotes, each quote doubled."""
    for row in absolute_rows:
        row[2] = {"canvas": '"say ""linen"""'}.get(row[2], row[2])
    path = write_task("absolute", absolute_rows)
    (manifest,) = study_folder.rglob("*_manifest.json")
    stored = json.loads(manifest.read_text())
    for trial in stored["trials"]:
        for name in ("texture", "virtual_texture"):
            trial[name] = {'"say ""linen"""': 'say "linen"'}.get(trial[name], trial[name])
    manifest.write_text(json.dumps(stored))
    assert 'say "linen"' in set(load_responses(study_folder).answers["absolute"]["texture"])
    path.write_text(path.read_text().replace('"say ""linen"""', '"say "linen""'))
    with refused(InputError, expected=["quotes", "line 2", path], got="linen"):
        load_responses(study_folder)


def test_windows_line_ends_and_byte_order_mark_are_read(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert len(load_responses(study_folder).answers["absolute"]) == 14


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        (0, "3", "every trial once"),
        (10, "true", "simulated = false"),
    ],
)
def test_malformed_ratings_are_refused(
    study_folder, write_task, absolute_rows, column, value, expected
):
    absolute_rows[5][column] = value
    path = write_task("absolute", absolute_rows)
    with pytest.raises(InputError, match=expected) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)
    assert "answer 6" in str(caught.value)


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        (6, "velvet", "stands in its trial's layout"),
        (7, "0", "correct = 1 exactly where"),
        (7, "n/a", "correct = 1 exactly where"),
    ],
)
def test_malformed_choices_are_refused(
    study_folder, write_task, relative_rows, column, value, expected
):
    relative_rows[2][column] = value
    path = write_task("relative", relative_rows)
    with pytest.raises(InputError, match=expected) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_a_file_in_the_wrong_folder_is_refused(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    path.rename(path.with_name("sub-07_ses-01_task-absolute_beh.tsv"))
    with refused(
        InputError,
        names=[
            "sub-01_ses-01_task-absolute_beh.tsv",
            path.parent,
            "sub-07_ses-01_task-absolute_beh.tsv",
        ],
    ):
        load_responses(study_folder)


def test_other_bytes_than_text_are_refused(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    path.write_bytes(path.read_bytes().replace(b"canvas", b"\xff\xfe"))
    with refused(InputError, expected=path, got="UTF-8") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_simulated_and_real_participants_are_never_mixed(study_folder, write_task, absolute_rows):
    write_task("absolute", absolute_rows)
    participants = study_folder / "participants.tsv"
    participants.write_text(participants.read_text() + "sub-02\ttrue\n")
    facts = ["simulated", "false", "dataset_description.json", participants, "answer 2", "'true'"]
    with refused(InputError, names=facts):
        load_responses(study_folder)


SIMULATED_KEYS = ("Simulated", "SimulatedParticipant", "SimulatedRig")


@pytest.mark.parametrize("rig", [False, True])
@pytest.mark.parametrize("participants", [False, True])
def test_what_was_simulated_is_carried(study_folder, write_task, absolute_rows, participants, rig):
    facts = dict(zip(SIMULATED_KEYS, (participants or rig, participants, rig), strict=True))
    (study_folder / "dataset_description.json").write_text(json.dumps(facts))
    listed = f"participant_id\tsimulated\nsub-01\t{str(participants).lower()}\n"
    (study_folder / "participants.tsv").write_text(listed)
    either = str(participants or rig).lower()
    path = write_task("absolute", [[*row[:-1], either] for row in absolute_rows])
    sidecar = path.with_suffix(".json")
    sidecar.write_text(json.dumps(facts))
    responses = load_responses(study_folder)
    assert responses.simulated_participants is participants
    assert responses.simulated_rig is rig
    assert responses.simulated is (participants or rig)
    sidecar.write_text(json.dumps({**facts, "SimulatedParticipant": not participants}))
    with refused(
        InputError,
        names=[
            "SimulatedParticipant",
            str(participants).lower(),
            "dataset_description.json",
            str(not participants).lower(),
        ],
    ) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, sidecar)


@pytest.mark.parametrize(
    "facts", [(True, False, False), (False, True, False), (True, "yes", False), (True,)]
)
def test_a_description_that_does_not_tell_what_was_simulated_is_refused(study_folder, facts):
    path = study_folder / "dataset_description.json"
    path.write_text(json.dumps(dict(zip(SIMULATED_KEYS, facts, strict=False))))
    with pytest.raises(InputError, match="say what was simulated") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_a_session_that_ended_early_is_named(study_folder, write_task, write_order, relative_rows):
    write_task("relative", relative_rows)
    write_task("relative", relative_rows[:4], participant="sub-02")
    write_order("relative", relative_rows, participant="sub-02")
    write_task("relative", [], participant="sub-03")
    write_order("relative", relative_rows, participant="sub-03")
    responses = load_responses(study_folder)
    assert responses.warnings == (
        "sub-02 relative ses-01 answered 4 of 7 main trials (ended early).",
        "sub-03 relative ses-01 answered 0 of 7 main trials (ended early).",
    )
    assert len(responses.answers["relative"]) == 11


@pytest.mark.parametrize("with_order", [True, False])
@pytest.mark.parametrize(
    ("status", "person", "planned", "unfinished"),
    [
        ("running", "enrolled", 2, True),
        ("crashed", "enrolled", 2, True),
        ("aborted", "enrolled", 2, True),
        ("crashed", "dropped", 2, True),  # nobody has come in the place
        ("crashed", "dropped", 1, False),
    ],
)
def test_a_session_that_may_go_on_is_not_finished(
    study_folder,
    write_task,
    write_order,
    relative_rows,
    status,
    person,
    planned,
    unfinished,
    with_order,
):
    people = ("participant_id\tsimulated\tstatus", "sub-01\tfalse\tenrolled")
    listed = "\n".join([*people, f"sub-02\tfalse\t{person}\n"])
    (study_folder / "participants.tsv").write_text(listed)
    design = {"participants": planned, "schedule": "interleaved"}
    describe(study_folder, StudyDesign={"name": "Seven surfaces", "relative": design})
    write_task("relative", relative_rows).with_suffix(".json").write_text('{"Status": "complete"}')
    path = write_task("relative", relative_rows[:4], participant="sub-02")
    path.with_suffix(".json").write_text(json.dumps({"Status": status}))
    write_order("relative", relative_rows, participant="sub-02")
    if not with_order:
        shutil.rmtree(study_folder / "sourcedata")
    responses = load_responses(study_folder)
    assert responses.unfinished == ("relative",) * unfinished
    both = pool_setups({"here": responses, "there": replace_times(responses)})
    assert both.unfinished == responses.unfinished
    assert leave_out(responses, {"sub-02": "moved away"}).unfinished == ()


def test_who_stopped_in_training_and_is_left_out_has_taken_part(
    study_folder, write_task, write_order, relative_rows
):
    design = {"participants": 2, "schedule": "interleaved"}
    describe(study_folder, StudyDesign={"name": "Seven surfaces", "relative": design})
    training = [["1", "training", *relative_rows[0][2:]]]
    write_task("relative", relative_rows)
    write_task("relative", training, participant="sub-02")
    main = [[str(int(row[0]) + 1), *row[1:]] for row in relative_rows]
    write_order("relative", [*training, *main], participant="sub-02")
    assert load_responses(study_folder).unfinished == ("relative",)
    responses = load_responses(study_folder, leaving_out=["sub-02"])
    assert leave_out(responses, {"sub-02": "went home"}).unfinished == ()


def replace_times(responses: Responses) -> Responses:
    """The same answers, given faster, as of another set-up."""
    faster = {t: table.assign(response_time_s=1.0) for t, table in responses.answers.items()}
    return replace(responses, answers=faster)


def test_answers_without_a_manifest_are_told(study_folder, write_task, absolute_rows):
    for participant in ("sub-01", "sub-02", "sub-03"):
        write_task("absolute", absolute_rows, participant=participant)
    for participant in ("sub-01", "sub-03"):
        order = study_folder / "sourcedata" / participant / "ses-01"
        (order / f"{participant}_ses-01_task-absolute_manifest.json").unlink()
    (told,) = load_responses(study_folder).warnings
    assert told == (
        "2 sessions (sub-01 absolute ses-01 and others) have no manifest with whose order their "
        "answers could be compared."
    )


def _swap_models(rows):
    other = {"full": "simplified", "simplified": "full"}
    return [[*row[:3], other[row[3]], *row[4:]] for row in rows]


def _all_full(rows):
    return [[*row[:3], "full", *row[4:]] for row in rows]


def _renamed(rows):
    return [[*row[:2], {"canvas": "linen"}.get(row[2], row[2]), *row[3:]] for row in rows]


def _without_a_middle_row(rows):
    return rows[:4] + rows[5:]


def _other_first_surface(rows):
    return [[*row[:5], "real", *row[6:]] for row in rows]


def _one_more(rows):
    return [*rows, ["99", *rows[-1][1:]]]


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        (_swap_models, ["model", "full", "answer 1", "simplified"]),
        (_all_full, ["model", "simplified", "answer 3", "full"]),
        (_renamed, ["texture", "canvas", "answer 1", "linen"]),
        (_without_a_middle_row, ["trial 5", "answer 5", 6]),
        (_other_first_surface, ["first_surface", "virtual", "answer 2", "real"]),
        (_one_more, ["repeats", "answer 16", "n/a"]),
    ],
)
def test_answers_that_do_not_follow_the_stored_order_are_refused(
    study_folder, write_task, write_order, absolute_rows, change, facts
):
    absolute_rows[0][5] = "real"
    path = write_task("absolute", change(absolute_rows))
    write_order("absolute", absolute_rows)
    with refused(InputError, names=facts) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_another_layout_of_the_buttons_is_refused(
    study_folder, write_task, write_order, relative_rows
):
    path = write_task("relative", relative_rows)
    relative_rows[2][5] = "|".join(reversed(relative_rows[2][5].split("|")))
    write_order("relative", relative_rows)
    with refused(InputError, names=["layout", relative_rows[2][5], "answer 3"]) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_one_subjects_session_under_anothers_name_is_refused(
    study_folder, write_task, absolute_rows
):
    write_task("absolute", absolute_rows)
    beh = study_folder / "sub-02" / "ses-01" / "beh"
    beh.mkdir(parents=True)
    old = "sub-01_ses-01_task-absolute"
    (study_folder / f"sub-01/ses-01/beh/{old}_beh.tsv").rename(
        beh / "sub-02_ses-01_task-absolute_beh.tsv"
    )
    source = study_folder / "sourcedata"
    (source / "sub-02" / "ses-01").mkdir(parents=True)
    moved = source / "sub-02" / "ses-01" / "sub-02_ses-01_task-absolute_manifest.json"
    (source / "sub-01" / "ses-01" / f"{old}_manifest.json").rename(moved)
    with refused(InputError, names=["sub-02 ses-01 absolute", "sub-01 ses-01 absolute"]) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, moved)


def _describe(folder, **values):
    path = folder / "dataset_description.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))
    return path


def _models_of_all() -> dict[str, dict[str, str]]:
    return {texture: {"full": "0a", "simplified": "1b"} for texture in TEXTURES}


@pytest.mark.parametrize(
    ("column", "value", "facts"),
    [
        (2, "linen", ["aluminum", "canvas", "wall paper", "texture", "answer 5", "'linen'"]),
        (3, "half", ["full", "simplified", "model", "answer 5", "'half'"]),
    ],
)
def test_textures_and_models_that_the_study_does_not_have_are_refused(
    study_folder, write_task, absolute_rows, column, value, facts
):
    absolute_rows[4][column] = value
    path = write_task("absolute", absolute_rows)
    path.with_suffix(".json").write_text("{}")
    _describe(study_folder, ModelsSHA256=_models_of_all())
    with refused(InputError, names=facts) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_one_session_under_two_names_is_refused(study_folder, write_task, relative_rows):
    for number, row in enumerate(relative_rows):
        row[-2] = f"{20 + number / 7:.3f}"
    write_task("relative", relative_rows)
    twice = write_task("relative", relative_rows, participant="sub-02")
    with refused(InputError, names=["sub-01 relative ses-01", "response times"]) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, twice)
    relative_rows[3][-2] = "21.999"
    write_task("relative", relative_rows, participant="sub-02")
    assert len(load_responses(study_folder).answers["relative"]) == 14


def test_claims_come_from_the_study_that_was_run(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    stated = {
        "name": "as strong",
        "task": "absolute",
        "measure": "magnitude_similarity",
        "models": ["full", "simplified"],
        "bounds": [-7.5, 5],
        "test": "equivalence",
    }
    plan = {"claims": [stated], "exclusions": ["who slept"], "highest_share_at_ends": 0.3}
    description = _describe(study_folder, StudyDesign={"plan": plan})
    path.with_suffix(".json").write_text(json.dumps({"PlanSHA256": "ab"}))
    found = load_responses(study_folder).plan
    assert found.claims[0].bounds == (-7.5, 5.0)
    assert found.claims[0].planned
    assert (found.exclusions, found.highest_share_at_ends) == (("who slept",), 0.3)
    assert found.sha256 == ("ab",)
    assert found.rule == "tests"  # as of a version that named no rule
    for rule in ({"rule": "hierarchical"}, {"rule": "model"}, {"rule": "model", "few": 0.2}):
        _describe(study_folder, StudyDesign={"plan": {"claims": [stated], **rule}})
        assert load_responses(study_folder).plan.rule == rule["rule"]
    for wrong in ({"rule": "bayes"}, {"few": 0.6}, {"few": "0.1"}, {"few": True}):
        _describe(study_folder, StudyDesign={"plan": {"claims": [stated], **wrong}})
        (fact,) = wrong.values()
        with refused(InputError, names=description, got=repr(fact)) as caught:
            load_responses(study_folder)
        _one_sentence(caught.value, description)
    for wrong in ({"bounds": [1, 2]}, {"measure": "toggle"}, {"models": ["full"]}, {"task": "?"}):
        _describe(study_folder, StudyDesign={"plan": {"claims": [stated | wrong]}})
        with refused(InputError, names=[description, *wrong]) as caught:
            load_responses(study_folder)
        _one_sentence(caught.value, description)


def test_equal_models_are_those_that_sessions_name(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    groups = {"canvas": [["full", "simplified"]], "PVC": [["simplified", "AR"]]}
    path.with_suffix(".json").write_text(json.dumps({"Identical": groups}))
    responses = load_responses(study_folder)
    assert responses.identical() == {"canvas"}
    assert responses.identical(("simplified", "AR")) == {"PVC"}
    assert responses.identical(("full", "AR")) == frozenset()


def test_identical_models_are_known_by_their_hashes(study_folder, write_task, absolute_rows):
    path = write_task("absolute", absolute_rows)
    assert load_responses(study_folder).identical() == frozenset()
    path.with_suffix(".json").write_text("{}")
    models = _models_of_all() | {"canvas": {"full": "0a", "simplified": "0a"}}
    _describe(study_folder, ModelsSHA256=models)
    responses = load_responses(study_folder)
    assert responses.models == models
    assert responses.identical() == {"canvas"}


def test_sessions_without_sidecar_or_answers_are_noticed(
    study_folder, write_task, write_order, absolute_rows
):
    path = write_task("absolute", absolute_rows)
    write_order("absolute", absolute_rows, participant="sub-02")
    (told,) = load_responses(study_folder).warnings
    assert told.startswith("sub-02 absolute ses-01 was begun, but has no table of answers")
    _describe(study_folder, StudySHA256="00")
    with refused(InputError, names=["sidecar", "none"]) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path.with_suffix(".json"))


def test_a_changed_manifest_or_design_is_refused(
    study_folder, write_task, write_order, absolute_rows
):
    path = write_task("absolute", absolute_rows)
    manifest = write_order("absolute", absolute_rows)
    sidecar = path.with_suffix(".json")
    digest = hashlib.sha256(manifest.read_bytes()).hexdigest()
    sidecar.write_text(json.dumps({"DerivedFrom": {"manifest": digest}}))
    assert load_responses(study_folder).warnings == ()
    write_task("absolute", absolute_rows[:-2])
    changed = hashlib.sha256(manifest.read_bytes()).hexdigest()
    facts = {"expected": ["manifest", f"{digest[:12]}…"], "got": f"{changed[:12]}…"}
    with refused(InputError, **facts) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, manifest)
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"study_sha256": "ff"}))
    sidecar.write_text(json.dumps({"StudySHA256": "00"}))
    _describe(study_folder, StudySHA256="00")
    with refused(InputError, expected=["study", "00"], got="ff") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, manifest)
    described = _describe(study_folder, StudyDesign={"repeats": 3})
    with refused(InputError, expected=["StudyDesign", "StudySHA256", "00"], got="…") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, described)


@pytest.mark.parametrize(
    "models",
    [
        *(7, {"canvas": "0a"}, {"canvas": {"full": "0a"}}),
        {"canvas": {"full": "0a", "AR": "1"}, "PVC": {"full": "0a", "simplified": "1"}},
    ],
)
def test_a_damaged_list_of_models_is_refused(study_folder, write_task, absolute_rows, models):
    write_task("absolute", absolute_rows)
    path = _describe(study_folder, ModelsSHA256=models)
    with pytest.raises(InputError, match="models of each texture|of the same sets") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


@pytest.mark.parametrize(
    ("key", "value"), [("ModelsSHA256", {"canvas": {"full": "0a"}}), ("StudySHA256", "ff")]
)
def test_sessions_with_other_models_or_another_study_are_refused(
    study_folder, write_task, absolute_rows, key, value
):
    path = write_task("absolute", absolute_rows)
    models = _models_of_all()
    _describe(study_folder, ModelsSHA256=models, StudySHA256="00")
    sidecar = path.with_suffix(".json")
    sidecar.write_text(json.dumps({key: value}))
    with refused(InputError, names=[key, "dataset_description.json"]) as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, sidecar)


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("ModelsSHA256", {"canvas": {"full": "0a", "simplified": "2c"}}, "models"),
        ("StudySHA256", "ff", "study"),
        ("TextsSHA256", {"en": "ff"}, "texts"),
        ("Pilot", True, "pilot"),
    ],
)
def test_a_session_that_went_on_against_a_rule_is_told(
    study_folder, write_task, absolute_rows, key, value, what
):
    path = write_task("absolute", absolute_rows)
    models = _models_of_all()
    fixed = {"StudySHA256": "00", "TextsSHA256": {"en": "00"}, "Pilot": False}
    _describe(study_folder, ModelsSHA256=models, **fixed)
    sidecar = path.with_suffix(".json")
    record = {"what": what, "reason": "the disk was lost"}
    sidecar.write_text(json.dumps({key: value, "Overrides": [record]}))
    (told,) = load_responses(study_folder).warnings
    assert told == (
        f"sub-01 absolute ses-01 was continued against a rule ({what}): the disk was lost."
    )
    sidecar.write_text(json.dumps({key: value, "Overrides": [{**record, "what": "same date"}]}))
    with refused(InputError, names=[key, sidecar, "dataset_description.json"]):
        load_responses(study_folder)


def test_pilots_are_told(study_folder, write_task, absolute_rows):
    columns = [*_absolute_columns(), "pilot"]
    write_task("absolute", [[*row, "true"] for row in absolute_rows], columns=columns)
    among_others = load_responses(study_folder)
    told = "sub-01 absolute ses-01 was a pilot; its answers are not data of the study"
    assert among_others.warnings == (f"{told} and are left out.",)
    assert among_others.answers["absolute"].empty
    description = study_folder / "dataset_description.json"
    stated = json.loads(description.read_text())
    description.write_text(json.dumps({**stated, "Pilot": True}))
    for sidecar in study_folder.rglob("*_beh.json"):
        sidecar.write_text(json.dumps({**json.loads(sidecar.read_text()), "Pilot": True}))
    alone = load_responses(study_folder)
    assert alone.warnings == (f"{told}.",)
    assert len(alone.answers["absolute"]) > 0


def test_anchors_stand_apart(study_folder, write_task, absolute_rows):
    columns = [*_absolute_columns(), "virtual_texture"]
    rows = [[*row, "PVC" if row[0] in "57" else row[2]] for row in absolute_rows]
    write_task("absolute", rows, columns=columns)
    (manifest,) = study_folder.rglob("*_manifest.json")
    stored = json.loads(manifest.read_text())
    with refused(InputError, names=["virtual_texture", "canvas", "answer 5", "PVC"]):
        load_responses(study_folder)
    for trial, row in zip(stored["trials"], rows, strict=True):
        trial["virtual_texture"] = row[-1]
    manifest.write_text(json.dumps(stored))
    responses = load_responses(study_folder)
    assert responses.anchors["absolute"]["trial"].tolist() == [5, 7]
    assert len(responses.answers["absolute"]) == 12
    assert not {5, 7} & set(responses.answers["absolute"]["trial"])
    assert set(responses.anchors) == {"absolute", "oddity"}
    assert responses.anchors["oddity"].empty


ODDITY = "trial phase texture model layout odd_position answer correct presses response_time_s"
THRESHOLD = "trial phase frequency_hz amplitude_g highest_g interval answer correct response_time_s"


def _others(task):
    """Columns and three right answers of the tasks that present no real surface."""
    if task == "oddity":
        middle = [["canvas", "full", "full|simplified|simplified", "1", "1", "1", "6", "9.5"]] * 3
        columns = ODDITY.split()
    else:
        middle = [[hertz, "0.01", "1.5", "2", "2", "1", "3.5"] for hertz in ("30", "100", "300")]
        columns = THRESHOLD.split()
    rows = [[str(n), "main", *cells, "n/a", "false"] for n, cells in enumerate(middle, start=1)]
    if task == "threshold":
        columns += ["texture", "model"]
        rows = [[*row[:-2], "n/a", "n/a", *row[-2:]] for row in rows]
    return [*columns, "tray", "simulated"], rows


@pytest.mark.parametrize("task", ["oddity", "threshold"])
def test_tasks_without_a_real_surface_are_read(study_folder, write_task, task):
    columns, rows = _others(task)
    write_task(task, rows, columns=columns)
    (manifest,) = study_folder.rglob("*_manifest.json")
    trials = [
        {"trial": n, "phase": "main", "texture": "" if task == "threshold" else "canvas"}
        for n in (1, 2, 3)
    ]
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "trials": trials}))
    responses = load_responses(study_folder)
    assert responses.answers[task]["answer"].tolist() == [[1.0] * 3, [2.0] * 3][task == "threshold"]
    assert responses.textures == (() if task == "threshold" else ("canvas",))
    assert responses.answers["absolute"].empty
    rows[1][columns.index("correct")] = "0"
    path = write_task(task, rows, columns=columns)
    right = "interval" if task == "threshold" else "odd_position"
    with pytest.raises(InputError, match=f"exactly where answer and {right} agree") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_catch_trials_stand_apart(study_folder, write_task):
    columns, rows = _others("oddity")
    columns = [*columns, "odd_texture"]
    rows = [[*row, "PVC" if row[0] == "2" else "canvas"] for row in rows]
    rows[1][columns.index("layout")] = "full|full|full"
    write_task("oddity", rows, columns=columns)
    (manifest,) = study_folder.rglob("*_manifest.json")
    stored = json.loads(manifest.read_text())
    stored["trials"] = [
        {"trial": n, "phase": "main", "texture": "canvas", "odd_texture": odd}
        for n, odd in ((1, "canvas"), (2, "PVC"), (3, "canvas"))
    ]
    manifest.write_text(json.dumps(stored))
    responses = load_responses(study_folder)
    assert responses.anchors["oddity"]["trial"].tolist() == [2]
    assert responses.answers["oddity"]["trial"].tolist() == [1, 3]
    assert responses.trials_done("oddity") == 3
    stored["trials"][1]["odd_texture"] = "canvas"
    manifest.write_text(json.dumps(stored))
    with refused(InputError, expected=["odd_texture", "canvas", "answer 2"], got="PVC"):
        load_responses(study_folder)


def test_catch_trials_name_textures_of_the_study(study_folder, write_task):
    columns, rows = _others("oddity")
    path = write_task("oddity", [[*row, "silk"] for row in rows], columns=[*columns, "odd_texture"])
    path.with_suffix(".json").write_text("{}")
    _describe(study_folder, ModelsSHA256=_models_of_all())
    with refused(InputError, names=["odd_texture", "'silk'", path, "answer 1"]):
        load_responses(study_folder)


def test_an_oddity_table_of_an_earlier_version_has_no_catch_trials(study_folder, write_task):
    columns, rows = _others("oddity")
    write_task("oddity", rows, columns=columns)
    (manifest,) = study_folder.rglob("*_manifest.json")
    trials = [{"trial": n, "phase": "main", "texture": "canvas"} for n in (1, 2, 3)]
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "trials": trials}))
    newer = [[*row, "PVC"] for row in rows]
    times = columns.index("response_time_s")
    for number, row in enumerate(newer):
        row[times] = str(number)
    write_task("oddity", newer, columns=[*columns, "odd_texture"], participant="sub-02")
    (_, manifest) = sorted(study_folder.rglob("*_manifest.json"))
    trials = [{**trial, "odd_texture": "PVC"} for trial in trials]
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "trials": trials}))
    responses = load_responses(study_folder)
    assert responses.answers["oddity"]["participant_id"].tolist() == ["sub-01"] * 3
    assert responses.anchors["oddity"]["participant_id"].tolist() == ["sub-02"] * 3


def test_an_order_without_trials_is_refused(study_folder, write_task, write_order, relative_rows):
    write_task("relative", relative_rows)
    path = write_order("relative", relative_rows)
    path.write_text(json.dumps({"trials": 23}))
    with pytest.raises(InputError, match="a list of trials") as caught:
        load_responses(study_folder)
    _one_sentence(caught.value, path)


def test_simulated_answers_in_a_data_set_of_people_are_refused(
    study_folder, write_task, absolute_rows
):
    path = write_task("absolute", [[*row[:-1], "true"] for row in absolute_rows])
    with refused(InputError, names=["simulated", "false", path, "answer 1", "'true'"]):
        load_responses(study_folder)


@pytest.mark.parametrize(
    ("inside", "facts"),
    [
        ("nowhere", ["folder", "dataset_description.json"]),
        ("participants.tsv", ["folder", "dataset_description.json"]),
        ("", ["answers", "sub-01_ses-01_task-absolute_beh.tsv", "none"]),
    ],
)
def test_a_folder_that_is_none_is_refused(study_folder, inside, facts):
    with refused(InputError, names=[study_folder / inside, *facts]):
        load_responses(study_folder / inside)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{", "expected JSON"),
        ("[]", "a value that is not an object"),
        (json.dumps({"Name": "x"}), '"Simulated": true or false'),
        (json.dumps({"Simulated": "no"}), '"Simulated": true or false'),
        (None, "dataset_description.json, which is not there"),
    ],
)
def test_an_unclear_description_is_refused(study_folder, text, expected):
    path = study_folder / "dataset_description.json"
    if text is None:
        path.unlink()
    else:
        path.write_text(text)
    with pytest.raises(InputError, match=expected):
        load_responses(study_folder)


def test_a_missing_list_of_participants_is_refused(study_folder, write_task, absolute_rows):
    write_task("absolute", absolute_rows)
    (study_folder / "participants.tsv").unlink()
    with refused(InputError, names=study_folder / "participants.tsv"):
        load_responses(study_folder)


def _one_sentence(error: InputError, path: Path) -> None:
    text = str(error)
    assert path.name in text
    assert "\n" not in text
    assert text.endswith(".")
    assert ". " not in text


def _absolute_columns() -> list[str]:
    names = "trial phase texture model tray first_surface magnitude_similarity"
    return [*names.split(), "frequency_similarity", "toggles", "response_time_s", "simulated"]


def _relative_columns() -> tuple[str, ...]:
    names = "trial phase texture model tray layout answer correct presses response_time_s simulated"
    return tuple(names.split())


@pytest.mark.parametrize(
    ("design", "planned"),
    [
        ({"participants": 24, "schedule": "by-day"}, PlannedTask(24, 48, trials=48 * 7)),
        ({"participants": 20, "schedule": "interleaved"}, PlannedTask(20, 20, trials=20 * 7)),
        (
            {"participants": 3, "schedule": "by-day", "models": ["full", "paper", "AR"]},
            PlannedTask(3, 9, ("full", "paper", "AR"), trials=9 * 7),
        ),
    ],
)
def test_what_was_planned_is_read_from_the_design(
    study_folder, relative_rows, write_task, design, planned
):
    write_task("relative", relative_rows)
    describe(study_folder, StudyDesign={"name": "Seven surfaces", "relative": design})
    responses = load_responses(study_folder)
    assert responses.planned == {"relative": planned}
    assert responses.done("relative") == PlannedTask(1, 1)
    assert responses.done("absolute") == PlannedTask(0, 0)
    assert responses.unfinished == ("relative",)


def test_nothing_is_planned_where_there_is_no_design(study_folder, relative_rows, write_task):
    write_task("relative", relative_rows)
    responses = load_responses(study_folder)
    assert (responses.planned, responses.unfinished) == ({}, ())


@pytest.mark.parametrize("design", [{"participants": 0}, {"participants": "24"}, {}, 24])
def test_a_design_without_a_number_of_participants_is_refused(
    study_folder, relative_rows, write_task, design
):
    write_task("relative", relative_rows)
    describe(study_folder, StudyDesign={"relative": design})
    with pytest.raises(InputError, match="expected a whole number of at least 1"):
        load_responses(study_folder)


def describe(folder: Path, **more: object) -> None:
    """Add to the description of the data set."""
    path = folder / "dataset_description.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | more))


@pytest.mark.parametrize("left", ["header", "nothing"])
def test_of_who_is_left_out_nothing_need_be_readable(study_folder, write_task, absolute_rows, left):
    for participant in ("sub-02", "sub-01"):
        write_task("absolute", absolute_rows, participant=participant)
    paths = sorted(study_folder.glob("sub-01/ses-*/beh/*_beh.tsv"))
    others = load_responses(study_folder).answers["absolute"].query("participant_id != 'sub-01'")
    for path in paths:
        path.write_bytes(path.read_bytes().split(b"\n")[0] + b"\n" if left == "header" else b"")
    responses = load_responses(study_folder, leaving_out=["sub-01"])
    found = leave_out(responses, {"sub-01": "a stick that failed"})
    assert found.answers["absolute"].equals(others.reset_index(drop=True))
    assert set(found.left_out["absolute"]["participant_id"]) == {"sub-01"}
