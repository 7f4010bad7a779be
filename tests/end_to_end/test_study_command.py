"""tactileq study, from an empty folder to the page to preregister."""

from __future__ import annotations

import json
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.commands.study.check import study_check
from tactileq.experiments.sessions.kept.traces import PRESENTATION_COLUMNS
from tactileq.experiments.study.study import SHIPPED_STUDY, Study
from tactileq.modeling import Threshold, simplify
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.describing import schema
from tactileq.modeling.files.stimulus_table import STIMULUS_COLUMNS
from tactileq.modeling.files.tables import read_table
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import check_refusal

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
Main = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def place(tmp_path: Path, main: Main) -> Path:
    """The shipped study of small planted models, of which MDF's two are equal."""
    for folder in ("models", "simplified"):
        (tmp_path / folder).mkdir()
    for number, name in enumerate(Study.load().textures):
        full = planted_texture(name, **SMALL)
        fewer = simplify(full, Threshold.shipped("codec"), criterion="paper-fft").model
        full.save(tmp_path / f"models/{number}.json")
        (full if name == "MDF" else fewer).save(tmp_path / f"simplified/{number}.json")
    assert main("study", "init", "study.toml").returncode == 0
    return tmp_path


def test_a_new_study_file_is_the_shipped_one_with_a_seed_of_its_own(
    tmp_path: Path, main: Main
) -> None:
    for name in ("a.toml", "b.toml"):
        assert main("study", "init", name).returncode == 0
    first, second = Study.load(tmp_path / "a.toml"), Study.load(tmp_path / "b.toml")
    assert first.seed != second.seed
    lines = SHIPPED_STUDY.read_text(encoding="utf-8").splitlines()
    made = (tmp_path / "a.toml").read_text(encoding="utf-8").splitlines()
    assert [line for line in made if line not in lines] == [made[3]]
    assert made[0] == "#:schema ./study.schema.json"
    written = json.loads((tmp_path / "study.schema.json").read_text(encoding="utf-8"))
    assert written == schema(Study)
    (tmp_path / "bare.toml").write_text("\n".join(made[1:]), encoding="utf-8")
    assert Study.load(tmp_path / "bare.toml").sha256 == first.sha256
    refused = main("study", "init", "a.toml")
    assert refused.returncode == 1
    assert refused.stderr == (
        "error: expected a new file at a.toml, got an existing one; choose another name.\n"
    )
    assert Study.load(tmp_path / "a.toml") == first


def test_another_file_where_the_schema_would_be_is_kept(tmp_path: Path, main: Main) -> None:
    (tmp_path / "study.schema.json").write_text("mine")
    refused = main("study", "init", "a.toml")
    check_refusal(refused.stderr.removeprefix("error: "), names="study.schema.json")
    assert [path.name for path in tmp_path.iterdir()] == ["study.schema.json"]
    assert (tmp_path / "study.schema.json").read_text() == "mine"


def test_a_study_of_the_models_that_are_there_passes_its_check(place: Path, main: Main) -> None:
    made = main("study", "init", "mine/study.toml", "--models", "models")
    assert made.returncode == 0, made.stderr
    assert main("study", "check", "mine/study.toml").returncode == 0
    study = Study.load(place / "mine/study.toml")
    assert study.textures == tuple(sorted(Study.load().textures))
    assert study.plan_of("absolute").anchors == Study.load().plan_of("absolute").anchors
    # Fewer textures, of other names than the shipped ones, in another place.
    for folder in ("some/full", "some/simplified"):
        (place / folder).mkdir(parents=True)
    for name, texture in (("say 'aah'", "canvas"), ("[oak]", "PVC")):
        model = replace(planted_texture(texture, **SMALL), texture=name)
        model.save(place / f"some/full/{texture}.json")
        model.with_layers([0]).save(place / f"some/simplified/{texture}.json")
    made = main("study", "init", "other.toml", "--models", "some/full")
    assert made.returncode == 0, made.stderr
    checked = main("study", "check", "other.toml")
    assert checked.returncode == 0, checked.stderr
    study = Study.load(place / "other.toml")
    assert sorted(study.trays) == sorted(study.textures) == ["[oak]", "say 'aah'"]
    assert not study.plan_of("absolute").anchors
    # Nor in the commented lines, which somebody may take as they are.
    lines = (place / "other.toml").read_text(encoding="utf-8").splitlines()
    (catch,) = [line for line in lines if line.startswith("# catch = ")]
    pairs = tomllib.loads(catch.removeprefix("# "))["catch"]
    assert {name for pair in pairs.items() for name in pair} <= set(study.textures)


def test_a_study_of_models_that_lack_a_simplified_one_is_not_written(
    place: Path, main: Main
) -> None:
    (place / "simplified/3.json").unlink()
    refused = main("study", "init", "new.toml", "--models", "models")
    assert refused.returncode == 1
    check_refusal(refused.stderr, expected="simplified", got="MDF")
    refused = main("study", "init", "new.toml", "--simplified", "simplified")
    check_refusal(refused.stderr, expected="--models", got="simplified")
    shutil.rmtree(place / "simplified")
    shutil.copytree(place / "models", place / "simplified")
    refused = main("study", "init", "new.toml", "--models", "models")
    assert refused.returncode == 1  # nothing differs, so there is nothing to study
    assert not (place / "new.toml").exists()


def test_a_study_is_checked_with_its_models_design_and_balance(place: Path, main: Main) -> None:
    done = main("study", "check", "study.toml")
    assert done.returncode == 0, done.stderr
    for told in (
        "full and simplified are identical for MDF",
        "absolute: 20 participants, 1 session each, 2 training + 16 main trials per "
        "session; about 20 min",
        "relative: 24 participants, 2 sessions each, 2 training + 21 main trials",
        "(an estimate)",
        "10 to 10 of 20",
        "12 to 12 of 24",
        "claims: 3",
        "equally well: No equality unless full models are recognised above chance",
        "magnitude feels the same: No equality unless the anchors are rated lower",
    ):
        assert told in done.stdout
    assert "warning" not in done.stdout


def test_the_check_says_which_texts_no_native_speaker_has_read(place: Path, main: Main) -> None:
    done = main("study", "check", "study.toml")
    assert "texts: en (as shipped), ja (as shipped)" in done.stdout
    (note,) = [line for line in done.stdout.splitlines() if "native speaker" in line]
    assert " ja " in note
    file = place / "study.toml"
    line = 'languages = ["en", "ja"]'
    file.write_text(file.read_text("utf-8").replace(line, f'{line}\ntexts = "ja.toml" #'), "utf-8")
    (place / "ja.toml").write_text("proofread = true")
    done = main("study", "check", "study.toml")
    assert done.returncode == 0, done.stderr
    assert "native speaker" not in done.stdout
    (place / "ja.toml").write_text('rest.titel = "休憩"', encoding="utf-8")
    done = main("study", "check", "study.toml")
    check_refusal(done.stderr, expected="ja.toml", got="rest.titel")


def test_what_takes_long_is_said_before_it_begins(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also in a log, where no bar is seen before its end: sessions and trials to be drawn."""
    told = []

    def balance(*_: object, **__: object) -> list[object]:
        told.append(capsys.readouterr().out)
        return []

    monkeypatch.setattr("tactileq.experiments.tasks.balance.balance_of", balance)
    study_check(place / "study.toml")
    # 20 · 16 and 2 · 24 · 21 main trials; each task with its minutes.
    for fact in ("68 sessions", "1328 main trials", "min per session"):
        assert fact in told[0]


def test_the_check_says_what_catch_trials_cost(place: Path, main: Main) -> None:
    file = place / "study.toml"
    begun = '[oddity]\nparticipants = 24\nschedule = "interleaved"\nrepeats = 6\n'
    whole = file.read_text(encoding="utf-8")
    file.write_text(whole.replace("# [threshold]", f"{begun}# [threshold]"), encoding="utf-8")
    done = main("study", "check", "study.toml")
    assert done.returncode == 0, done.stderr
    for told in ("2 training + 48 main trials", "6 catch trials, about 6 minutes of each session"):
        assert told in done.stdout
    off = whole.replace("# [threshold]", f"{begun}catch_trials = 0\n# [threshold]")
    file.write_text(off, encoding="utf-8")
    done = main("study", "check", "study.toml")
    assert "2 training + 42 main trials" in done.stdout
    assert "catch" not in done.stdout


def test_a_tray_that_names_a_texture_is_refused_before_the_study_runs(
    place: Path, main: Main
) -> None:
    file = place / "study.toml"
    whole = file.read_text(encoding="utf-8")
    file.write_text(whole.replace('canvas = "B"', 'canvas = "mdf"'), encoding="utf-8")
    assert Study.load(file).trays["canvas"] == "mdf"  # as what was stored before is still read
    for words in (["study", "check"], ["study", "plan"], ["session", "--task=absolute", "--study"]):
        refused = main(*words, "study.toml")
        assert refused.returncode == 1
        check_refusal(refused.stderr, names=["'canvas'", "[trays]"], got=["'mdf'", "'MDF'"])
    assert not (place / "data").exists()


def test_the_same_models_twice_are_refused(place: Path, main: Main) -> None:
    text = (place / "study.toml").read_text(encoding="utf-8")
    (place / "study.toml").write_text(
        text.replace('simplified = "simplified"', 'simplified = "models"'), encoding="utf-8"
    )
    refused = main("study", "check", "study.toml")
    assert refused.returncode == 1
    assert "got identical ones for all, so that there is nothing to compare" in refused.stderr


RECIPE = """
version = 1
[set]
name = "surfaces"
rate_hz = [5000]
format = "float32"
duration_s = 0.5
[[model]]
path = "models"
label = "full"
[[model]]
path = "simplified"
label = "simplified"
[[trajectory]]
speed_mm_s = 200
force_n = 1.5
"""
TWO = """
name = "Two surfaces at a resting hand"
seed = 1
textures = ["canvas", "MDF"]
trays = {canvas = "A", MDF = "B"}
[models]
full = "set"
simplified = "set"
[absolute]
participants = 2
schedule = "interleaved"
training_trials = 1
most_training_trials = 4
[relative]
participants = 1
schedule = "interleaved"
repeats = 1
training_trials = 1
"""


@pytest.mark.usefixtures("undrawn")
def test_a_stimulus_set_is_presented_in_the_place_of_models(place: Path, main: Main) -> None:
    (place / "recipe.toml").write_text(RECIPE)
    (place / "two.toml").write_text(TWO)
    made = main("stimuli", "recipe.toml", "--out", "set")
    assert made.returncode == 0, made.stderr
    checked = main("study", "check", "two.toml")
    assert checked.returncode == 0, checked.stderr
    assert "note: full and simplified are identical for MDF: a control" in checked.stdout
    simulated = main("simulate", "--study", "two.toml", "--data", "data")
    assert simulated.returncode == 0, simulated.stderr
    tables = [
        read_table(path, PRESENTATION_COLUMNS)
        for path in sorted((place / "data").rglob("*_presentations.tsv"))
    ]
    assert len(tables) == 3
    shown = {row["model_sha256"] for rows in tables for row in rows if row["surface"] == "virtual"}
    files = {
        row["sha256"]
        for row in read_table(place / "set/manifest.tsv", STIMULUS_COLUMNS)
        if row["texture"] in ("canvas", "MDF")
    }
    assert shown == files
    # A signal has no grid of speeds and forces: nobody strokes outside of it, or trains for it.
    assert {row["outside_share"] for rows in tables for row in rows} == {None}
    for path in (place / "data").glob("sub-*/ses-*/beh/*_task-absolute_beh.tsv"):
        phases = [row["phase"] for row in read_table(path, [Column("phase")])]
        assert phases == ["training"] + ["main"] * 4
    analyzed = main("analyze", "data", "--out", "results")
    assert analyzed.returncode == 0, analyzed.stderr
    wav = next((place / "set").glob("canvas_full*.wav"))
    wav.write_bytes(wav.read_bytes()[:-4] + bytes(4))
    refused = main("study", "check", "two.toml")
    assert refused.returncode == 1
    assert refused.stderr.startswith("error: models full: expected set/canvas_full_200mms_1.5N.wav")


def test_models_made_from_others_are_warned_of(place: Path, main: Main) -> None:
    planted_texture("canvas", **SMALL).at_rate(8000.0).save(place / "models/1.json")
    done = main("study", "check", "study.toml")
    assert done.returncode == 0, done.stderr
    assert "warning: the simplified model of canvas was made from a model that is in none" in (
        done.stdout
    )


def test_a_missing_translation_is_refused_by_check_and_session_in_one_sentence(
    place: Path, main: Main
) -> None:
    file = place / "study.toml"
    whole = file.read_text(encoding="utf-8")
    craft = '[[questions]]\nname = "craft"\nlevels = ["no", "yes"]\ntext.en = "Any craft?"\n'
    wrong = {
        whole.replace('"en", "ja"', '"en", "fr"'): "got 'fr'; choose one, or name a file",
        f"{whole}\n{craft}": "expected the question craft in en, ja, got none in ja",
        f'{whole}\n{craft}text.ja = "手仕事は?"': "expected the levels of the question craft in "
        "en, ja, got none in ja; write levels_text.ja = [",
        whole.replace('"right", "left", "both"', '"right", "left", "neither"'): "expected the "
        'question "handedness" in the language "en", got none for neither',
    }
    for text, sentence in wrong.items():
        file.write_text(text, encoding="utf-8")
        refused = (
            main("study", "check", "study.toml"),
            main("session", "--task", "absolute", "--study", "study.toml"),
        )
        for done in refused:
            assert done.returncode == 1
            assert sentence in done.stderr
            assert done.stderr.count("\n") == 1
    assert not (place / "data").exists()


def test_exchanged_and_missing_models_are_refused_in_one_sentence(place: Path, main: Main) -> None:
    (place / "models").rename(place / "other")
    (place / "simplified").rename(place / "models")
    (place / "other").rename(place / "simplified")
    for words in (("check",), ("plan", "--out", "plan.md")):
        refused = main("study", words[0], "study.toml", *words[1:])
        assert refused.returncode == 1
        assert refused.stderr.startswith(
            "error: expected models to be made from those of a set that is"
        )
        assert refused.stderr.count("\n") == 1
    assert not (place / "plan.md").exists()
    (place / "models/1.json").unlink()
    refused = main("study", "check", "study.toml")
    assert "expected a full model of each texture of the study, got none of canvas" in (
        refused.stderr
    )


def test_the_page_is_written_again_but_nothing_else_is_replaced(place: Path, main: Main) -> None:
    done = main("study", "plan", "study.toml")
    assert done.returncode == 0, done.stderr
    page = (place / "plan.md").read_text(encoding="utf-8")
    assert page.startswith("# Simplified texture models: plan before the first answer\n")
    assert main("study", "plan", "study.toml").returncode == 0
    assert (place / "plan.md").read_text(encoding="utf-8") == page
    (place / "mine.md").write_text("mine")
    refused = main("study", "plan", "study.toml", "--out", "mine.md")
    assert refused.returncode == 1
    assert (place / "mine.md").read_text() == "mine"
    refused = main("study", "plan", "study.toml", "--out", "plan.txt")
    assert refused.stderr == "error: expected a name that ends in .md, got plan.txt; rename it.\n"
