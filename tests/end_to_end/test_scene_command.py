"""`tactileq scene` as a user meets it: what it writes and tells, and what it refuses."""

from __future__ import annotations

import json
import subprocess
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.experiments.observers.experimenter import SimulatedExperimenter
from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import Psychometrics
from tactileq.experiments.observers.simulated import SimulatedParticipant
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.study import Study
from tactileq.modeling import Scene, TextureModel, Threshold, compile_scene
from tactileq.modeling.errors import counted
from tactileq.modeling.models.loading import load_models
from tactileq.modeling.scenes.compiled import load_compiled
from tactileq.stimuli.planted.textures import planted_texture

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
SCENE = """
version = 1
scene = {name = "light touch", textures = ["MDF"]}
hand = {speed_mm_s = [100, 300], force_n = [1, 3]}
"""
TABLES = {"before_after.tsv", "steps.tsv", "tradeoff.png", "scene.json", "provenance.json"}


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with two full models and a scene of one of them."""
    for name in ("MDF", "PVC"):
        planted_texture(name, **SMALL).save(tmp_path / f"models/{name}.json")
    (tmp_path / "light.toml").write_text(SCENE)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_scene_becomes_a_folder_of_least_models(main, place: Path) -> None:
    (place / "light.toml").write_text(SCENE.replace("MDF", "PVC"))  # of which a layer goes
    made = main("scene", "light.toml", "--out", "small")
    assert made.returncode == 0, made.stderr
    files = contents(place / "small")
    assert set(files) == {*TABLES, "PVC.json", "light-touch.h"}
    assert files["tradeoff.png"].startswith(b"\x89PNG")
    scene, full = Scene.load(place / "light.toml"), TextureModel.load(place / "models/PVC.json")
    least = load_compiled(place / "small", {"PVC": full})["PVC"]
    assert least.compiled_for is not None
    assert least.compiled_for.scene_sha256 == scene.sha256
    table = pd.read_csv(place / "small/before_after.tsv", sep="\t").set_index("texture")
    assert table.loc["PVC", "layers_after"] == least.n_layers < full.n_layers
    assert table.loc["PVC", "operations_after"] < table.loc["PVC", "operations_before"]
    assert "full model" in set(pd.read_csv(place / "small/steps.tsv", sep="\t").step)
    told = made.stdout
    assert f"PVC (simulated): {full.n_layers} → {counted(least.n_layers, 'layer')}" in told
    assert "the bound is kept in 60 of 60 windows of 1 s" in told
    assert told.endswith("operations per sample: small/before_after.tsv\n")
    # A later run replaces it, with the same bytes: no time of this machine is in them.
    assert main("scene", "light.toml", "--out", "small").returncode == 0
    assert contents(place / "small") == files


def test_provenance_names_all_that_a_scene_comes_from(main, place: Path) -> None:
    hand = "time_s,speed_mm_s,force_n\n0,100,1\n1,300,3\n2,100,1\n"
    (place / "hand.csv").write_text(hand)
    (place / "own.tsv").write_text(
        "# source: test\n# caveat: none\nfrequency_hz\tacceleration_g\n10\t0.1\n600\t0.1\n"
    )
    scene = 'name = "recorded", models = "models", threshold = "own.tsv", textures = ["MDF"]'
    (place / "recorded.toml").write_text(
        f'version = 1\nscene = {{{scene}}}\nhand.file = "hand.csv"\n'
    )
    made = main("scene", "recorded.toml", "--seed", 3)
    assert made.returncode == 0, made.stderr
    note = json.loads((place / "scene/provenance.json").read_text())
    assert set(note["inputs_sha256"]) == {"recorded.toml", "hand.csv", "own.tsv", "models"}
    assert (note["command"], note["seed"]) == ("tactileq scene", 3)
    assert note["settings"]["scene_sha256"] == Scene.load(place / "recorded.toml").sha256
    assert set(note["files"]) == {path.name for path in (place / "scene").iterdir()} - {
        "provenance.json"
    }


def test_models_come_from_the_option_or_the_scene_or_a_folder_of_that_name(
    main, place: Path
) -> None:
    (place / "models").rename(place / "full")
    refused = main("scene", "light.toml")
    assert "for the scene light touch, got none at models; name it as models" in refused.stderr
    assert main("scene", "light.toml", "--models", "full").returncode == 0
    (place / "deeper").mkdir()
    scene = SCENE.replace('"light touch"', '"light touch", models = "../full"')
    (place / "deeper/light.toml").write_text(scene)
    assert main("scene", "deeper/light.toml").returncode == 0
    refused = main("scene", "deeper/light.toml", "--models", "deeper")
    assert "expected model files in deeper, got none" in refused.stderr


def test_the_header_is_c_of_all_textures_at_one_rate(main, place: Path) -> None:
    both = SCENE.replace('["MDF"]', '["MDF", "PVC"]')
    (place / "light.toml").write_text(both)
    assert main("scene", "light.toml").returncode == 0
    text = (place / "scene/light-touch.h").read_text()
    assert "scene_light_touch_texture_MDF" in text
    assert f"SHA-256 {Scene.load(place / 'light.toml').sha256}" in " ".join(text.split())
    program = '#include "light-touch.h"\nint main(void) { return scene_light_touch_count - 2; }\n'
    (place / "scene/main.c").write_text(program)
    build = ["gcc", "-std=c99", "-Wall", "-Werror", "main.c", "-lm", "-o", "main"]
    subprocess.run(build, cwd=place / "scene", check=True)
    assert subprocess.run([place / "scene/main"], check=False).returncode == 0


def test_there_is_no_header_of_models_of_different_rates(main, place: Path) -> None:
    planted_texture("PVC", **SMALL).at_rate(8000.0).save(place / "models/PVC.json")
    (place / "light.toml").write_text(SCENE.replace('["MDF"]', '["MDF", "PVC"]'))
    made = main("scene", "light.toml")
    assert made.returncode == 0, made.stderr
    assert "note: no C header: models of different rates need a rate_hz" in made.stdout
    assert not list((place / "scene").glob("*.h"))
    (place / "light.toml").write_text(
        SCENE.replace('["MDF"]', '["MDF", "PVC"]') + "actuator.rate_hz = 8000\n"
    )
    assert main("scene", "light.toml").returncode == 0
    assert (place / "scene/light-touch.h").is_file()


def test_without_the_kernel_nothing_is_timed(main, place: Path, monkeypatch) -> None:
    monkeypatch.setattr("tactileq.modeling.rendering.compiled.is_compiled", lambda: False)
    made = main("scene", "light.toml")
    assert made.returncode == 0, made.stderr
    assert "note: without the compiled kernel no strokes are rendered" in made.stdout
    assert "windows" not in made.stdout


def test_only_own_results_are_replaced(main, place: Path) -> None:
    assert main("scene", "light.toml").returncode == 0
    (place / "scene/notes.txt").write_text("mine")
    before = contents(place / "scene")
    refused = main("scene", "light.toml")
    assert "a folder with other files in it (notes.txt)" in refused.stderr
    refused = main("scene", "light.toml", "--out", "models")
    assert "got a folder with other files in it (MDF.json)" in refused.stderr
    assert contents(place / "scene") == before


def test_a_full_disk_leaves_the_folder_as_it_was(main, place: Path, file_size_limit) -> None:
    assert main("scene", "light.toml").returncode == 0
    before = contents(place / "scene")
    with file_size_limit(3000):
        refused = [main("scene", "light.toml", "--out", out) for out in ("scene", "new")]
    for done, out in zip(refused, ("scene", "new"), strict=True):
        assert done.returncode == 1
        assert done.stderr.startswith(f"error: expected to read or write {out}")
        assert done.stderr.count("\n") == 1
    assert contents(place / "scene") == before
    assert not (place / "new").exists()


HAND = "hand = {speed_mm_s = [100, 300], force_n = [1, 3]}"
EDITS = {
    "outside the grid": (
        HAND,
        "hand = {speed_mm_s = [50, 300], force_n = [1, 3]}",
        "within 100…300 mm/s, where MDF was recorded, got 50…300 mm/s; narrow the scene",
    ),
    "no model": (
        '"MDF"',
        '"MDF", "silk"',
        "each texture of the scene light touch, got none of silk",
    ),
    "beyond any model": (HAND, f"{HAND}\nbound.gfc30 = 1.1", "for gfc30 under [bound], got 1.1"),
    "beyond the actuator": (
        HAND,
        f"{HAND}\nactuator.rms_g = 0.0001",
        "that the actuator's limits leave room for, got 1 dB",
    ),
    "contradictory budget": (
        HAND,
        f'{HAND}\nbudget = {{operations = 9, device = "stm32l432"}}',
        "operations or a device under [budget], got both",
    ),
    "contradictory range": (
        "[100, 300]",
        "[300, 100]",
        "the lowest speed_mm_s under [hand] before the highest, got 300 before 100",
    ),
    "two hands": (HAND, f'{HAND[:-1]}, file = "h.csv"}}', "expected one hand under [hand]"),
    "too small a budget": (
        HAND,
        f"{HAND}\nbudget.bytes = 16",
        "the scene light touch within 16 bytes, got one that takes",
    ),
    "unknown key": (HAND, f"{HAND}\nbound.gcf30 = 0.9", "expected only gfc30, bands_db, level_db"),
    "unknown section": (HAND, f"{HAND}\n[bounds]", "expected only version, scene, hand"),
    "no hand": (HAND, "", "expected a table [hand], got none"),
    "unknown device": (HAND, f'{HAND}\nbudget.device = "abacus"', "expected a micro-controller"),
}


@pytest.mark.parametrize("what", EDITS)
def test_what_is_refused(main, place: Path, what: str) -> None:
    old, new, sentence = EDITS[what]
    assert old in SCENE
    (place / "light.toml").write_text(SCENE.replace(old, new))
    before = sorted(place.rglob("*"))
    refused = main("scene", "light.toml")
    assert refused.returncode == 1
    assert sentence in refused.stderr
    assert refused.stderr.startswith("error: ")
    assert refused.stderr.count("\n") == 1, refused.stderr
    assert "Traceback" not in refused.stderr
    assert sorted(place.rglob("*")) == before


def test_models_of_another_kind_are_refused(main, place: Path) -> None:
    assert main("scene", "light.toml").returncode == 0
    refused = main("scene", "light.toml", "--models", "scene", "--out", "again")
    assert refused.returncode == 1
    assert "tactileq.texture-model" in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert not (place / "again").exists()


def test_textures_with_one_file_name_are_refused(main, place: Path) -> None:
    full = planted_texture("MDF", **SMALL)
    for file, name in (("1", "a b"), ("2", "a-b")):
        replace(full, texture=name).save(place / f"twins/{file}.json")
    (place / "light.toml").write_text(SCENE.replace('"MDF"', '"a b", "a-b"'))
    refused = main("scene", "light.toml", "--models", "twins")
    assert refused.returncode == 1
    assert "whose files have different names" in refused.stderr
    assert not (place / "scene").exists()


@pytest.fixture
def study(place: Path, small_study: str) -> Path:
    """A study of two textures, and a scene of both."""
    (place / "study.toml").write_text(small_study.replace("canvas", "PVC"))
    (place / "both.toml").write_text(SCENE.replace('["MDF"]', '["MDF", "PVC"]'))
    return place


def test_a_study_can_name_a_scene(main, study: Path) -> None:
    """By its file or its folder; the answers are the same."""
    made = main("scene", "both.toml")
    assert made.returncode == 0, made.stderr
    described = []
    for scene, data in (("both.toml", "a"), ("scene", "b")):
        done = main("simulate", "--study", "study.toml", "--data", data, "--scene", scene)
        assert done.returncode == 0, done.stderr
        note = json.loads((study / data / "sourcedata/simulate_provenance.json").read_text())
        assert set(note["inputs_sha256"]) == {"models", "study.toml", scene}
        assert note["settings"]["scene"] == "light touch"
        assert note["settings"]["scene_sha256"] == Scene.load(study / "both.toml").sha256
        described.append((study / data / "dataset_description.json").read_text())
    assert described[0] == described[1]
    least = load_compiled(study / "scene")
    presented = note["settings"]["models_sha256"]
    assert presented["MDF"]["simplified"] == least["MDF"].sha256


def test_a_session_presents_the_models_of_a_scene(
    main, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = load_models(study / "models")
    least = compile_scene(Scene.load(study / "both.toml"), full).models
    perception = Perception(
        Study.load(study / "study.toml"),
        real=full,
        models=ModelSets(sets={"full": full, "simplified": least}),
        threshold=Threshold.shipped("codec"),
    )
    someone = SimulatedParticipant(perception, Psychometrics(), seed=1, subject=1, occasion=(1,))
    monkeypatch.setattr(
        "tactileq.commands.study.session.open_console", lambda *_, **of: nullcontext(someone)
    )
    monkeypatch.setattr("tactileq.commands.study.experimenter.Terminal", SimulatedExperimenter)
    words = ("--task", "relative", "--subject", 1, "--study", "study.toml")
    done = main("session", *words, "--scene", "both.toml", "--data", "data")
    assert done.returncode == 0, done.stderr
    assert "completed: data/sourcedata/sub-01" in done.stdout
    (path,) = (study / "data/sourcedata").rglob("*_manifest.json")
    manifest = SessionManifest.load(path)
    assert manifest.model_sources == {"full": "models", "simplified": "both.toml"}
    presented = manifest.models_sha256
    assert {name: presented[name]["simplified"] for name in presented} == {
        name: model.sha256 for name, model in least.items()
    }


def test_studies_refuse_scenes_that_do_not_fit(main, study: Path) -> None:
    assert main("scene", "both.toml").returncode == 0
    session = ("session", "--task", "absolute", "--subject", 1, "--study", "study.toml")
    simulate = ("simulate", "--study", "study.toml", "--data", "data")
    before = sorted(study.rglob("*"))

    def refused(*words: object) -> str:
        done = main(*words)
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1, done.stderr
        assert sorted(study.rglob("*")) == before
        return str(done.stderr)

    for command in (session, simulate):
        both = refused(*command, "--scene", "both.toml", "--simplified", "fewer")
        assert "expected simplified models or a scene, got both (fewer and both.toml)" in both
        lacking = refused(*command, "--scene", "light.toml")
        assert "in the scene light touch, got none of PVC; add what is missing" in lacking
        assert "expected a compiled scene at" in refused(*command, "--scene", "models")
        assert "expected a scene at none.toml" in refused(*command, "--scene", "none.toml")
    full = TextureModel.load(study / "models/MDF.json")
    replace(full, estimator="another").save(study / "models/MDF.json")
    for command in (session, simulate):
        changed = refused(*command, "--scene", "scene")
        assert "got one that has changed since; compile the scene again" in changed
