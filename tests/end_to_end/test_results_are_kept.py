"""No command destroys what another command, or a user, put in its way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from modeling import Recording, RecordingSet, TextureModel
from stimuli.planted.textures import planted_texture, record_texture

SMALL_STUDY = """
name = "small"
seed = 3
textures = ["canvas", "MDF"]
[absolute]
participants = 2
schedule = "interleaved"
[relative]
participants = 2
schedule = "by-day"
[trays]
canvas = "A"
MDF = "B"
"""


def grid(name: str) -> RecordingSet:
    """A planted texture on 2 × 2 conditions."""
    axes = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
    return record_texture(planted_texture(name, **axes), duration_s=0.5)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_record_does_not_replace_recordings(run, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(0, 0.1, 500)
    RecordingSet([Recording(noise, 5000.0, 100, 1, "oak")]).save(tmp_path / "oak")
    before = contents(tmp_path / "oak")
    refused = run("record", "oak", "--texture", "canvas")
    assert refused.returncode == 1
    assert "expected a new folder" in refused.stderr
    assert contents(tmp_path / "oak") == before


def test_demo_does_not_replace_a_study(main, tmp_path: Path) -> None:
    (tmp_path / "study/data").mkdir(parents=True)
    (tmp_path / "study/data/answers.tsv").write_text("from people")
    refused = main("demo", "--out", "study")
    assert refused.returncode == 1
    assert "earlier results of tactileq demo" in refused.stderr
    assert contents(tmp_path / "study") == {"data/answers.tsv": b"from people"}


def test_models_of_two_textures_stand_side_by_side(main, tmp_path: Path) -> None:
    for name in ("canvas", "MDF"):
        grid(name).save(tmp_path / name)
        assert main("model", name, "--out", "models").returncode == 0
    names = {p.name for p in (tmp_path / "models").iterdir()}
    endings = ("_layers.tsv", "_spectra.tsv", "_provenance.json", ".json")
    assert names == {name + ending for name in ("canvas", "MDF") for ending in endings}


def test_full_and_simplified_models_do_not_replace_each_other(main, tmp_path: Path) -> None:
    grid("canvas").save(tmp_path / "canvas")
    assert main("model", "canvas", "--out", "models").returncode == 0
    full = TextureModel.load(tmp_path / "models/canvas.json")
    assert main("simplify", "models/canvas.json", "--out", "fewer").returncode == 0
    over_full = main("simplify", "fewer/canvas.json", "--out", "models")
    over_simplified = main("model", "canvas", "--out", "fewer")
    for refused in (over_full, over_simplified):
        assert refused.returncode == 1
        assert "expected a folder without models of another command" in refused.stderr
    assert TextureModel.load(tmp_path / "models/canvas.json") == full


@pytest.fixture
def study(main, tmp_path: Path) -> Path:
    """A small simulated study, from recordings to answers, in `tmp_path`."""
    (tmp_path / "study.toml").write_text(SMALL_STUDY)
    for name in ("canvas", "MDF"):
        grid(name).save(tmp_path / "recordings" / name)
        assert main("model", f"recordings/{name}", "--out", "models").returncode == 0
        made = main("simplify", f"models/{name}.json", "--out", "simplified", "--margin-db", 3)
        assert made.returncode == 0
    simulated = main("simulate", "--study", "study.toml", "--data", "data")
    assert simulated.returncode == 0, simulated.stderr
    return tmp_path


def test_analysis_holds_to_the_models_that_were_presented(main, study: Path) -> None:
    folders = ["--recordings", "recordings", "--models", "models", "--simplified", "simplified"]
    same = main("analyze", "data", *folders)
    assert same.returncode == 0, same.stderr
    assert Path(same.stdout.splitlines()[-1]) == study / "analysis-results/report.html"
    planted_texture("canvas").save(study / "simplified/canvas.json")
    refused = main("analyze", "data", *folders)
    assert refused.returncode == 1
    assert "to come from the full one in --models, got one of another model" in refused.stderr
    again = main("simplify", "models/canvas.json", "--threshold", "pen-hold", "--out", "simplified")
    assert again.returncode == 0, again.stderr
    refused = main("analyze", "data", *folders)
    assert "the simplified model of canvas that was presented (SHA-256" in refused.stderr
    (study / "simplified/canvas_simplification.json").unlink()
    refused = main("analyze", "data", *folders)
    assert "why layers of canvas were dropped" in refused.stderr
    (study / "models/canvas.json").unlink()
    refused = main("analyze", "data", *folders)
    assert "a full model of each texture in the answers, got none of canvas" in refused.stderr
    partial = main("analyze", "data", "--models", "models")
    assert "give all three or none" in partial.stderr


def test_a_new_analysis_replaces_the_whole_old_one(main, study: Path) -> None:
    folders = ["--recordings", "recordings", "--models", "models", "--simplified", "simplified"]
    assert main("analyze", "data", *folders).returncode == 0
    assert (study / "analysis-results/tables/gfc.tsv").is_file()
    assert main("analyze", "data").returncode == 0
    assert not (study / "analysis-results/tables/gfc.tsv").exists()
    before = contents(study / "analysis-results")
    refused = main("analyze", "nowhere")
    assert refused.returncode == 1
    assert contents(study / "analysis-results") == before
    (study / "analysis-results/notes.txt").write_text("mine")
    refused = main("analyze", "data")
    assert "notes.txt" in refused.stderr
    assert (study / "analysis-results/notes.txt").read_text() == "mine"


def test_provenance_names_seed_settings_and_inputs(main, study: Path) -> None:
    import json

    note = json.loads((study / "data/sourcedata/simulate_provenance.json").read_text())
    assert note["seed"] == 0
    assert note["settings"]["threshold"] == "codec"
    assert note["settings"]["study"]["name"] == "small"
    assert set(note["inputs_sha256"]) == {"models", "simplified"}
    assert all(len(digest) == 64 for digest in note["inputs_sha256"].values())
