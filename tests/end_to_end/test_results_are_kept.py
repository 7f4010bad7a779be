"""No command destroys what another command, or a user, put in its way."""

from __future__ import annotations

import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import Recording, RecordingSet, TextureModel
from tactileq.modeling.files.provenance import provenance_of, seal_folder
from tactileq.stimuli.planted.textures import planted_texture, record_texture

# A threshold below which the fine layers of the planted textures lie.
INSENSITIVE = "# source: test\n# caveat: none\nfrequency_hz\tacceleration_g\n10\t0.2\n600\t0.2\n"


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
    for refused, other in ((over_full, "model"), (over_simplified, "simplify")):
        assert refused.returncode == 1
        assert f"canvas.json, got one of tactileq {other}; choose" in refused.stderr
    assert TextureModel.load(tmp_path / "models/canvas.json") == full


@pytest.fixture(scope="module")
def made_once(tmp_path_factory) -> Path:
    """Where the first test that needs the study leaves it for the others."""
    return tmp_path_factory.mktemp("study") / "made"


@pytest.fixture
def study(main, tmp_path: Path, small_study: str, made_once: Path) -> Path:
    """A small simulated study, from recordings to answers, in `tmp_path`."""
    if made_once.exists():
        return shutil.copytree(made_once, tmp_path, dirs_exist_ok=True)
    (tmp_path / "study.toml").write_text(small_study)
    (tmp_path / "insensitive.tsv").write_text(INSENSITIVE)
    for name in ("canvas", "MDF"):
        grid(name).save(tmp_path / "recordings" / name)
        assert main("model", f"recordings/{name}", "--out", "models").returncode == 0
        fewer = ("--threshold", "insensitive.tsv", "--out", "simplified")
        made = main("simplify", f"models/{name}.json", *fewer)
        assert made.returncode == 0
    simulated = main("simulate", "--study", "study.toml", "--data", "data")
    assert simulated.returncode == 0, simulated.stderr
    shutil.copytree(tmp_path, made_once)
    return tmp_path


@pytest.mark.usefixtures("undrawn")
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


@pytest.mark.usefixtures("undrawn")
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
    note = json.loads((study / "data/sourcedata/simulate_provenance.json").read_text())
    assert note["seed"] == 0
    assert note["settings"]["threshold"] == "codec"
    assert note["settings"]["study"]["name"] == "small"
    assert set(note["inputs_sha256"]) == {"models", "simplified", "study.toml"}
    assert all(len(digest) == 64 for digest in note["inputs_sha256"].values())


FOREIGN = {
    "a file beside figures": "figures/mine.png",
    "a file in a new folder": "figures/mine/photo.png",
    "a folder": "mine/",
}


@pytest.mark.parametrize(
    "command",
    [
        *("analyze data", "demo", "bench render", "bench chart", "stability", "scene light.toml"),
        "power study.toml",
    ],
)
@pytest.mark.parametrize("foreign", FOREIGN.values(), ids=FOREIGN)
def test_folders_with_one_foreign_file_are_not_replaced(
    main, tmp_path: Path, command: str, foreign: str
) -> None:
    made = tmp_path / "made"
    (made / "figures").mkdir(parents=True)
    (made / "figures/a.png").write_bytes(b"ours")
    whose = re.sub(" (data|[a-z]+.toml)$", "", command)
    seal_folder(made, provenance_of(whose, {}))
    path = made / foreign
    if foreign.endswith("/"):
        path.mkdir()
    else:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"theirs")
    before = sorted(made.rglob("*"))
    refused = main(*command.split(), "--out", "made")
    assert refused.returncode == 1
    named = foreign if path.parent == made / "figures" else f"{Path(foreign).parent}/"
    assert f"a folder with other files in it ({named.removeprefix('./')}" in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert sorted(made.rglob("*")) == before


def test_folders_of_another_command_or_of_none_are_not_replaced(main, tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    (tmp_path / "made/a.png").write_bytes(b"ours")
    for provenance in ({"command": "tactileq demo"}, provenance_of("analyze", {})):
        seal_folder(tmp_path / "made", provenance)
        refused = main("bench", "render", "--out", "made")
        assert "a folder with other files in it (a.png)" in refused.stderr
    (tmp_path / "made/provenance.json").write_text('{"command": "tactileq bench render"}')
    refused = main("bench", "render", "--out", "made")  # by a version that listed no files
    assert "a folder with other files in it (a.png)" in refused.stderr
    assert (tmp_path / "made/a.png").read_bytes() == b"ours"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A planted model at models/canvas.json."""
    planted_texture("canvas").save(tmp_path / "models/canvas.json")
    return tmp_path / "models/canvas.json"


def test_simplify_does_not_overwrite_its_input(main, tmp_path: Path, model: Path) -> None:
    before = contents(tmp_path)
    refused = main("simplify", "models/canvas.json", "--out", "models")
    assert "got models/canvas.json, which is the input itself" in refused.stderr
    for link in ("hard", "soft"):
        (tmp_path / link).mkdir()
    os.link(model, tmp_path / "hard/canvas.json")
    (tmp_path / "soft/canvas.json").symlink_to(model)
    for out in (".", "hard", "soft", "models/../models"):
        source = tmp_path / "canvas.json" if out == "." else model
        if out == ".":
            shutil.copy(model, source)
        refused = main("simplify", source, "--out", out)
        assert refused.returncode == 1
        assert "which is the input itself" in refused.stderr
    assert (tmp_path / "soft/canvas.json").is_symlink()
    assert before.items() <= contents(tmp_path).items()
    assert main("simplify", model, "--out", "fewer").returncode == 0
    before = contents(tmp_path)
    again = main("simplify", "fewer/canvas.json", "--out", "fewer")
    assert "which is the input itself" in again.stderr
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    "ending",
    [".json", "_simplification.json", "_layers.tsv", "_threshold.png", "_provenance.json"],
)
def test_simplify_does_not_overwrite_what_others_wrote(
    main, tmp_path: Path, model: Path, ending: str
) -> None:
    (tmp_path / "fewer").mkdir()
    (tmp_path / f"fewer/canvas{ending}").write_text("{}")
    before = contents(tmp_path)
    refused = main("simplify", model, "--out", "fewer")
    assert refused.returncode == 1
    assert f"at fewer/canvas{'' if ending == '_provenance.json' else ending}" in refused.stderr
    assert contents(tmp_path) == before


def test_simplify_replaces_its_own_results_and_no_namesakes(main, tmp_path: Path) -> None:
    for file, name in (("1", "a b"), ("2", "a-b")):
        replace(planted_texture("canvas"), texture=name).save(tmp_path / f"{file}.json")
    assert main("simplify", "1.json", "--out", "fewer", "--plot").returncode == 0
    done = main("simplify", "1.json", "--out", "fewer", "--margin-db", 3)
    assert done.returncode == 0, done.stderr
    listed = json.loads((tmp_path / "fewer/a-b_provenance.json").read_text())["files"]
    endings = (".json", "_layers.tsv", "_simplification.json", "_threshold.png")
    assert listed == [f"a-b{ending}" for ending in endings]
    before = contents(tmp_path)
    refused = main("simplify", "2.json", "--out", "fewer")
    assert refused.returncode == 1
    assert "for 'a-b' at fewer/a-b.json, got one for 'a b'" in refused.stderr
    assert contents(tmp_path) == before


def test_model_does_not_overwrite_namesakes_or_what_others_wrote(main, tmp_path: Path) -> None:
    records = grid("canvas")
    for folder, name in (("1", "a b"), ("2", "a-b")):
        of_name = [replace(recording, texture=name) for recording in records]
        RecordingSet(of_name).save(tmp_path / folder)
    for _ in range(2):
        assert main("model", "1", "--out", "models", "--layers", 1).returncode == 0
    before = contents(tmp_path)
    refused = main("model", "2", "--out", "models")
    assert "for 'a-b' at models/a-b.json, got one for 'a b'" in refused.stderr
    assert contents(tmp_path) == before
    (tmp_path / "models/a-b_check.tsv").write_text("mine")
    before = contents(tmp_path)
    refused = main("model", "1", "--out", "models")
    assert "at models/a-b_check.tsv, got something else" in refused.stderr
    assert contents(tmp_path) == before


def test_exports_replace_their_own_files_alone(main, tmp_path: Path, model: Path) -> None:
    replace(planted_texture("canvas"), texture="MDF").save(tmp_path / "MDF.json")
    for _ in range(2):
        assert main("export", "json", model, "--out", "x.json").returncode == 0
    before = contents(tmp_path)
    refused = main("export", "json", "MDF.json", "--out", "x.json")
    assert "for 'MDF' at x.json, got one for 'canvas'" in refused.stderr
    refused = main("export", "wav", model, "--speed", 1, "--force", 1, "--out", "x.json")
    assert "at x.json, got one of tactileq export json" in refused.stderr
    (tmp_path / "y.json_provenance.json").write_text('{"mine": 1}')
    refused = main("export", "json", model, "--out", "y.json")
    assert "at y.json_provenance.json, got something else" in refused.stderr
    assert before.items() <= contents(tmp_path).items()
    assert not (tmp_path / "y.json").exists()


def test_a_full_disk_leaves_no_part_of_a_model(
    main, tmp_path: Path, model: Path, file_size_limit
) -> None:
    assert main("simplify", model, "--out", "fewer").returncode == 0
    before = contents(tmp_path)
    with file_size_limit(3000):
        refused = [main("simplify", model, "--out", out) for out in ("fewer", "new")]
    for out, done in zip(("fewer", "new"), refused, strict=True):
        assert done.returncode == 1
        assert done.stderr.startswith(f"error: expected to read or write {out}/canvas")
        assert done.stderr.count("\n") == 1
        assert done.stdout == ""
    assert contents(tmp_path) == before
    assert not any((tmp_path / "new").iterdir())
