"""Study files: read, read back, and refused with one sentence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import pytest

from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import SHIPPED_STUDY, Consent, Study, plan_sha256
from tactileq.experiments.study.task_plan import TaskPlan
from tactileq.modeling import InputError
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, RESPONSE_TIME, answer_table
from tactileq.modeling.files.claims import ClaimSection, PlanSection
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.describing import key_tables, schema
from tests.refusals import refused


def edited(folder: Path, old: str, new: str) -> Path:
    text = SHIPPED_STUDY.read_text(encoding="utf-8")
    assert old in text
    path = folder / "study.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


SWAPPED = {"ja": ("はい", "いいえ")}


def rich() -> Study:
    """A study that uses every table."""
    claim = ClaimSection(
        name="odd",
        task="oddity",
        measure="correct",
        models=("full", "AR"),
        bounds=(-0.1, 0.2),
        test="difference",
    )
    mood = Question(name="mood", least=0, most=10, text={"en": "Mood?", "ja": "気分は?"})
    craft = Question(
        name="craft",
        levels=("no", "yes"),
        text={"en": "Any craft?", "ja": "手仕事は?"},
        levels_text={"ja": ("いいえ", "はい")},
    )
    return replace(
        Study.load(),
        models={"full": "models", "AR": "ar", "simplified": "least.toml"},
        consent=Consent(version="2026-11"),
        questions=(Question(name="age", least=18, most=99), mood, craft),
        plan=PlanSection(claims=(claim,), exclusions=("None.",), highest_share_at_ends=0.3),
        tasks={
            "absolute": TaskPlan(
                participants=9,
                schedule="by-day",
                repeats=2,
                models=("simplified", "full", "AR"),
                training_trials=1,
                most_training_trials=4,
                break_after=10,
                anchors={"canvas": "PVC"},
            ),
            "oddity": TaskPlan(participants=5, schedule="interleaved", repeats=6, feel_all=True),
        },
    )


def test_a_study_is_made_again_from_its_plain_values() -> None:
    for study in (Study.load(), rich()):
        again = Study.from_dict(study.to_dict())
        assert again == study
        assert again.sha256 == study.sha256


def test_models_of_a_task_stand_in_the_studys_order_and_are_the_first_two_by_default() -> None:
    study = rich()
    assert study.models_of("absolute") == ("full", "AR", "simplified")
    assert study.models_of("oddity") == study.models_of("relative") == ("full", "AR")
    assert [study.sessions(task) for task in study.tasks] == [3, 2, 1]
    assert list(study.tasks) == ["absolute", "relative", "oddity"]
    with refused(InputError, expected=["absolute", "relative"], got="'oddity'"):
        Study.load().plan_of("oddity")


def test_every_change_of_a_study_changes_its_hash() -> None:
    study = rich()
    changes = (
        {"seed": 2},
        {"languages": ("en",)},
        {"longest_gap_min": 31},
        {"consent": Consent(version="2026-12")},
        {"questions": ()},
        {"questions": (*study.questions[:2], replace(study.questions[2], levels_text=SWAPPED))},
        {"plan": PlanSection()},
        {"calibration_days": 30},
        {"measured_force": True},
        {"models": {**study.models, "AR": "elsewhere"}},
        {"tasks": {**study.tasks, "oddity": replace(study.plan_of("oddity"), repeats=8)}},
    )
    hashes = {study.sha256, *(replace(study, **change).sha256 for change in changes)}
    assert len(hashes) == 1 + len(changes)


def test_the_hash_of_the_plan_is_of_the_study_and_of_the_models() -> None:
    study, models = rich(), {"canvas": {"full": "0a", "AR": "1b"}}
    found = plan_sha256(study, models)
    assert found == plan_sha256(Study.from_dict(study.to_dict()), models)
    assert found != plan_sha256(replace(study, seed=2), models)
    assert found != plan_sha256(study, {"canvas": {"full": "0a", "AR": "1c"}})


@dataclass(frozen=True, kw_only=True)
class PaidPlan(TaskPlan):
    """A task with one more key."""

    reward: Annotated[float, key("for taking part", unit="EUR", ge=0, le=99)] = 10.0


@dataclass(frozen=True, kw_only=True)
class PaidStudy(Study):
    """A study with one more key."""

    deposit: Annotated[float, key("for the key", unit="EUR", ge=0, le=50)] = 5.0


@pytest.mark.parametrize(
    ("paid", "name", "most", "where"),
    [(PaidStudy, "deposit", 50, ""), (PaidPlan, "reward", 99, "[absolute]")],
)
def test_a_key_costs_one_line(paid: type[FileSection], name: str, most: int, where: str) -> None:
    """Reading, refusing, saving, the schema and the documentation follow from the declaration."""
    plain = Study.load().to_dict()
    values = plain if paid is PaidStudy else plain["absolute"]
    read = paid.read({**values, name: 2}, where=where)
    assert read.to_dict() == {**values, name: 2.0}
    with refused(InputError, names=[name, *where.split()], expected=f"{most} EUR", got=most + 1):
        paid.read({**values, name: most + 1}, where=where)
    described = schema(paid)["properties"][name]
    assert (described["minimum"], described["maximum"]) == (0, most)
    assert f"| `{name}` | a number from 0 to {most} EUR |" in key_tables(paid)


def test_a_changed_file_is_followed(tmp_path: Path) -> None:
    study = Study.load(
        edited(tmp_path, "participants = 24\nschedule", "participants = 8\nschedule")
    )
    assert study.plan_of("relative").participants == 8


def test_what_a_task_does_not_say_is_as_usual(tmp_path: Path) -> None:
    text = SHIPPED_STUDY.read_text(encoding="utf-8")
    asked = "# [oddity]                # which of three", "[oddity] # which of three"
    text = text.replace("repeats = 3\n", "").replace(*asked)
    text = text.replace(
        '# participants = 24\n# schedule = "inter', 'participants = 24\nschedule = "inter'
    )
    (tmp_path / "study.toml").write_text(text)
    study = Study.load(tmp_path / "study.toml")
    assert [study.plan_of(task).repeats for task in study.tasks] == [1, 3, 6]
    assert {plan.most_training_trials for plan in study.tasks.values()} == {2}


ASKED = 'name = "sex"\ntext.en = "Mood?"\ntext.ja = "気分?"\nlevels_text'
JAPANESE = ["女", "男", "その他", "答えない"]
ABSOLUTE = 'participants = 20\nschedule = "interleaved"'
ANCHORS = '{"wall paper" = "aluminum", canvas = "PVC"}'
RELATIVE = 'participants = 24\nschedule = "by-day"'
LEVELS = str([f"level {number}" for number in range(19)])
CLAIM = 'models = ["full", "simplified"]\nbounds = [-0.1, 0.1]'


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("repeats = 3\n", "repeats = 3\nmost_training_trials = 1\n", "at least the 2 training"),
        ("repeats = 3\n", 'repeats = 3\nanchors = {canvas = "PVC"}\n', r"got some in \[relative"),
        ("repeats = 3\n", 'repeats = 3\nmodels = ["full"]\n', "two models or more"),
        ("repeats = 3\n", 'repeats = 3\nmodels = ["full", "full"]\n', "for models under"),
        ("repeats = 3\n", 'repeats = 3\nmodels = ["full", "AR"]\n', r"\[relative\], got AR"),
        (ABSOLUTE, f"{ABSOLUTE}\nfeel_all = true", r"got it in \[absolute\]"),
        ('canvas = "PVC"}', 'canvas = "canvas"}', "two different textures"),
        ('canvas = "PVC"}', 'canvas = "silk"}', "got 'canvas' = 'silk'"),
        (RELATIVE, RELATIVE.replace("24", "23"), "even number of participants"),
        ("[plan]\n", '[oddity]\nparticipants = 2\nschedule = "by-day"\n[plan]\n', "interleaved in"),
        (
            "[plan]\n",
            '[oddity]\nparticipants = 2\nschedule = "interleaved"\nrepeats = 3\n[plan]\n',
            "an even number of repeats",
        ),
        (
            "[plan]\n",
            '[threshold]\nparticipants = 2\nschedule = "by-day"\n[plan]\n',
            r"the schedule interleaved in \[threshold\]",
        ),
        *(
            (
                "[plan]\n",
                f'[oddity]\nparticipants = 8\nschedule = "interleaved"\n{key}\n[plan]\n',
                told,
            )
            for key, told in (
                ("catch_trials = 4", "4 catch trials of .*without a surface .*catch_trials = 0"),
                ("catch = {}\ncatch_trials = 1", "1 catch trials of .*without a surface"),
                ('catch = {canvas = "canvas"}', "catch, got 'canvas' = 'canvas'"),
                ('catch = {canvas = "silk"}', "catch, got 'canvas' = 'silk'"),
                ('catch = {silk = "canvas"}', "catch, got 'silk' = 'canvas'"),
            )
        ),
        ("repeats = 3\n", 'repeats = 3\ncatch = {canvas = "PVC"}\n', r"got one in \[relative"),
        (ABSOLUTE, f"{ABSOLUTE}\ncatch_trials = 0", r"got one in \[absolute"),
        ('simplified = "simplified"\n', "", "2 to 6 sets of models"),
        ('simplified = "simplified"\n', '"si|mple" = "simplified"\n', "for models, got"),
        ('["en", "ja"]', "[]", "for languages, got"),
        ('["en", "ja"]', '["English"]', "such as en or ja for languages"),
        ('["en", "ja"]', '["en", "en"]', "different languages"),
        ('name = "sex"', 'name = "Sex"', "for name under"),
        ('name = "sex"', 'name = "code"', "and none of .* got 'code'"),
        ('name = "sex"', 'name = "age"', "different questions"),
        ('name = "sex"', 'name = "mood"', "expected the question mood in en, ja"),
        ('name = "sex"', 'name = "mood"\ntext.en = "Mood?"', "got none in ja"),
        ('name = "sex"', 'name = "sex"\nleast = 3', "least and most, or two levels"),
        ("least = 18\n", "", "least and most, or two levels"),
        ('levels = ["female",', f"levels = {LEVELS[:-1]},", "at most 18 levels, .* sex, got 22"),
        ('name = "sex"', f"{ASKED}.de = {JAPANESE}", "levels of the question sex in .* none in ja"),
        ('name = "sex"', f"{ASKED}.ja = {JAPANESE[1:]}", "4 texts in levels_text.ja .* got 3"),
        ('name = "sex"', f"{ASKED}.ja = {[*JAPANESE[:3], '女']}", "for levels_text under"),
        ('name = "sex"', f"{ASKED}.ja = {[*JAPANESE[:3], '']}", "for levels_text under"),
        ("least = 18\n", 'least = 18\nlevels_text.ja = ["一"]\n', "levels for the levels_text"),
        ("least = 18\n", "least = -1\n", "whole numbers from 0 to 999999 for .* got -1 to 99"),
        ("least = 18\nmost = 99\n", "least = 1\nmost = 1_000_000\n", "got 1 to 1000000"),
        ("least = 18\nmost = 99\n", "least = 1.2\nmost = 1.8\n", "got 1.2 to 1.8"),
        ("least = 18\n", "least = 99\n", "least and most, or two levels"),
        ('"right", "left", "both"', '"right", "right"', "for levels under"),
        ('rule = "hierarchical" ', "few = 0.15 ", r"few in \[plan\] .* got 0.15 .* remove it"),
        ('rule = "hierarchical" ', 'rule = "hierarchical"\nfew = 0.2 ', "got 0.2 .* remove it"),
        (ABSOLUTE, ABSOLUTE.replace("20", "7"), r"8 participants or more in \[absolute.* got 7"),
        ('measure = "correct"', 'measure = "accuracy"', "got 'accuracy'"),
        (
            'measure = "correct"',
            'measure = "magnitude_similarity"',
            "expected correct for the measure",
        ),
        ('task = "relative"', 'task = "oddity"', "expected a planned task"),
        (CLAIM, CLAIM.replace("-0.1", "0"), "two bounds, below and above 0"),
        (CLAIM, CLAIM.replace("0.1]", "1.1]"), "bounds within -1 and 1"),
        (CLAIM, CLAIM.replace('"simplified"', '"AR"'), "got 'AR'"),
        (CLAIM, CLAIM.replace('"simplified"', '"full"'), "two different sets of models"),
        (
            'name = "frequency feels the same"',
            'name = "magnitude feels the same"',
            "claims of different names",
        ),
        ('"PVC", ', "", "got trays for"),
        ('"PVC", ', '"PVC", "PVC", ', "for textures, got"),
        ('PVC = "F"', 'PVC = "E"', "for trays, got"),
        ('PVC = "F"', 'PVC = "F\\tG"', "for trays, got"),
        ('PVC = "F"', "PVC = 'F\"G'", "for trays, got"),
        ('"canvas", ', '"can|vas", ', "for textures, got"),
        ('"canvas", ', '"can\\nvas", ', "for textures, got"),
        ("[relative]", "[[relative]]", r"expected a table \[relative\]"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    path = edited(tmp_path, old, new)
    with pytest.raises(InputError, match=told) as refusal:
        Study.load(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_study_of_an_earlier_version_keeps_its_values_and_its_hash() -> None:
    """Its verdicts rest on tests; the hashes are those of the version before rules and catches."""
    trays = {"canvas": "A", "MDF": "B", "PVC": "C"}
    oddity = TaskPlan(participants=6, schedule="interleaved", repeats=6)
    study = Study(
        name="Before", seed=11, textures=tuple(trays), trays=trays, tasks={"oddity": oddity}
    )
    assert study.plan.rule == "tests"
    assert not {"rule", "few"} & set(study.to_dict()["plan"])
    assert study.sha256 == "dc688debd8aa2ed689d8bc132e4f7e5b6ec26e9d9cb1719237524cbe9fd5d220"
    assert Study.from_dict(study.to_dict()) == study


def test_texts_of_ones_own_are_no_part_of_what_identifies_a_study(tmp_path: Path) -> None:
    """What they say is in the data by its hash; the hash is that of the version before them."""
    shipped = Study.load()
    of_then = replace(shipped, plan=replace(shipped.plan, rule="model"))
    assert of_then.sha256 == "6c4d77728ef81c575fdf2bd5af6f9802801f80804b3585b468c57dd03c23ec84"
    assert "texts" not in shipped.to_dict()
    own = replace(shipped, texts={"ja": tmp_path / "ja.toml"})
    assert (own.sha256, own.to_dict()) == (shipped.sha256, shipped.to_dict())


def test_texts_are_files_beside_the_study_by_language(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    line = 'languages = ["en", "ja"]'
    shipped = SHIPPED_STUDY.read_text(encoding="utf-8")
    for texts in ('"own/ja.toml"', '{ja = "own/ja.toml"}'):
        file.write_text(shipped.replace(line, f"{line}\ntexts = {texts} #"), encoding="utf-8")
        assert Study.load(file).texts == {"ja": tmp_path / "own/ja.toml"}
    for texts, expected, got in (
        ('"wording.toml"', "de.toml", "'wording.toml'"),
        ("3", "de.toml", "3"),
        ('"de.toml"', ["language", "en, ja"], "'de'"),
    ):
        file.write_text(shipped.replace(line, f"{line}\ntexts = {texts} #"), encoding="utf-8")
        with refused(InputError, names=[file, "texts"], expected=expected, got=got):
            Study.load(file)


def test_the_rule_of_verdicts_is_part_of_the_plan() -> None:
    shipped = Study.load()
    assert shipped.plan.rule == "hierarchical"
    assert "few" not in shipped.plan.to_dict()
    rules = [replace(shipped.plan, rule=rule) for rule in ("hierarchical", "tests", "model")]
    fewer = replace(rules[2], few=0.1)
    assert len({plan.sha256 for plan in (*rules, fewer)}) == 4
    assert [PlanSection.read(plan.to_dict()) for plan in (*rules, fewer)] == [*rules, fewer]
    for plan in rules[:2]:
        plan.require_current()
        with refused(InputError, expected="model", got=[0.1, plan.rule]):
            replace(plan, few=0.1)
    with refused(InputError, expected=["hierarchical", "tests"], got=["model", "few"]):
        fewer.require_current()
    with refused(InputError, expected=8, got=7, names=["absolute", 'rule = "tests"']):
        replace(shipped, tasks={"absolute": replace(shipped.plan_of("absolute"), participants=7)})
    seven = {"absolute": replace(shipped.plan_of("absolute"), participants=7)}
    tested = replace(shipped, plan=replace(shipped.plan, rule="tests"), tasks=seven)
    assert tested.plan_of("absolute").participants == 7
    of_choices = [claim for claim in shipped.plan.claims if claim.measure == "correct"]
    decided_by_tests = replace(shipped.plan, claims=tuple(of_choices))
    few = {"relative": replace(shipped.plan_of("relative"), participants=4)}
    assert replace(shipped, plan=decided_by_tests, tasks=few).plan_of("relative").participants == 4
    unclaimed = replace(shipped, plan=replace(shipped.plan, claims=()), tasks=seven)
    assert unclaimed.plan_of("absolute").participants == 7


PAIRS = {"wall paper": "aluminum", "canvas": "PVC"}


@pytest.mark.parametrize(
    ("rule", "said", "expected"),
    [
        ("model", {}, (PAIRS, 6)),
        ("model", {"catch": {"MDF": "PVC"}}, ({"MDF": "PVC"}, 6)),
        ("model", {"catch": {"MDF": "PVC"}, "catch_trials": 9}, ({"MDF": "PVC"}, 9)),
        ("model", {"catch_trials": 0}, ({}, 0)),
        ("tests", {}, ({}, None)),
        ("tests", {"catch": {"MDF": "PVC"}}, ({"MDF": "PVC"}, 6)),
        ("tests", {"catch": {"MDF": "PVC"}, "catch_trials": 0}, ({"MDF": "PVC"}, 0)),
    ],
)
def test_new_studies_have_catch_trials_of_their_anchors(
    rule: str, said: dict[str, Any], expected: tuple[dict[str, str], int | None]
) -> None:
    shipped = Study.load()
    plain = {"participants": 8, "schedule": "interleaved", **said}
    plan = TaskPlan.read({"repeats": 6, **plain})
    study = replace(
        shipped,
        plan=replace(shipped.plan, rule=rule),
        tasks={**shipped.tasks, "oddity": plan},
    )
    found = study.plan_of("oddity")
    assert (found.catch, found.catch_trials) == expected
    again = Study.from_dict(study.to_dict())
    assert again == study
    assert again.sha256 == study.sha256
    # A study that has none, and says nothing of them, has the values of an earlier version.
    stored = set(study.to_dict()["oddity"]) & {"catch", "catch_trials"}
    assert stored == {
        name
        for name, value in zip(("catch", "catch_trials"), expected, strict=True)
        if value not in ({}, None)
    }


def test_new_studies_without_anchors_have_to_name_their_catch_trials_or_to_want_none() -> None:
    shipped = Study.load()
    bare = replace(shipped.plan_of("absolute"), anchors={})
    oddity = TaskPlan(participants=8, schedule="interleaved", repeats=6)
    tasks = {**shipped.tasks, "absolute": bare, "oddity": oddity}
    with refused(InputError, names=["[oddity]", "catch = {", "catch_trials = 0"], expected=6):
        replace(shipped, tasks=tasks)
    for said in ({"catch_trials": 0}, {"catch": PAIRS}):
        replace(shipped, tasks={**tasks, "oddity": replace(oddity, **said)})


def test_by_day_takes_as_many_people_as_make_whole_blocks() -> None:
    three = {"full": "a", "paper": "b", "simplified": "c"}
    plan = TaskPlan(participants=20, schedule="by-day", models=tuple(three))
    shipped = replace(Study.load(), plan=PlanSection())
    with refused(InputError, expected=[3, "participants"], got=20):
        replace(shipped, models=three, tasks={"absolute": plan})
    study = replace(shipped, models=three, tasks={"absolute": replace(plan, participants=21)})
    assert study.sessions("absolute") == 3


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with refused(InputError, expected=["study", tmp_path / "none.toml"]):
        Study.load(tmp_path / "none.toml")


def test_no_claim_about_a_task_without_ratings_or_right_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    about = {"title": "pair comparison", "texture": "", "model": ""}
    monkeypatch.setitem(ANSWER_TABLES, "pair", answer_table(RESPONSE_TIME, **about))
    claim = {"name": "alike", "models": ("full", "simplified"), "test": "difference"}
    for task, measure in (("pair", "response_time_s"), ("threshold", "correct")):
        with refused(InputError, expected="alike", got=task):
            ClaimSection(**claim, task=task, measure=measure, bounds=(-0.1, 0.1))
