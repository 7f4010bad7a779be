"""Bad input ends with one sentence and an exit code, and nothing is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from modeling import Recording, RecordingSet
from stimuli.planted.textures import planted_texture

NOISE = np.random.default_rng(3).normal(0, 0.1, 3000)


def make_set(folder: Path, damage: Callable[[Path], object]) -> None:
    RecordingSet(
        Recording(NOISE, 5000.0, speed, force, "oak") for speed in (50, 100) for force in (1, 2)
    ).save(folder)
    damage(folder)


def edit(name: str, old: str, new: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return change


def fill(name: str, lines: list[str]) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text("\n".join(["acceleration_g", *lines, ""]))


def truncate(folder: Path) -> None:
    data = (folder / "0002.csv").read_bytes()
    (folder / "0002.csv").write_bytes(data[:-7])


def cut_at_a_line(folder: Path) -> None:
    lines = (folder / "0002.csv").read_text().splitlines(keepends=True)
    (folder / "0002.csv").write_text("".join(lines[:-500]))


DAMAGES = {
    "empty": (lambda f: (f / "0002.csv").write_text(""), "got an empty file"),
    "truncated": (truncate, "the file is truncated"),
    "cut": (cut_at_a_line, "expected 3000 samples in 0002.csv, got 2500"),
    "nan": (fill("0002.csv", ["0.1", "nan"] * 50), "expected finite samples"),
    "inf": (fill("0002.csv", ["0.1", "-inf"] * 50), "expected finite samples"),
    "constant": (fill("0002.csv", ["0.25"] * 100), "got the constant value 0.25"),
    "unit": (edit("recordings.tsv", "\tg\t", "\tfurlong\t"), "got 'furlong'"),
    "rate": (edit("recordings.tsv", "\t5000.0\t", "\t\t"), "expected a number for rate_hz"),
    "zero rate": (edit("recordings.tsv", "\t5000.0\t", "\t0\t"), "rate above 0 Hz"),
    "speed": (edit("recordings.tsv", "\t50.0\t", "\t-50.0\t"), "speed_mm_s of at least 0"),
    "missing file": (lambda f: (f / "0003.csv").unlink(), "got nothing there"),
    "text": (fill("0002.csv", ["0.1", "o.2"] * 50), "one number per line"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_recording_is_named_and_left_out(main, tmp_path: Path, name: str) -> None:
    damage, sentence = DAMAGES[name]
    make_set(tmp_path / "set", damage)
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    (warning,) = [line for line in done.stderr.splitlines() if "left out" in line]
    assert warning.startswith("warning: oak: left out: ")
    assert sentence in warning
    assert "oak: interpolated for want of a recording: " in done.stdout
    model = json.loads((tmp_path / "models/oak.json").read_text())
    assert np.sum(model["interpolated"]) == 1
    provenance = json.loads((tmp_path / "models/oak_provenance.json").read_text())
    assert [sentence in told for told in provenance["settings"]["left_out"]] == [True]


@pytest.mark.parametrize("silence", ["0", "0.25"])
def test_a_silent_recording_is_named_and_left_out(main, tmp_path: Path, silence: str) -> None:
    make_set(tmp_path / "set", fill("0002.csv", [silence] * 3000))
    done = main("model", "set", "--out", "models")
    assert done.returncode == 0, done.stderr
    assert "left out" in done.stderr
    assert "oak: interpolated for want of a recording: 50 mm/s at 2 N" in done.stdout


def test_recordings_that_are_all_damaged_are_refused(main, tmp_path: Path) -> None:
    def damage(folder: Path) -> None:
        for number in range(1, 5):
            (folder / f"{number:04d}.csv").write_text("")

    make_set(tmp_path / "set", damage)
    assert_refused(main("model", "set", "--out", "models"), "got an empty file")
    assert not (tmp_path / "models").exists()


def test_one_condition_twice_is_refused(main, tmp_path: Path) -> None:
    """One of the labels is wrong, nobody knows which."""
    make_set(tmp_path / "set", edit("recordings.tsv", "50.0\t2.0", "50.0\t1.0"))
    assert_refused(main("model", "set", "--out", "models"), "one recording per condition")
    assert not (tmp_path / "models").exists()


def assert_refused(result, sentence: str) -> None:
    assert result.returncode != 0
    assert sentence in result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    assert "Traceback" not in result.stderr
    assert result.stderr.startswith("error: ")


def test_a_folder_that_is_not_one(main, tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes/a.txt").write_text("hello")
    assert_refused(main("model", "nowhere"), "expected a folder of recordings")
    assert_refused(main("model", "notes"), "import the files first")
    assert_refused(main("model", "notes/a.txt"), "expected a folder of recordings")
    assert_refused(main("analyze", "notes"), "expected")
    assert not (tmp_path / "models").exists()


def test_a_model_of_a_newer_version(main, tmp_path: Path) -> None:
    path = tmp_path / "new.json"
    planted_texture("canvas").save(path)
    values = json.loads(path.read_text())
    values["version"] = 2
    path.write_text(json.dumps(values))
    for command in (["simplify", "new.json"], ["stimuli", "new.json"]):
        assert_refused(main(*command), "got version 2; update tactileq")
    path.write_text("{")
    assert_refused(main("simplify", "new.json"), "expected JSON")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new.json"]


def test_options_without_meaning(main, tmp_path: Path) -> None:
    planted_texture("canvas").save(tmp_path / "m.json")
    cases = {
        ("simplify", "m.json", "--margin-db", "-1"): "margin of at least 0 dB",
        ("simplify", "m.json", "--threshold", "tongue"): "codec, pen-hold, mobile or a TSV file",
        ("simplify", "m.json", "--threshold", "my.tsv"): "expected a table at my.tsv",
        ("stimuli", "m.json", "--rate", "1000"): "rendering rate of at least the model's",
        ("stimuli", "m.json", "--duration", "0"): "to 3600 for duration_s, got 0.0",
        ("record", "new", "--texture", "silk"): "expected a planted texture among",
        ("record", "new", "--texture", "canvas", "--duration", "-1"): "expected",
        ("import", "wav", "a.wav"): "give both, or --labels",
        ("import", "wav", "a.wav", "--speed", "1", "--force", "1"): "expected a WAV file",
    }
    for command, sentence in cases.items():
        assert_refused(main(*command), sentence)
    assert [p.name for p in tmp_path.iterdir()] == ["m.json"]


def test_results_do_not_overwrite_foreign_folders(main, tmp_path: Path) -> None:
    planted_texture("canvas").save(tmp_path / "m.json")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("years of work")
    for command in (
        ["stimuli", "m.json", "--out", "mine"],
        ["record", "mine", "--texture", "canvas"],
        ["demo", "--out", "mine"],
    ):
        assert_refused(main(*command), "mine")
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.txt"]
