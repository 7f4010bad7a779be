"""Each command in turn: it reads no file that its results do not name as an input."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.modeling import regressed
from tactileq.stimuli.planted.textures import planted_texture, record_texture
from tests.conftest import _hatt_xml
from tests.end_to_end.conftest import CLAIM
from tests.end_to_end.test_mutated_files import GRID, TEXTURE, write_good_files
from tests.end_to_end.test_vibrator_command import record as record_noise
from tests.experiments.tasks.planted_threshold import rows_of, write_answers
from tests.experiments.tasks.test_threshold_table import answers
from tests.opened import compared_with_provenance
from tests.two_surfaces import save_two_surfaces

STROKES = ("--speed", 100, "--force", 1)
CHART = ("bench", "chart", "--method", "AR(6)", "--jobs", 1)
SCENE_STUDY = """
name = "A scene"
seed = 3
textures = ["wall paper", "MDF"]
[models]
full = "full"
compiled = "recorded.toml"
[trays]
"wall paper" = "A"
MDF = "B"
[absolute]
participants = 2
schedule = "interleaved"
training_trials = 1
models = ["full", "compiled"]
"""
OWN_SCENE = """
version = 1
scene = {name = "own", models = "full"}
hand = {speed_mm_s = [100, 250], force_n = [1, 2.5]}
"""
COMMANDS: dict[str, tuple[object, ...]] = {
    "model": ("model", "wet/canvas", "--plot"),
    "many models": ("model", "wet"),
    "simplify": ("simplify", "model.json", "--threshold", "threshold.tsv", "--out", "fewer"),
    "a picture of recordings": (
        *("simplify", "model.json", "--plot", "--recordings", "wet", "--out", "fewer"),
    ),
    "scene": ("scene", "scene.toml", "--models", "full", "--out", "least"),
    "scene of a recorded hand": ("scene", "recorded.toml", "--models", "full", "--out", "least"),
    "stimuli of a recipe": ("stimuli", "set.toml", "--out", "new"),
    "stimuli of a scene": ("stimuli", "scene-set.toml", "--out", "new"),
    "stimuli of a model": ("stimuli", "model.json", "--vibrator", "vibrator.json", "--out", "new"),
    "vibrator": ("vibrator", "noise.wav", "--out", "found.json", "--plot", "found.png"),
    "header": ("export", "c", "model.json", "--vibrator", "vibrator.json"),
    "wav": ("export", "wav", "model.json", *STROKES, "--vibrator", "vibrator.json"),
    "json": ("export", "json", "model.json", *STROKES),
    "import wav": (
        *("import", "wav", "a.wav", "--labels", "labels.tsv", "--g-per-fullscale", 2),
        *("--texture", "oak", "--out", "new"),
    ),
    "import csv": (
        *("import", "csv", "run.csv", *STROKES, "--texture", "oak", "--axis", "x", "--out", "new"),
    ),
    "import hatt": ("import", "hatt", "Models_Planted.xml", *STROKES, "--yes", "--out", "new"),
    "record on a recorder": (
        *("record", "new", "--recorder", "recorder.toml", "--texture", "canvas"),
        *("--duration", 0.2, "--grid", "grid.toml"),
    ),
    "plan": ("study", "plan", "two/study.toml", "--out", "plan.md"),
    "power": (
        *("power", "two/study.toml", "--subjects", 4, "--simulations", 10, "--jobs", 1),
        *("--threshold", "threshold.tsv", "--effect", "magnitude_similarity=0"),
    ),
    "simulate": (
        *("simulate", "--study", "two/study.toml", "--data", "new"),
        *("--threshold", "threshold.tsv"),
    ),
    "simulate a scene": ("simulate", "--study", "scenes.toml", "--data", "new"),
    "simulate a scene of other models": ("simulate", "--study", "own.toml", "--data", "new"),
    "threshold": ("threshold", "--data", "felt", "--out", "mine.tsv"),
    "tables": (
        *("analyze", "--table", "answers.csv"),
        *("--map", "participant=who,correct=right,factor=size"),
    ),
    "a later plan": ("analyze", "asked", "--plan", "two/study.toml", "--out", "new"),
    "chart of recordings": (*CHART, "--recordings", "wet/canvas", "--models", "of-canvas"),
    "chart of a toolkit": (*CHART, "--toolkit", "Models_Planted.xml"),
}


def _every_kind(folder: Path) -> Path:
    """A good file of each kind, and what rests on several."""
    write_good_files(folder, _hatt_xml())
    (folder / "full").mkdir()
    for model in (TEXTURE, planted_texture("MDF", **GRID)):
        model.save(folder / f"full/{model.texture}.json")
    larger = {"speeds_mm_s": np.array([50.0, 150.0, 350.0]), "forces_n": np.array([0.5, 1.5, 3.5])}
    for name, grid in ((TEXTURE.texture, GRID), ("canvas", larger)):
        model = planted_texture(name, **grid)
        record_texture(model, duration_s=0.3).save(folder / f"wet/{name}")
    (folder / "of-canvas").mkdir()
    model.save(folder / "of-canvas/canvas.json")
    (folder / "two").mkdir()
    save_two_surfaces(folder / "two")
    study = folder / "two/study.toml"
    study.write_text(study.read_text().replace("[trays]", 'texts = "en.toml"\n[trays]') + CLAIM)
    (folder / "two/en.toml").write_text('rest.title = "Put down the pen"')
    (folder / "scenes.toml").write_text(SCENE_STUDY)
    (folder / "own-scene.toml").write_text(OWN_SCENE)
    own = SCENE_STUDY.replace("recorded.toml", "own-scene.toml")
    (folder / "own.toml").write_text(own.replace('full = "full"', 'full = "driven"'))
    for model in (TEXTURE, planted_texture("MDF", **GRID)):
        (folder / "driven").mkdir(exist_ok=True)
        regressed(model).save(folder / f"driven/{model.texture}.json")
    record_noise(folder / "noise.wav")
    felt = [answers(f, db) for f, db in ((20.0, -30.0), (250.0, -40.0))]
    write_answers(folder / "felt", 1, rows_of([*felt[0], *felt[1]]))
    return folder


@pytest.fixture
def here(once_per_run: Any, simulated: Path, tmp_path: Path) -> Path:
    """A copy of all files, where commands run."""
    kept = once_per_run("files-of-every-kind", _every_kind)
    shutil.copytree(simulated, tmp_path / "asked")
    return Path(shutil.copytree(kept, tmp_path, dirs_exist_ok=True))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_reads_what_its_results_name(
    main: Any, here: Path, monkeypatch: pytest.MonkeyPatch, undrawn: None, name: str
) -> None:
    with compared_with_provenance(here, monkeypatch):
        done = main(*COMMANDS[name])
        assert done.returncode == 0, done.stderr
