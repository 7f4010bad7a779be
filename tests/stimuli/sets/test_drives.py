"""Sets for a vibrator: files are what drives it, levels those at the hand."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from scipy.signal import iirpeak, lfilter

from tactileq.modeling import InputError, TextureModel, Threshold, Vibrator
from tactileq.stimuli.exports.peq_json import write_peq_json
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel
from tactileq.stimuli.sets.sources import load_sources
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

MakeRecipe = Callable[..., Recipe]


@pytest.fixture
def pen(tmp_path: Path, vibrator: Vibrator) -> Path:
    """The vibrator's file."""
    vibrator.save(tmp_path / "pen.json")
    return tmp_path / "pen.json"


def manifest(folder: Path) -> list[dict[str, str]]:
    with (folder / "manifest.tsv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


@pytest.mark.parametrize("rate_hz", [8000, 44_100])
def test_each_file_is_the_drive_for_the_vibration_meant(
    tmp_path: Path, recipe: MakeRecipe, pen: Path, rate_hz: int
) -> None:
    """The vibrator answers with 0.3 times the file that a set without it has."""
    options = {"rates_hz": (rate_hz,), "duration_s": 1.0}
    plain = write_set(tmp_path / "plain", recipe(**options))
    driven = write_set(tmp_path / "driven", recipe(vibrator=pen, **options))
    b, a = iirpeak(80.0, 80.0 / 25.0, fs=rate_hz)
    late = slice(round(0.5 * rate_hz), -round(0.02 * rate_hz))  # its band has forgotten the fade
    for meant, drive in zip(plain, driven, strict=True):
        vibration, _ = soundfile.read(tmp_path / "plain" / meant.file)
        sent, _ = soundfile.read(tmp_path / "driven" / drive.file)
        answer = 0.3 * (sent + 3.0 * lfilter(b, a, sent))
        # Files are in single precision.
        assert np.abs(answer - 0.3 * vibration)[late].max() < 1e-6
        assert drive.peak == pytest.approx(np.abs(sent).max(), rel=1e-6)
        assert drive.peak != meant.peak
        at_hand = (drive.rms, drive.level_db, drive.crest_db)
        assert at_hand == (meant.rms, meant.level_db, meant.crest_db)


def test_the_manifest_says_so_and_the_set_carries_its_vibrator(
    tmp_path: Path, recipe: MakeRecipe, pen: Path
) -> None:
    write_set(tmp_path / "plain", recipe())
    assert {(r["vibrator"], r["vibrator_sha256"]) for r in manifest(tmp_path / "plain")} == {
        ("n/a", "n/a")
    }
    first = write_set(tmp_path / "set", recipe(vibrator=pen))
    sha256 = hashlib.sha256(pen.read_bytes()).hexdigest()
    assert {(r["vibrator"], r["vibrator_sha256"]) for r in manifest(tmp_path / "set")} == {
        ("compensated", sha256)
    }
    assert (tmp_path / "set/sources/vibrator.json").read_bytes() == pen.read_bytes()
    pen.unlink()
    own = Recipe.load(tmp_path / "set/recipe.toml")
    assert write_set(tmp_path / "again", own) == first
    assert write_set(tmp_path / "set", own) == first  # a set replaces itself


def test_a_simulated_vibrator_makes_simulated_drives(
    tmp_path: Path, recipe: MakeRecipe, pen: Path, vibrator: Vibrator, truth: TextureModel
) -> None:
    replace(truth, simulated=False).save(tmp_path / "full/paper.json")
    made = recipe(models=(ModelEntry(tmp_path / "full", "full"),), vibrator=pen)
    assert {s.simulated for s in write_set(tmp_path / "a", made)} == {"true"}
    replace(vibrator, simulated=False).save(pen)
    assert {s.simulated for s in write_set(tmp_path / "b", made)} == {"false"}


@pytest.mark.parametrize("mode", ["rms", "loudness"])
def test_levels_are_matched_at_the_hand(
    tmp_path: Path, recipe: MakeRecipe, pen: Path, mode: str
) -> None:
    wanted = {"rms": {"rms_db": -20.0}, "loudness": {"sensation_level_db": 20.0}}[mode]
    level = SetLevel(mode=mode, **wanted)  # type: ignore[arg-type]
    plain, driven = (
        write_set(tmp_path / name, recipe(level=level, vibrator=file))
        for name, file in (("plain", None), ("driven", pen))
    )
    for meant, drive in zip(plain, driven, strict=True):
        assert (drive.gain_db, drive.level_db) == (meant.gain_db, meant.level_db)
        assert drive.sensation_level_db == meant.sensation_level_db
        codec = Threshold.shipped("codec").sha256 if mode == "loudness" else None
        assert meant.threshold_sha256 == codec


def test_the_full_scale_is_that_of_the_drive(tmp_path: Path, recipe: MakeRecipe, pen: Path) -> None:
    """A set that fits only because its resonance is taken away is written."""
    wide = {"format": "pcm24", "level": SetLevel(full_scale_g=4.0)}
    peaks = {
        name: max(s.peak for s in write_set(tmp_path / name, recipe(vibrator=file, **wide)))
        for name, file in (("plain", None), ("driven", pen))
    }
    assert peaks["driven"] < 0.98 * peaks["plain"]
    tight = {"format": "pcm24", "level": SetLevel(full_scale_g=1.01 * peaks["driven"])}
    write_set(tmp_path / "tight", recipe(vibrator=pen, **tight))
    with refused(
        InputError,
        expected=["full scale", "g"],
        got=["wall-paper_full_250mms_2.5N.wav", "full_scale_g"],
    ):
        write_set(tmp_path / "plain", recipe(**tight))


SETTLING = ["settling_s", "[set]", "pen.json"]
BROAD = {"frequency_hz": 1000.0, "bandwidth_hz": 1500.0, "height": 10.0}
VIBRATORS_REFUSED = [
    ("none.json", {}, {}, "none.json", "nothing"),
    ("pen.json", {"bandwidth_hz": 1.0}, {}, [*SETTLING, 0.55], 0.5),
    ("pen.json", {}, {"settling_s": 0.02}, [*SETTLING, 0.03], 0.02),
    ("pen.json", {"frequency_hz": 9000.0}, {}, ["frequency", "1…3920 Hz", "8000 Hz"], 9000),
    ("pen.json", BROAD, {"rates_hz": (5000,)}, ["notch", "2250 Hz"], ["2384.57 Hz", "1500 Hz"]),
]


@pytest.mark.parametrize(("name", "changes", "options", "expected", "got"), VIBRATORS_REFUSED)
def test_vibrators_that_cannot_be_compensated(
    tmp_path: Path,
    recipe: MakeRecipe,
    pen: Path,
    vibrator: Vibrator,
    name: str,
    changes: dict[str, float],
    options: dict[str, Any],
    expected: object,
    got: object,
) -> None:
    replace(vibrator, **changes).save(pen)
    with refused(InputError, expected=expected, got=got):
        load_sources(recipe(vibrator=tmp_path / name, **options))


def test_other_files_among_models_are_passed_over(
    tmp_path: Path, recipe: MakeRecipe, pen: Path, truth: TextureModel
) -> None:
    """A vibrator's, an exported equalizer; but nothing that may be a damaged model."""
    pen.rename(tmp_path / "full/a.json")
    write_peq_json(tmp_path / "full/z.json", truth)
    sources = load_sources(recipe())
    assert [path.name for path in sources.passed_over] == ["a.json", "z.json"]
    assert [labelled.model for labelled in sources.models] == [truth, truth.with_layers([0])]
    # Named itself, it is to be a model.
    with refused(InputError, names=tmp_path / "full/a.json", expected="tactileq.texture-model"):
        load_sources(recipe(models=(ModelEntry(tmp_path / "full/a.json", "m"),)))
    for text in ("{", "{}", "[]", '{"format": 3}'):
        (tmp_path / "full/broken.json").write_text(text)
        with refused(InputError, names=tmp_path / "full/broken.json"):
            load_sources(recipe())
    (tmp_path / "full/broken.json").unlink()
    (tmp_path / "full/paper.json").unlink()
    with refused(InputError, expected=tmp_path / "full", got="none"):
        load_sources(recipe())
