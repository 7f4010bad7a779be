"""Many textures in one command: the same files whatever the number of jobs, broken ones named."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from tactileq.modeling import (
    Recording,
    RecordingSet,
    Simplification,
    TextureModel,
    Threshold,
    simplify,
)
from tactileq.stimuli.planted.textures import planted_texture, record_texture

AXES = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
ENDINGS = (".json", "_layers.tsv", "_spectra.tsv", "_provenance.json")
PICTURES = ("_spectra.png", "_layers.png")


def recorded(name: str) -> RecordingSet:
    """A planted texture on 2 × 2 conditions of half a second at the model rate."""
    return record_texture(planted_texture(name, **AXES), duration_s=0.5)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def colours_in(path: Path) -> int:
    """How many different colours a picture holds: an empty one has few."""
    return len(Image.open(path).convert("RGB").getcolors(maxcolors=2**24))


@pytest.fixture
def three(tmp_path: Path) -> Path:
    """A folder of two recording sets, one of them with two textures, and a stray file."""
    folder = tmp_path / "recordings"
    recorded("canvas").save(folder / "canvas")
    both = [*recorded("MDF").recordings, *recorded("wall paper").recordings]
    RecordingSet(both).save(folder / "others")
    (folder / "notes.txt").write_text("recorded on Monday")
    return folder


@pytest.mark.long("whole textures, twice")
def test_one_job_and_several_write_the_same_bytes(main, run, three: Path) -> None:
    one = main("model", three, "--out", "by-1")  # adds --jobs 1
    two = run("model", three / "canvas", three / "others", "--jobs", 2, "--out", "by-2")
    for done in (one, two):
        assert done.returncode == 0, done.stderr
        assert "3/3" in done.stdout
        told = [line for line in done.stdout.splitlines() if "(simulated): " in line]
        assert [line.split(" (")[0] for line in told] == ["canvas", "MDF", "wall paper"]
    written = contents(three.parent / "by-1")
    assert written == contents(three.parent / "by-2")
    stems = ("canvas", "MDF", "wall-paper")
    assert set(written) == {s + ending for s in stems for ending in ENDINGS}


def test_pictures_are_drawn_on_request(main, three: Path) -> None:
    assert main("model", three / "canvas", "--plot", "--out", "drawn").returncode == 0
    drawn = three.parent / "drawn"
    assert set(contents(drawn)) == {"canvas" + ending for ending in ENDINGS + PICTURES}
    for picture in PICTURES:
        assert colours_in(drawn / f"canvas{picture}") > 20


def test_a_model_of_many_is_the_model_of_one(main, three: Path) -> None:
    assert main("model", three, "--out", "many").returncode == 0
    recorded("wall paper").save(three.parent / "alone")
    assert main("model", "alone", "--out", "one").returncode == 0
    many, one = (three.parent / folder / "wall-paper.json" for folder in ("many", "one"))
    assert many.read_bytes() == one.read_bytes()


def break_recordings(folder: Path) -> dict[str, str]:
    """Five textures that cannot be modelled, and what is to be said of each."""
    noise = np.random.default_rng(3).normal(0, 0.1, 3000)

    def save(name: str, samples, **labels: float) -> Path:
        at = {"speed_mm_s": 100.0, "force_n": 1.0} | labels
        RecordingSet([Recording(samples, 5000.0, at["speed_mm_s"], at["force_n"], name)]).save(
            folder / name
        )
        return folder / name

    (save("lost", noise) / "0001.csv").unlink()
    (save("nan", noise) / "0001.csv").write_text("acceleration_g\n" + "0.1\nnan\n" * 100)
    save("still", noise, speed_mm_s=0.0)
    table = save("mislabelled", noise) / "recordings.tsv"
    table.write_text(table.read_text().replace("\t100.0\t", "\tfast\t"))
    RecordingSet([Recording(noise[:100], 22704.0, 100.0, 1.0, "short")]).save(folder / "short")
    (save("headless", noise) / "recordings.tsv").write_text("file\n0001.csv\n")
    return {
        "lost": "got nothing there",
        "nan": "expected finite samples",
        "still": "expected recordings with a speed and a force above 0",
        "mislabelled": "got 'fast'",
        "short": "expected at least 64 samples",
        "headless": "expected the columns file, texture",
    }


def test_broken_textures_are_named_and_the_others_modelled(main, three: Path) -> None:
    broken = break_recordings(three)
    done = main("model", three, "--out", "models")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    *sentences, summary = done.stderr.splitlines()
    assert len(sentences) == len(broken)
    for name, words in broken.items():
        (sentence,) = [line for line in sentences if f"{three / name}: " in line]
        assert sentence.startswith("error: ")
        assert words in sentence
    assert summary.startswith("error: expected 9 textures that can be modelled, got 6 that cannot")
    assert all(name in summary for name in broken)
    expected = {s + ending for s in ("canvas", "MDF", "wall-paper") for ending in ENDINGS}
    assert set(contents(three.parent / "models")) == expected
    assert TextureModel.load(three.parent / "models/canvas.json").texture == "canvas"


def test_one_texture_of_a_folder_may_be_broken(main, three: Path) -> None:
    table = pd.read_csv(three / "others/recordings.tsv", sep="\t")
    for file in table.file[table.texture == "MDF"]:
        (three / "others" / file).write_text("")
    done = main("model", three / "others", "--out", "models")
    assert done.returncode == 1
    assert "error: MDF in " in done.stderr
    assert "got 1 that cannot (MDF in " in done.stderr
    assert {path.stem for path in (three.parent / "models").glob("*.json")} == {
        "wall-paper",
        "wall-paper_provenance",
    }


def test_two_textures_of_one_file_name_are_refused_before_any_work(main, three: Path) -> None:
    recorded("canvas").save(three / "again")
    refused = main("model", three, "--out", "models")
    assert refused.returncode == 1
    assert "expected each texture once" in refused.stderr
    assert refused.stderr.count("\n") == 1
    for folder in ("again", "canvas"):
        assert str(three / folder) in refused.stderr
    assert not (three.parent / "models").exists()


def test_a_texture_without_a_grid_gets_tables_and_no_model(main, three: Path) -> None:
    line = RecordingSet(r for r in recorded("PVC") if r.condition in ((100.0, 1.0), (300.0, 3.0)))
    line.save(three / "PVC")
    done = main("model", three / "PVC", "--plot", "--out", "models")
    assert done.returncode == 0, done.stderr
    assert "no full model of PVC: expected recordings that span the grid, got 2 of 4" in done.stdout
    names = {path.name for path in (three.parent / "models").glob("PVC*")}
    endings = ("_alone.tsv", "_spectra.tsv", "_spectra.png", "_provenance.json")
    assert names == {"PVC" + ending for ending in endings}


def test_clipping_is_told_for_each_texture(main, tmp_path: Path) -> None:
    loud = np.clip(np.random.default_rng(0).standard_normal(5000), -1, 1)
    for name in ("oak", "elm"):
        RecordingSet([Recording(loud, 5000.0, 100.0, 1.0, name)]).save(tmp_path / "set" / name)
    done = main("model", "set")
    assert done.returncode == 0
    warnings = done.stderr.splitlines()
    assert [line.split(" at ")[0] for line in warnings] == ["warning: elm", "warning: oak"]


def test_simplify_says_where_nothing_is_left_to_compare(main, tmp_path: Path) -> None:
    full = planted_texture("PVC")
    full.save(tmp_path / "PVC.json")
    done = main("simplify", "PVC.json", "--out", "fewer")
    assert done.returncode == 0, done.stderr
    assert "identical" not in done.stdout
    saved = Simplification.load(tmp_path / "fewer/PVC_simplification.json")
    assert saved == simplify(full, Threshold.shipped("codec"))
    assert saved.model == TextureModel.load(tmp_path / "fewer/PVC.json")
    table = pd.read_csv(tmp_path / "fewer/PVC_layers.tsv", sep="\t")
    assert set(table["full_sha256"]) == {full.sha256}
    assert set(table["threshold_sha256"]) == {saved.threshold.sha256}
    # The model that is left has no layer that could go.
    again = main("simplify", "fewer/PVC.json", "--out", "fewest")
    assert "PVC: the simplified model is identical to the full one" in again.stdout
    assert Simplification.load(tmp_path / "fewest/PVC_simplification.json").identical


def test_simplify_draws_the_condition_that_was_asked_for(main, three: Path) -> None:
    assert main("model", three / "canvas", "--out", "models").returncode == 0
    simplify = ("simplify", "models/canvas.json", "--out", "fewer")
    picture = three.parent / "fewer/canvas_threshold.png"
    assert main(*simplify).returncode == 0
    assert not picture.exists()
    seen = set()
    for options in (
        (),
        ("--recordings", three),
        ("--recordings", three / "canvas"),
        ("--speed", 150, "--force", 2),
    ):
        done = main(*simplify, "--plot", *options)
        assert done.returncode == 0, done.stderr
        assert colours_in(picture) > 20
        seen.add(picture.read_bytes())
    assert len(seen) == 3  # the folder of the set and the folder above it mean the same
    before = contents(three.parent / "fewer")
    for options, sentence in (
        (("--speed", 150), "expected --plot with"),
        (("--plot", "--speed", 500), "expected a condition within the grid"),
        (("--plot", "--speed", 150, "--recordings", three), "choose a recorded condition"),
        (("--plot", "--recordings", three / "others"), "expected recordings of 'canvas'"),
    ):
        refused = main(*simplify, *options)
        assert refused.returncode == 1
        assert sentence in refused.stderr
        assert refused.stderr.count("\n") == 1
    assert contents(three.parent / "fewer") == before


def test_layers_check_and_alone(main, tmp_path: Path) -> None:
    """A prescribed number of layers; conditions predicted; each recording by itself."""
    axes = {"speeds_mm_s": np.array([100.0, 200.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
    truth = planted_texture("canvas", **axes)
    record_texture(truth, duration_s=0.5).save(tmp_path / "set")
    done = main("model", "set", "--layers", 2, "--check", "--alone", "--out", "models")
    assert done.returncode == 0, done.stderr
    assert TextureModel.load(tmp_path / "models/canvas.json").n_layers == 2
    assert "canvas: the same by a field of spectra, no layers: log-spectral" in done.stdout
    predicted = pd.read_csv(tmp_path / "models/canvas_check.tsv", sep="\t")
    # Six conditions, four of them corners.
    assert list(zip(predicted.speed_mm_s, predicted.force_n, strict=True)) == [(200, 1), (200, 3)]
    assert predicted.simulated.all()
    assert np.isfinite(predicted.level_error_db).all()
    alone = pd.read_csv(tmp_path / "models/canvas_alone.tsv", sep="\t")
    assert len(alone.groupby(["speed_mm_s", "force_n"])) == 6
    provenance = json.loads((tmp_path / "models/canvas_provenance.json").read_text())
    assert provenance["settings"]["layers"] == 2
    for options, sentence in (
        (("--layers", 13), "expected 1 to 12 layers with the estimator joint, got 13"),
        (("--layers", 2, "--estimator", "paper"), "got 2 with paper"),
    ):
        refused = main("model", "set", *options, "--out", "others")
        assert refused.returncode == 1
        assert sentence in refused.stderr
        assert not (tmp_path / "others").exists()


def test_hum_is_taken_out_with_a_warning_and_kept_on_request(main, tmp_path: Path) -> None:
    time = np.arange(5000) / 5000.0
    hum = 0.5 * np.sin(2 * np.pi * 60 * time)
    rng = np.random.default_rng(1)
    RecordingSet(
        Recording(rng.normal(0, 0.1, 5000) + hum, 5000.0, v, f, "oak")
        for v in (100.0, 200.0)
        for f in (1.0, 2.0)
    ).save(tmp_path / "set")
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    [warning] = done.stderr.splitlines()
    assert warning.startswith("warning: ")
    assert "and 3 more: mains hum at 60 Hz removed." in warning
    kept = main("model", "set", "--keep-hum", "--out", "kept")
    assert "pure tone of 0.35" in kept.stderr
    without, with_it = (
        TextureModel.load(tmp_path / folder / "oak.json") for folder in ("models", "kept")
    )
    assert without.n_layers == 0
    assert np.abs(with_it.frequencies_hz - 60).min(axis=-1) == pytest.approx(0, abs=1)


def test_unusable_recordings_of_a_texture_are_named_and_left_out(main, tmp_path: Path) -> None:
    axes = {"speeds_mm_s": np.array([100.0, 200.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
    truth = planted_texture("canvas", **axes)
    record_texture(truth, duration_s=0.5).save(tmp_path / "set")
    table = pd.read_csv(tmp_path / "set/recordings.tsv", sep="\t")
    dead = table.file[(table.speed_mm_s == 200) & (table.force_n == 1)].item()
    rows = (tmp_path / "set" / dead).read_text().splitlines()
    silent = [rows[0], *["0.0"] * (len(rows) - 1)]
    (tmp_path / "set" / dead).write_text("\n".join(silent) + "\n")
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    assert "warning: canvas: left out: " in done.stderr
    assert "expected a vibration, got the constant value 0" in done.stderr
    model = TextureModel.load(tmp_path / "models/canvas.json")
    assert model.interpolated.tolist() == [[False, False], [True, False], [False, False]]


def test_above_the_thresholds_end(main, tmp_path: Path) -> None:
    """Its last level is held as a lower bound unless only what is known may count."""
    model = planted_texture("canvas", **AXES)
    high = replace(model, frequencies_hz=model.frequencies_hz + 600, gains=1e-4 * model.gains)
    high.save(tmp_path / "high.json")
    for options, left, verdict in (
        ((), 1, "assumed"),  # the last layer is kept
        (("--known-only",), model.n_layers, "no threshold known"),
    ):
        done = main("simplify", "high.json", *options, "--out", "fewer")
        assert done.returncode == 0, done.stderr
        assert TextureModel.load(tmp_path / "fewer/canvas.json").n_layers == left
        told = (tmp_path / "fewer/canvas_layers.tsv").read_text()
        assert verdict in told
