"""`tactileq stimuli` as a user meets it: a recipe, the options instead, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.sets.recipe import Recipe

RECIPE = """
version = 1
set = {name = "touch", rate_hz = [5000, 44100], format = "pcm24", duration_s = 0.2}
level = {mode = "loudness", threshold = "pen-hold", full_scale_g = 4.0}
[[model]]
path = "models"
[[trajectory]]
speed_mm_s = 150
force_n = 1.5
[[trajectory]]
file = "hand.csv"
"""
SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A folder with two models, a hand and a recipe."""
    for name in ("PVC", "canvas"):
        planted_texture(name, **SMALL).save(tmp_path / f"study/models/{name}.json")
    (tmp_path / "study/models/PVC_provenance.json").write_text("{}")
    hand = "time_s,speed_mm_s,force_n\n0,0,1\n0.3,400,2\n"
    (tmp_path / "study/hand.csv").write_text(hand)
    (tmp_path / "study/set.toml").write_text(RECIPE)
    return tmp_path / "study"


def hashes(folder: Path) -> dict[str, str]:
    return dict(pd.read_csv(folder / "manifest.tsv", sep="\t")[["file", "sha256"]].to_numpy())


def test_a_set_and_once_more_from_its_own_recipe(main, tmp_path: Path, study: Path) -> None:
    made = main("stimuli", "study/set.toml", "--out", "a")
    assert made.returncode == 0, made.stderr
    assert made.stdout.endswith("8 files: a/manifest.tsv\n")
    # The recipe's paths are relative to it, and the hand is faster than any recording.
    assert "PVC (models) was recorded up to 300 mm/s and 3 N; hand reaches 400 mm/s" in made.stdout
    assert (tmp_path / "a/spectra.png").read_bytes().startswith(b"\x89PNG")
    manifest = pd.read_csv(tmp_path / "a/manifest.tsv", sep="\t")
    assert set(manifest.texture) == {"PVC", "canvas"}
    assert set(manifest.rate_hz) == {5000, 44_100}
    assert manifest.sensation_level_db.nunique() == 1
    assert manifest.simulated.all()
    provenance = json.loads((tmp_path / "a/provenance.json").read_text())
    assert provenance["command"] == "tactileq stimuli"
    assert set(provenance["inputs_sha256"]) == {
        "study/set.toml",
        "study/models",
        "study/hand.csv",
    }
    again = main("stimuli", "a/recipe.toml", "--out", "b")
    assert again.returncode == 0, again.stderr
    assert hashes(tmp_path / "b") == hashes(tmp_path / "a")
    # A set replaces a set.
    assert main("stimuli", "a/recipe.toml", "--out", "a").returncode == 0
    assert hashes(tmp_path / "a") == hashes(tmp_path / "b")


def test_options_make_a_recipe(main, tmp_path: Path, study: Path) -> None:
    options = ["--speed", 120, "--speed", 350, "--force", 1, "--rate", 8000, "--duration", 0.1]
    models = ["study/models/PVC.json", "study/models/PVC_provenance.json"]
    made = main("stimuli", *models, *options, "--seed", 3, "--out", "c")
    assert made.returncode == 0, made.stderr
    recipe = Recipe.load(tmp_path / "c/recipe.toml")
    assert (recipe.name, recipe.rates_hz, recipe.seeds) == ("c", (8000,), (3,))
    assert [(t.speed_mm_s, t.force_n) for t in recipe.trajectories] == [(120, 1), (350, 1)]
    assert "350mms_1N reaches 350 mm/s" in made.stdout
    assert "120mms" not in made.stdout
    assert main("stimuli", "c/recipe.toml", "--out", "d").returncode == 0
    assert hashes(tmp_path / "d") == hashes(tmp_path / "c")


def test_a_set_goes_where_a_link_leads(main, tmp_path: Path, study: Path) -> None:
    (tmp_path / "disk/sets").mkdir(parents=True)
    (tmp_path / "link").symlink_to("disk/sets")
    made = main("stimuli", "study/models/PVC.json", "--duration", 0.1, "--out", "link")
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "link").is_symlink()
    assert [p.name for p in (tmp_path / "disk").iterdir()] == ["sets"]
    names = {p.name for p in (tmp_path / "disk/sets").iterdir()}
    assert {"manifest.tsv", "provenance.json", "spectra.png"} < names


def test_other_files_among_the_models_are_named_and_passed_over(
    main, tmp_path: Path, study: Path
) -> None:
    made = main("export", "json", "study/models/PVC.json", "--out", "study/models/x.json")
    assert made.returncode == 0, made.stderr
    (study / "set.toml").write_text(RECIPE.replace("[5000, 44100]", "5000"))
    note = "note: study/models/x.json states that it is not a model and is skipped.\n"
    every = [path.relative_to(tmp_path) for path in sorted((study / "models").glob("*.json"))]
    for named in (["study/set.toml"], every):
        made = main("stimuli", *named, "--out", "set")
        assert made.returncode == 0, made.stderr
        assert made.stdout.count(note) == 1
        assert set(pd.read_csv(tmp_path / "set/manifest.tsv", sep="\t").texture) == {
            "PVC",
            "canvas",
        }


REFUSED = {
    (
        "stimuli",
        "study/set.toml",
        "--rate",
        "8000",
    ): "got both; write the options into study/set.toml",
    ("stimuli", "study/set.toml", "study/set.toml"): "expected one recipe and --out",
    (
        "stimuli",
        "study/set.toml",
        "--vibrator",
        "v.json",
    ): "got both; write the options into study/set.toml",
    (
        "stimuli",
        "study/set.toml",
        "--out",
        ".",
    ): "got ., which you are in",
    (
        "stimuli",
        "study/set.toml",
        "--out",
        "dangling",
    ): "link dangling, which points to nothing",
    ("stimuli", "study/none.toml"): "expected a recipe at study/none.toml",
    (
        "stimuli",
        "study/models/PVC.json",
        "--vibrator",
        "v.json",
    ): "at v.json, got nothing",
    ("stimuli", "study/models/PVC.json", "--rate", "44100.5"): "for rate_hz, got 44100.5",
    ("stimuli", "study/models/PVC.json", "--speed", "nan"): "for speed_mm_s, got nan",
    ("stimuli", "study/models/PVC_provenance.json"): "expected at least one model",
    ("stimuli", "study/set.toml", "--out", "study/hand.csv"): "expected a folder, got the file",
    (
        "stimuli",
        "study/set.toml",
        "--out",
        "study/hand.csv/x",
    ): "got a file in the way at study/hand.csv;",
    ("stimuli", "study/set.toml", "--out", "study"): "expected a new folder or a stimulus set",
}


def test_what_is_refused(main, tmp_path: Path, study: Path) -> None:
    (tmp_path / "dangling").symlink_to("nowhere")
    before = sorted(tmp_path.rglob("*"))
    for command, sentence in REFUSED.items():
        result = main(*command)
        assert result.returncode == 1
        assert sentence in result.stderr
        assert result.stderr.startswith("error: ")
        assert result.stderr.count("\n") == 1, result.stderr
        # Wrong input is refused before there is a progress bar; a place only when it is written.
        assert ("Rendering" in result.stdout) == ("in the way" in sentence)
    edit = (("0.3,400,2\n", "", "hand.csv"), ('name = "touch"', "speed = 1", "set.toml"))
    sentences = ("'hand', got 1 of them", "expected only name, rate_hz")
    for (old, new, file), sentence in zip(edit, sentences, strict=True):
        text = (study / file).read_text()
        (study / file).write_text(text.replace(old, new))
        result = main("stimuli", "study/set.toml")
        assert result.returncode == 1
        assert sentence in result.stderr
        assert result.stderr.count("\n") == 1, result.stderr
        (study / file).write_text(text)
    assert sorted(tmp_path.rglob("*")) == before
