"""StimulusRow sets: the files, and a manifest that tells the truth about them."""

from __future__ import annotations

import csv
import errno
import hashlib
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tactileq.modeling import InputError, TextureModel, Threshold, fit_ar, regressed
from tactileq.modeling.files.stimulus_table import STIMULUS_COLUMNS
from tactileq.modeling.perception.sensation_level import sensation_level
from tactileq.stimuli.planted.textures import planted_texture, record_texture
from tactileq.stimuli.sets import writing
from tactileq.stimuli.sets.manifest import StimulusRow
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel, TrajectoryEntry
from tactileq.stimuli.sets.rendering import fade_samples
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
MakeRecipe = Callable[..., Recipe]


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def manifest(folder: Path) -> list[dict[str, str]]:
    with (folder / "manifest.tsv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def steady_rms(path: Path, full_scale_g: float = 1.0) -> float:
    samples, rate_hz = soundfile.read(path, dtype="float64")
    fade = fade_samples(samples.size, rate_hz)
    return float(np.sqrt(np.mean((samples[fade : samples.size - fade] * full_scale_g) ** 2)))


def test_every_model_trajectory_seed_and_rate_has_its_file(
    tmp_path: Path, recipe: MakeRecipe
) -> None:
    seen: list[str] = []
    made = recipe(rates_hz=(5000, 8000), seeds=(4, 7))
    stimuli = write_set(tmp_path / "set", made, progress=seen.append)
    rows = manifest(tmp_path / "set")
    assert [row["file"] for row in rows] == seen == [s.file for s in stimuli]
    assert [(r["model"], r["trajectory"], r["seed"], r["rate_hz"]) for r in rows] == [
        (label, trajectory, seed, rate)
        for label in ("full", "simplified")
        for trajectory in ("100mms_1N", "250mms_2.5N")
        for seed in ("4", "7")
        for rate in ("5000", "8000")
    ]
    assert seen[1] == "wall-paper_full_100mms_1N_seed4_8000Hz.wav"
    assert {(r["model"], r["layers"]) for r in rows} == {("full", "3"), ("simplified", "1")}
    others = {"manifest.tsv", "manifest.json", "recipe.toml", "sources"}
    assert {p.name for p in (tmp_path / "set").iterdir()} == {*seen, *others}


@pytest.mark.parametrize("level", [SetLevel(), SetLevel(full_scale_g=2.0)])
def test_manifest_tells_the_truth(tmp_path: Path, recipe: MakeRecipe, level: SetLevel) -> None:
    sample_format = "pcm24" if level.full_scale_g else "float32"
    write_set(tmp_path / "set", recipe(level=level, format=sample_format))
    scale = level.full_scale_g or 1.0
    for row in manifest(tmp_path / "set"):
        path = tmp_path / "set" / row["file"]
        samples, rate_hz = soundfile.read(path, dtype="float64")
        assert hashlib.sha256(path.read_bytes()).hexdigest() == row["sha256"]
        assert (rate_hz, samples.size) == (8000, 2000)
        assert (row["rate_hz"], float(row["duration_s"])) == ("8000", 0.25)
        rms, peak = steady_rms(path, scale), scale * np.abs(samples).max()
        assert float(row["rms"]) == pytest.approx(rms, rel=1e-5)
        assert float(row["level_db"]) == pytest.approx(20 * np.log10(rms), abs=1e-4)
        assert float(row["peak"]) == pytest.approx(peak, abs=1e-6)
        assert float(row["crest_db"]) == pytest.approx(20 * np.log10(peak / rms), abs=1e-3)
        assert (row["texture"], row["unit"], row["seed"]) == ("wall paper", "g", "4")
        assert (row["format"], row["gain_db"]) == (sample_format, "0.0")
        assert (row["bits"], row["full_scale_g"]) == (
            ("24", "2.0") if sample_format == "pcm24" else ("32", "n/a")
        )
        model = tmp_path / row["model"] / "paper.json"
        assert row["model_sha256"] == hashlib.sha256(model.read_bytes()).hexdigest()
        text = (tmp_path / "set/recipe.toml").read_bytes()
        assert row["recipe_sha256"] == hashlib.sha256(text).hexdigest()
        assert row["simulated"] == "true"


def test_every_column_is_described(tmp_path: Path, recipe: MakeRecipe) -> None:
    write_set(tmp_path / "set", recipe())
    described = json.loads((tmp_path / "set/manifest.json").read_text(encoding="utf-8"))
    assert (
        list(described)
        == list(manifest(tmp_path / "set")[0])
        == [column.name for column in STIMULUS_COLUMNS]
    )
    assert list(StimulusRow.__dataclass_fields__) == [column.name for column in STIMULUS_COLUMNS]


def test_samples_are_g(tmp_path: Path, recipe: MakeRecipe, truth: TextureModel) -> None:
    """A file's RMS is the model's own; nothing is normalised."""
    expected = np.sqrt(np.mean(truth.peq(250.0, 2.5).response(np.arange(2500.0)) ** 2))
    write_set(tmp_path / "set", recipe(duration_s=4.0))
    rows = [r for r in manifest(tmp_path / "set") if r["trajectory"] == "250mms_2.5N"]
    assert float(rows[0]["rms"]) == pytest.approx(expected, rel=0.08)


def test_set_is_reproducible_to_the_bit_from_its_own_recipe(
    tmp_path: Path, recipe: MakeRecipe
) -> None:
    """Once more, from the copied recipe after the originals are gone, and after a move."""
    (tmp_path / "hand.csv").write_text("time_s,speed_mm_s,force_n\n0,0,1\n0.2,250,2\n")
    threshold = tmp_path / "mine.tsv"
    threshold.write_text("frequency_hz\tacceleration_g\n10\t0.01\n400\t0.02\n")
    trajectories = (
        TrajectoryEntry.constant(100, 1),
        TrajectoryEntry(name="a hand", file=tmp_path / "hand.csv"),
    )
    made = recipe(
        trajectories=trajectories,
        rates_hz=(5000, 44_100),
        format="pcm24",
        level=SetLevel(mode="loudness", threshold=threshold, full_scale_g=4.0),
    )
    write_set(tmp_path / "a", made)
    write_set(tmp_path / "b", made)
    first = contents(tmp_path / "a")
    assert first == contents(tmp_path / "b")
    for gone in ("full", "simplified", "b"):
        shutil.rmtree(tmp_path / gone)
    for file in (threshold, tmp_path / "hand.csv"):
        file.unlink()
    (tmp_path / "a").rename(tmp_path / "moved")
    write_set(tmp_path / "c", Recipe.load(tmp_path / "moved/recipe.toml"))
    assert contents(tmp_path / "c") == first
    program = (
        "from tactileq.stimuli.sets.recipe import Recipe\n"
        "from tactileq.stimuli.sets.writing import write_set\n"
        "write_set('d', Recipe.load('moved/recipe.toml'))\n"
    )
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True)
    assert contents(tmp_path / "d") == first
    write_set(tmp_path / "moved", Recipe.load(tmp_path / "moved/recipe.toml"))
    assert contents(tmp_path / "moved") == first
    assert len(first) == 2 * 2 * 2 + 3 + 4


LEVELS = {
    "as modelled": {},
    "rms": {"level": SetLevel(mode="rms", rms_db=-20.0)},
    "loudness": {"level": SetLevel(mode="loudness", full_scale_g=4.0), "format": "pcm24"},
}


@pytest.mark.parametrize("mode", LEVELS)
def test_threads_change_nothing(
    tmp_path: Path, recipe: MakeRecipe, monkeypatch: pytest.MonkeyPatch, mode: str
) -> None:
    """One thread and four: the same files, rows and progress, told and written by the caller."""
    made = recipe(rates_hz=(5000, 44_100), seeds=tuple(range(8)), **LEVELS[mode])
    told: dict[int, list[str]] = {1: [], 4: []}
    callers, writers = set(), set()
    write_bytes = Path.write_bytes

    def noted(path: Path, data: bytes) -> int:
        writers.add(threading.current_thread())
        return write_bytes(path, data)

    monkeypatch.setattr(Path, "write_bytes", noted)
    for threads, names in told.items():
        monkeypatch.setattr(writing, "thread_count", lambda _, threads=threads: threads)

        def tell(name: str, names: list[str] = names) -> None:
            names.append(name)
            callers.add(threading.current_thread())

        write_set(tmp_path / str(threads), made, progress=tell)
    assert contents(tmp_path / "1") == contents(tmp_path / "4")
    assert told[1] == told[4] == [row["file"] for row in manifest(tmp_path / "4")]
    assert len(told[4]) == 64
    assert callers == writers == {threading.current_thread()}


@pytest.mark.parametrize("ending", [KeyboardInterrupt, SystemExit, InputError])
def test_an_end_before_the_end_leaves_no_thread_and_the_old_set(
    tmp_path: Path, recipe: MakeRecipe, monkeypatch: pytest.MonkeyPatch, ending: type[BaseException]
) -> None:
    """A signal to the caller between two files, and a file in the middle that is refused."""
    write_set(tmp_path / "set", recipe())
    before, alive = contents(tmp_path), threading.active_count()
    monkeypatch.setattr(writing, "thread_count", lambda _: 4)
    check_finite, checked, told = writing._check_finite, [], []

    def refuse_some(samples: np.ndarray, file: str, sample_format: str) -> None:
        checked.append(file)
        if ending is InputError and file.endswith(("seed9.wav", "seed11.wav")):
            raise InputError(file)
        check_finite(samples, file, sample_format)

    def end_after_nine(file: str) -> None:
        told.append(file)
        if ending is not InputError and len(told) == 9:
            raise ending(file)

    monkeypatch.setattr(writing, "_check_finite", refuse_some)
    with pytest.raises(ending, match=r"wall-paper_full_100mms_1N_seed[89]\.wav"):
        write_set(tmp_path / "set", recipe(seeds=tuple(range(100))), progress=end_after_nine)
    assert len(told) == 9
    assert len(checked) <= 9 + 2 * 4
    assert threading.active_count() == alive
    assert contents(tmp_path) == before


def test_seeds_and_streams(tmp_path: Path, recipe: MakeRecipe) -> None:
    """Noise is independent by default; frozen, it is shared by the models of a texture only."""

    def rendered(name: str, **changes: object) -> list[np.ndarray]:
        stimuli = write_set(tmp_path / name, recipe(**changes))
        return [soundfile.read(tmp_path / name / s.file)[0][40:-40] for s in stimuli]

    def correlations(signals: list[np.ndarray]) -> np.ndarray:
        return np.abs(np.corrcoef(signals))[np.triu_indices(4, 1)].reshape(6)

    one_layer = {"models": recipe().models, "duration_s": 1.0}
    # Pairs of (full, simplified) × (slow, fast): 01 02 03 12 13 23.
    independent = correlations(rendered("independent", **one_layer))
    frozen = correlations(rendered("frozen", noise="frozen", **one_layer))
    assert independent.max() < 0.3
    assert frozen[[1, 4]].min() > 0.6
    assert frozen[[0, 2, 3, 5]].max() < 0.3
    again, other = rendered("again", **one_layer), rendered("other", seeds=(5,), **one_layer)
    assert max(abs(np.corrcoef(a, b)[0, 1]) for a, b in zip(again, other, strict=True)) < 0.3


def test_a_stimulus_does_not_depend_on_the_rest_of_its_set(
    tmp_path: Path, recipe: MakeRecipe
) -> None:
    """Nor on the other rates."""
    whole = write_set(tmp_path / "whole", recipe(rates_hz=(5003, 8000), seeds=(3, 4)))
    made = recipe()
    part = write_set(tmp_path / "part", replace(made, trajectories=made.trajectories[1:]))
    by_name = {(s.model, s.trajectory, s.seed, s.rate_hz): s.sha256 for s in whole}
    assert all(by_name[s.model, s.trajectory, s.seed, s.rate_hz] == s.sha256 for s in part)


@pytest.mark.parametrize("rates_hz", [(5000,), (44_100, 48_000)])
def test_rms_levels_are_matched(
    tmp_path: Path, recipe: MakeRecipe, rates_hz: tuple[int, ...]
) -> None:
    level = SetLevel(mode="rms", rms_db=-20.0)
    for stimulus in write_set(tmp_path / "set", recipe(level=level, rates_hz=rates_hz)):
        # Measured at the model's rate; a file's steady part begins within a sample of it.
        assert stimulus.level_db == pytest.approx(-20.0, abs=0.01)
        assert steady_rms(tmp_path / "set" / stimulus.file) == pytest.approx(0.1, rel=2e-3)


def sensation_of(path: Path, threshold: Threshold) -> float:
    samples, rate_hz = soundfile.read(path, dtype="float64")
    fade = fade_samples(samples.size, rate_hz)
    return sensation_level(samples[fade:-fade], rate_hz, threshold=threshold).level_db


def test_loudness_is_matched(tmp_path: Path, recipe: MakeRecipe) -> None:
    """To a given level, and to the median of what the set has."""
    threshold = Threshold.shipped("pen-hold")
    plain = write_set(tmp_path / "plain", recipe(rates_hz=(5000,)))
    own = [sensation_of(tmp_path / "plain" / s.file, threshold) for s in plain]
    assert np.ptp(own) > 3
    for name, asked_db, wanted_db in (("given", 20.0, 20.0), ("median", None, np.median(own))):
        level = SetLevel(mode="loudness", threshold="pen-hold", sensation_level_db=asked_db)
        stimuli = write_set(tmp_path / name, recipe(level=level, rates_hz=(5000,)))
        for stimulus, own_db in zip(stimuli, own, strict=True):
            found = sensation_of(tmp_path / name / stimulus.file, threshold)
            assert found == pytest.approx(wanted_db, abs=1e-3)
            assert stimulus.sensation_level_db == pytest.approx(wanted_db, abs=1e-3)
            assert stimulus.gain_db == pytest.approx(wanted_db - own_db, abs=1e-3)
            assert stimulus.share_without_threshold is not None
            assert 0 < stimulus.share_without_threshold < 1


def test_autoregressive_models_have_no_layers(tmp_path: Path, recipe: MakeRecipe) -> None:
    truth = planted_texture("canvas", **SMALL)
    fit_ar(record_texture(truth, duration_s=0.3), order=4).save(tmp_path / "rival/canvas.json")
    regressed(truth).save(tmp_path / "driven/canvas.json")
    entries = tuple(ModelEntry(tmp_path / name, name) for name in ("rival", "driven"))
    write_set(tmp_path / "set", recipe(models=entries))
    rows = manifest(tmp_path / "set")
    assert [(r["model"], r["layers"]) for r in rows[::2]] == [("rival", "n/a"), ("driven", "4")]


def test_clipping_is_refused_with_what_would_do(tmp_path: Path, recipe: MakeRecipe) -> None:
    made = recipe(format="pcm24", level=SetLevel(full_scale_g=0.05))
    facts = {"expected": ["full scale", "g"], "got": [".wav", "full_scale_g"]}
    with refused(InputError, **facts) as error:
        write_set(tmp_path / "set", made)
    assert not (tmp_path / "set").exists()
    words = str(error.value).split()
    least = float(words[words.index("full_scale_g") + 2])
    stimuli = write_set(tmp_path / "set", replace(made, level=SetLevel(full_scale_g=least)))
    assert 0.998 * least < max(s.peak for s in stimuli) <= least * (1 - 2**-23)
    with refused(InputError, **facts):
        write_set(tmp_path / "less", replace(made, level=SetLevel(full_scale_g=0.998 * least)))


def test_arbitrary_units(tmp_path: Path, recipe: MakeRecipe, truth: TextureModel) -> None:
    replace(truth, unit="arbitrary").save(tmp_path / "full/paper.json")
    full = {"models": (ModelEntry(tmp_path / "full", "full"),)}
    with refused(InputError, expected=["g", "loudness"], got=["'arbitrary'", "wall paper"]):
        write_set(tmp_path / "set", recipe(level=SetLevel(mode="loudness"), **full))
    assert write_set(tmp_path / "set", recipe(**full))[0].unit == "arbitrary"
    matched = write_set(tmp_path / "g", recipe(level=SetLevel(mode="rms", rms_db=-30), **full))
    assert matched[0].unit == "g"


def test_silence(tmp_path: Path, recipe: MakeRecipe) -> None:
    at_rest = {"trajectories": (TrajectoryEntry.constant(0, 1),)}
    stimulus = write_set(tmp_path / "set", recipe(**at_rest))[0]
    assert (stimulus.rms, stimulus.peak, stimulus.level_db) == (0.0, 0.0, -np.inf)
    assert manifest(tmp_path / "set")[0]["crest_db"] == "n/a"
    for level in (SetLevel(mode="rms", rms_db=-20), SetLevel(mode="loudness")):
        with refused(InputError, names="wall paper_full_0mms_1N", expected="vibration"):
            write_set(tmp_path / "matched", recipe(level=level, **at_rest))
    assert not (tmp_path / "matched").exists()


def no_model(folder: Path, recipe: Recipe) -> Recipe:
    return replace(recipe, models=(ModelEntry(folder / "none.json", "full"),))


def an_empty_folder(folder: Path, recipe: Recipe) -> Recipe:
    (folder / "empty").mkdir()
    return replace(recipe, models=(ModelEntry(folder / "empty", "full"),))


def one_texture_twice(folder: Path, recipe: Recipe) -> Recipe:
    shutil.copyfile(folder / "full/paper.json", folder / "full/again.json")
    return recipe


def a_hand_of_one_sample(folder: Path, recipe: Recipe) -> Recipe:
    (folder / "hand.csv").write_text("time_s,speed_mm_s,force_n\n0,100,1\n")
    return replace(recipe, trajectories=(TrajectoryEntry(name="h", file=folder / "hand.csv"),))


def a_hand_in_microseconds(folder: Path, recipe: Recipe) -> Recipe:
    (folder / "hand.csv").write_text("time_s,speed_mm_s,force_n\n0,100,1\n1e-5,100,1\n")
    return replace(recipe, trajectories=(TrajectoryEntry(name="h", file=folder / "hand.csv"),))


def names_that_meet(folder: Path, recipe: Recipe) -> Recipe:
    entry = recipe.trajectories[0]
    return replace(recipe, trajectories=(replace(entry, name="a b"), replace(entry, name="a-b")))


def no_threshold(folder: Path, recipe: Recipe) -> Recipe:
    level = SetLevel(mode="loudness", threshold=folder / "none.tsv")
    return replace(recipe, level=level)


def a_slow_rate(folder: Path, recipe: Recipe) -> Recipe:
    return replace(recipe, rates_hz=(4000, 8000))


DAMAGES = [
    (no_model, "none.json", "nothing"),
    (an_empty_folder, "empty", "none"),
    (one_texture_twice, "label", ["two", "wall paper"]),
    (a_hand_of_one_sample, ["two", "'h'"], 1),
    (a_hand_in_microseconds, "8000 Hz", ["1e-05 s", "'h'"]),
    (names_that_meet, "stimulus", "wall-paper_full_a-b.wav"),
    (no_threshold, "none.tsv", "nothing"),
    (a_slow_rate, ["5000 Hz", "wall paper"], "4000 Hz"),
]


@pytest.mark.parametrize(("damage", "expected", "got"), DAMAGES)
def test_failure_leaves_the_old_set_untouched(
    tmp_path: Path,
    recipe: MakeRecipe,
    damage: Callable[[Path, Recipe], Recipe],
    expected: object,
    got: object,
) -> None:
    write_set(tmp_path / "set", recipe())
    damaged = damage(tmp_path, recipe())
    before = contents(tmp_path)
    for name in ("set", "new"):
        with refused(InputError, expected=expected, got=got):
            write_set(tmp_path / name, damaged)
        assert contents(tmp_path) == before


def test_a_full_disk_leaves_the_old_set_untouched(
    tmp_path: Path, recipe: MakeRecipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_set(tmp_path / "set", recipe())
    before = contents(tmp_path)
    write_bytes, written = Path.write_bytes, []

    def full_after_two(path: Path, data: bytes) -> int:
        if len(written) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written.append(path)
        return write_bytes(path, data)

    monkeypatch.setattr(Path, "write_bytes", full_after_two)
    with refused(InputError, expected=tmp_path / "set", got="disk"):
        write_set(tmp_path / "set", recipe(seeds=(5,)))
    assert len(written) == 2
    monkeypatch.undo()
    assert contents(tmp_path) == before


def test_a_place_where_nothing_can_be_written(tmp_path: Path, recipe: MakeRecipe) -> None:
    (tmp_path / "file").write_text("mine")
    with refused(InputError, expected=tmp_path / "file/set", got=tmp_path / "file"):
        write_set(tmp_path / "file/set", recipe())
    with refused(InputError, expected="folder", got=tmp_path / "file"):
        write_set(tmp_path / "file", recipe())
    assert (tmp_path / "file").read_text() == "mine"


def test_older_sets_are_replaced_whole(tmp_path: Path, recipe: MakeRecipe) -> None:
    write_set(tmp_path / "set", recipe())
    made = recipe()
    smaller = replace(made, models=made.models[:1], trajectories=made.trajectories[:1])
    (stimulus,) = write_set(tmp_path / "set", smaller)
    own = ["manifest.json", "manifest.tsv", "recipe.toml", "sources/wall-paper_full.json"]
    assert sorted(contents(tmp_path / "set")) == sorted([stimulus.file, *own])


def test_foreign_files_are_kept(tmp_path: Path, recipe: MakeRecipe) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("years of work")
    with refused(InputError, expected="folder", got=[tmp_path / "mine", "notes.txt"]):
        write_set(tmp_path / "mine", recipe())
    for place in ("set", "set/sources"):
        shutil.rmtree(tmp_path / "set", ignore_errors=True)
        write_set(tmp_path / "set", recipe())
        (tmp_path / place / "notes.txt").write_text("years of work")
        with refused(InputError, expected="folder", got="notes.txt"):
            write_set(tmp_path / "set", recipe())
        assert (tmp_path / place / "notes.txt").read_text() == "years of work"


def test_names_cannot_leave_the_folder(
    tmp_path: Path, recipe: MakeRecipe, truth: TextureModel
) -> None:
    replace(truth, texture="../up/a b").save(tmp_path / "odd/odd.json")
    models = (ModelEntry(tmp_path / "odd", "../../label"),)
    stimuli = write_set(tmp_path / "deep/set", recipe(models=models))
    for stimulus in stimuli:
        assert not set("/ ") & set(stimulus.file)
        assert stimulus.texture == "../up/a b"
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["set"]


def test_long_work_is_not_done_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """All cores for ordinary files; one thread for what fills the memory by itself."""
    monkeypatch.setattr(writing, "usable_cores", lambda: 8)
    count, at_once = writing.thread_count, writing.SAMPLES_AT_ONCE
    assert count(1) == count(480_000) == count(at_once // 8) == 8
    assert count(at_once // 3) == 3
    assert count(at_once) == count(100 * at_once) == 1
