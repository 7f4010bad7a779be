"""Stimulus sets: the files, and a manifest that tells the truth about them."""

from __future__ import annotations

import csv
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from modeling import InputError, TextureModel
from stimuli.planted import planted_texture
from stimuli.sets import render_stimulus, write_set

SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
CONDITIONS = ((100.0, 1.0), (250.0, 2.5))


def write(folder: Path, **changes: Any) -> tuple[Any, ...]:
    truth = planted_texture("wall paper", **SMALL)
    options: dict[str, Any] = {
        "models": [("full", truth), ("simplified", truth.with_layers([0]))],
        "conditions": CONDITIONS,
        "rate_hz": 8000.0,
        "duration_s": 0.25,
        "seed": 4,
        **changes,
    }
    return write_set(folder, options.pop("models"), **options)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def manifest(folder: Path) -> list[dict[str, str]]:
    with (folder / "manifest.tsv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def test_set_is_reproducible_to_the_bit(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write(tmp_path / name)
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    write(tmp_path / "c", seed=5)
    assert contents(tmp_path / "a") != contents(tmp_path / "c")


def test_every_model_and_condition_has_its_file(tmp_path: Path) -> None:
    seen: list[str] = []
    stimuli = write(tmp_path / "set", progress=seen.append)
    rows = manifest(tmp_path / "set")
    assert [row["file"] for row in rows] == seen == [s.file for s in stimuli]
    assert sorted([*seen, "manifest.tsv"]) == sorted(contents(tmp_path / "set"))
    assert [(r["model"], float(r["speed_mm_s"]), float(r["force_n"])) for r in rows] == [
        (label, *condition) for label in ("full", "simplified") for condition in CONDITIONS
    ]
    assert [row["layers"] for row in rows] == ["3", "3", "1", "1"]


def test_manifest_tells_the_truth(tmp_path: Path) -> None:
    write(tmp_path / "set")
    for row in manifest(tmp_path / "set"):
        path = tmp_path / "set" / row["file"]
        samples, rate_hz = soundfile.read(path, dtype="float64")
        assert hashlib.sha256(path.read_bytes()).hexdigest() == row["sha256"]
        assert (rate_hz, samples.size) == (8000, 2000)
        assert (float(row["rate_hz"]), float(row["duration_s"])) == (8000.0, 0.25)
        rms = np.sqrt(np.mean(samples**2))
        assert float(row["rms"]) == pytest.approx(rms, rel=1e-6)
        assert float(row["level_db"]) == pytest.approx(20 * np.log10(rms), abs=1e-5)
        assert float(row["peak"]) == pytest.approx(np.abs(samples).max(), rel=1e-6)
        assert (row["texture"], row["unit"], row["seed"]) == ("wall paper", "g", "4")
        assert row["simulated"] == "true"


def test_samples_are_g(tmp_path: Path) -> None:
    """A file's RMS is the model's own; nothing is normalised."""
    truth = planted_texture("wall paper", **SMALL)
    peq = truth.peq(250.0, 2.5)
    expected = np.sqrt(np.mean(peq.response(np.arange(2500.0)) ** 2))
    write(tmp_path / "set", models=[("full", truth)], conditions=[(250.0, 2.5)], duration_s=4.0)
    assert float(manifest(tmp_path / "set")[0]["rms"]) == pytest.approx(expected, rel=0.08)


def test_fades_and_settled_start() -> None:
    truth = planted_texture("wall paper", **SMALL)
    signal = render_stimulus(truth, 250.0, force_n=2.5, rate_hz=8000.0, duration_s=1.0, seed=1)
    middle = np.abs(signal[80:-80])
    assert np.abs(signal[[0, -1]]).max() < 0.01 * middle.max()
    assert np.sqrt(np.mean(signal[80:800] ** 2)) > 0.5 * np.sqrt(np.mean(middle**2))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"duration_s": 0.0}, "duration above 0"),
        ({"duration_s": 1e-6}, "duration above 0"),
        ({"duration_s": np.nan}, "duration above 0"),
        ({"duration_s": np.inf}, "duration above 0"),
        ({"duration_s": 3601.0}, "duration of at most 3600 s"),
        ({"conditions": [(-1.0, 1.0)]}, "at least 0, got -1.0 mm/s"),
        ({"conditions": [(np.nan, 1.0)]}, "at least 0, got nan mm/s"),
        ({"conditions": [CONDITIONS[0], (100.0, np.inf)]}, "at least 0, got .* at inf N"),
        ({"conditions": [(100.0, -0.5)]}, "at least 0, got .* at -0.5 N"),
        ({"rate_hz": 4000.0}, "at least the model's 5000 Hz"),
        ({"rate_hz": 8000.5}, "whole rate"),
        ({"rate_hz": np.nan}, "whole rate"),
        ({"conditions": (*CONDITIONS, CONDITIONS[0])}, "got .* twice"),
    ],
)
def test_failure_leaves_the_old_set_untouched(
    tmp_path: Path, changes: dict[str, Any], sentence: str
) -> None:
    write(tmp_path / "set")
    before = contents(tmp_path)
    with pytest.raises(InputError, match=sentence):
        write(tmp_path / "set", **changes)
    assert contents(tmp_path) == before
    with pytest.raises(InputError, match=sentence):
        write(tmp_path / "new", **changes)
    assert [p.name for p in tmp_path.iterdir()] == ["set"]


def test_older_sets_are_replaced_whole(tmp_path: Path) -> None:
    write(tmp_path / "set")
    (stimulus,) = write(
        tmp_path / "set",
        models=[("full", planted_texture("PVC", **SMALL))],
        conditions=CONDITIONS[:1],
    )
    assert sorted(contents(tmp_path / "set")) == sorted([stimulus.file, "manifest.tsv"])


def test_foreign_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="other files in it"):
        write(tmp_path)
    with pytest.raises(InputError, match="expected a folder"):
        write(tmp_path / "notes.txt")
    assert contents(tmp_path) == {"notes.txt": b"mine"}


def test_names_cannot_leave_the_folder(tmp_path: Path) -> None:
    truth = planted_texture("PVC", **SMALL)
    odd = TextureModel(
        **{
            **{name: getattr(truth, name) for name in truth.__dataclass_fields__},
            "texture": "../up/a b",
        }
    )
    (stimulus,) = write(
        tmp_path / "set", models=[("full", odd)], conditions=CONDITIONS[:1], duration_s=0.05
    )
    assert "/" not in stimulus.file
    assert " " not in stimulus.file
    assert stimulus.texture == "../up/a b"
    assert [p.name for p in tmp_path.iterdir()] == ["set"]


def test_silence_has_no_level(tmp_path: Path) -> None:
    (stimulus,) = write(
        tmp_path / "set",
        models=[("full", planted_texture("PVC", **SMALL))],
        conditions=[(0.0, 1.0)],
        duration_s=0.05,
    )
    assert (stimulus.rms, stimulus.peak, stimulus.level_db) == (0.0, 0.0, -np.inf)
