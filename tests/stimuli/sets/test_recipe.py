"""Recipes: what they mean, that text keeps all of it, and that nothing is silently ignored."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactileq.modeling import InputError, Vibrator
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel, TrajectoryEntry
from tactileq.stimuli.sets.sources import load_sources
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
LEAST = """
version = 1
set = {name = "least"}
[[model]]
path = "models"
[[trajectory]]
speed_mm_s = 150
force_n = 1.5
"""


HELD = TrajectoryEntry.constant(150.0, 1.5)


def load(folder: Path, text: str) -> Recipe:
    path = folder / "set.toml"
    path.write_text(text, encoding="utf-8")
    return Recipe.load(path)


def test_what_is_left_out_has_the_documented_values(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    assert load(tmp_path, LEAST) == Recipe(
        name="least",
        models=(ModelEntry(tmp_path / "models", "models"),),
        trajectories=(TrajectoryEntry(name="150mms_1.5N", speed_mm_s=150.0, force_n=1.5),),
        rates_hz=(48_000,),
        format="float32",
        seeds=(0,),
        noise="independent",
        duration_s=1.0,
        settling_s=0.5,
        level=SetLevel(mode="as modelled"),
    )


def test_the_recipe_of_the_docs() -> None:
    recipe = Recipe.load(ROOT / "docs/stimuli.toml")
    assert [(m.path, m.label) for m in recipe.models] == [
        (ROOT / "docs/../demo" / folder, label)
        for folder, label in (("models", "full"), ("simplified", "simplified"))
    ]
    assert recipe.level == SetLevel(mode="loudness", threshold="pen-hold", full_scale_g=2.0)
    assert (recipe.rates_hz, recipe.seeds, recipe.format) == ((5000, 48_000), (1, 2), "pcm24")


def test_the_recipe_of_the_page(tmp_path: Path, vibrator: Vibrator) -> None:
    """With the files that it names, a set can be made of it."""
    page = (ROOT / "docs/models.md").read_text(encoding="utf-8")
    (text,) = re.findall("```toml\n(.*?)```", page, flags=re.DOTALL)
    for folder in ("models", "simplified"):
        planted_texture("canvas").save(tmp_path / folder / "canvas.json")
    (tmp_path / "hand.csv").write_text("time_s,speed_mm_s,force_n\n0,0,1\n1,200,1\n")
    vibrator.save(tmp_path / "vibrator.json")
    recipe = load(tmp_path, text)
    assert [entry.label for entry in recipe.models] == ["models", "simplified"]
    assert [hand.duration_s for hand in load_sources(recipe).trajectories] == [1.0]


paths = st.text().map(Path)  # whatever a file system holds
names = st.text(st.characters(categories=("L", "N", "P", "S")), min_size=1)
models = st.builds(ModelEntry, paths, names)
scenes = st.builds(ModelEntry, st.none(), names, paths)
numbers = st.floats(0, 1e4, allow_subnormal=False)
constants = st.builds(TrajectoryEntry, name=names, speed_mm_s=numbers, force_n=numbers)
hands = st.builds(TrajectoryEntry, name=names, file=paths)
levels = st.one_of(
    st.just(SetLevel(full_scale_g=2.5)),
    st.builds(
        SetLevel, mode=st.just("rms"), rms_db=st.floats(-100, 100), full_scale_g=st.just(1.0)
    ),
    st.builds(
        SetLevel,
        mode=st.just("loudness"),
        threshold=st.just("pen-hold") | st.text().map(lambda name: f"{name}x.tsv"),
        sensation_level_db=st.none() | st.floats(-50, 100),
        full_scale_g=st.floats(1e-3, 1e3),
    ),
)


CONTROLS = Recipe(name="x", models=(ModelEntry(Path("\x7f\x80\0\r\n"), "x"),), trajectories=(HELD,))


@given(
    recipe=st.builds(
        Recipe,
        name=names,
        models=st.lists(models | scenes, min_size=1, unique=True).map(tuple),
        trajectories=st.lists(
            constants | hands, min_size=1, max_size=4, unique_by=lambda t: t.name
        ).map(tuple),
        rates_hz=st.lists(st.integers(5000, 96_000), min_size=1, unique=True).map(tuple),
        format=st.just("pcm24"),
        seeds=st.lists(st.integers(0, 2**63 - 1), min_size=1, unique=True).map(tuple),
        noise=st.sampled_from(["independent", "frozen"]),
        duration_s=st.floats(0.001, 3600),
        settling_s=st.floats(0, 60),
        level=levels,
        vibrator=st.none() | paths,
    )
)
@example(recipe=CONTROLS)
def test_text_keeps_all_of_a_recipe(recipe: Recipe, tmp_path_factory: pytest.TempPathFactory):
    file = tmp_path_factory.getbasetemp() / "any.toml"
    file.write_text(recipe.to_toml(), encoding="utf-8")
    assert Recipe.load(file) == below(recipe, file.parent)


def below(recipe: Recipe, folder: Path) -> Recipe:
    """What the recipe means where it lies in this folder."""
    threshold = recipe.level.threshold
    if threshold is not None and threshold.file is not None:
        threshold = folder / threshold.file
    return replace(
        recipe,
        models=tuple(
            ModelEntry(
                entry.path and folder / entry.path,
                entry.label,
                entry.scene and folder / entry.scene,
            )
            for entry in recipe.models
        ),
        trajectories=tuple(
            entry if entry.file is None else replace(entry, file=folder / entry.file)
            for entry in recipe.trajectories
        ),
        level=replace(recipe.level, threshold=threshold),
        vibrator=None if recipe.vibrator is None else folder / recipe.vibrator,
    )


def refusal_of(folder: Path, old: str, new: str) -> str:
    assert old in LEAST
    with pytest.raises(InputError) as error:
        load(folder, LEAST.replace(old, new, 1))
    return str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("version = 1", "version = 2", "expected version = 1 at the top of a recipe, got 2"),
        ("version = 1", "", "expected version = 1 at the top of a recipe, got None"),
        ("version = 1", "version = 1\ncolour = 3", "in a recipe, got colour"),
        ('path = "models"', 'label = "full"', "expected a path or a scene under each [[model]]"),
        ('path = "models"', 'path = "models"\nscene = "s.toml"', "[[model]], got both in one"),
        ('path = "models"', 'scene = "s.toml"', "expected a scene at"),
        ('path = "models"', 'path = "models"\nlabel = ""', "label under [[model]], got ''"),
        ("[[model]]", "[model]", "expected a table [[model]]"),
        ("[[model]]\n", "model = [1]\n[set2]\n", "in a recipe, got set2"),
        ('"least"', '"least", rate_hz = 44100.5', "rate_hz under [set], got 44100.5"),
        ('"least"', '"least", rate_hz = []', "of one or more"),
        ('"least"', '"least", rate_hz = [5000, 5000.0]', "each rate_hz once in the recipe"),
        ('"least"', '"least", format = "pcm24"', "got full_scale_g = None"),
        ('"least"', '"least", duration_s = 1e-5', "one sample at 48000 Hz"),
        ('"least"', '"least", seeds = [1, 1]', "each seed once in the recipe, got 1 twice"),
        ("force_n = 1.5", 'name = "x"', "or a file, in the trajectory 'x', got speed_mm_s; give"),
        (
            "speed_mm_s = 150\nforce_n = 1.5",
            'name = "x"',
            "in the trajectory 'x', got none of them",
        ),
        ("force_n = 1.5", 'force_n = 1.5\nfile = "hand.csv"', "got speed_mm_s, force_n, file;"),
    ],
)
def test_wrong_recipes_get_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    message = refusal_of(tmp_path, old, new)
    assert sentence in message
    assert str(tmp_path / "set.toml") in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("level", "sentence"),
    [
        ('{mode = "rms"}', "expected rms_db"),
        ("{rms_db = -20}", 'expected rms_db only with mode = "rms"'),
        ('{threshold = "codec"}', 'expected threshold only with mode = "loudness"'),
        (
            '{mode = "rms", rms_db = 1, sensation_level_db = 3}',
            'expected sensation_level_db only with mode = "loudness"',
        ),
        ("{full_scale_g = 2}", 'got full_scale_g = 2 with "float32"'),
    ],
)
def test_levels_that_mean_nothing(tmp_path: Path, level: str, sentence: str) -> None:
    assert sentence in refusal_of(tmp_path, "version = 1", f"version = 1\nlevel = {level}")


def test_doubled_trajectories_and_models(tmp_path: Path) -> None:
    stroke = "[[trajectory]]\nspeed_mm_s = 150\nforce_n = 1.5\n"
    assert "each trajectory once in the recipe, got '150mms_1.5N' twice" in refusal_of(
        tmp_path, "[[trajectory]]", stroke + "[[trajectory]]"
    )
    model = '[[model]]\npath = "models"\n'
    assert "each model once in the recipe" in refusal_of(tmp_path, "[[model]]", model + "[[model]]")


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with refused(InputError, expected=tmp_path / "none.toml", got="nothing"):
        Recipe.load(tmp_path / "none.toml")
    with refused(InputError, expected=tmp_path, got="folder"):
        Recipe.load(tmp_path)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with refused(InputError, expected=["text", tmp_path / "bytes.toml"]):
        Recipe.load(tmp_path / "bytes.toml")
