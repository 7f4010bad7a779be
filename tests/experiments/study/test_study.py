"""Study files: read, read back, and refused with one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.study.study import SHIPPED_STUDY, Study
from modeling import InputError


def edited(folder: Path, old: str, new: str) -> Path:
    text = SHIPPED_STUDY.read_text(encoding="utf-8")
    assert old in text
    path = folder / "study.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_a_study_is_made_again_from_its_plain_values() -> None:
    study = Study.load()
    assert Study.from_dict(study.to_dict()) == study


def test_a_changed_file_is_followed(tmp_path: Path) -> None:
    study = Study.load(edited(tmp_path, "participants = 24", "participants = 6"))
    assert study.plan("relative").participants == 6


def test_what_a_study_wants_of_a_rig_changes_its_hash_only_where_it_is_stated(
    tmp_path: Path,
) -> None:
    shipped = Study.load()
    assert not {"calibration_days", "measured_force"} & set(shipped.to_dict())
    wanted = "seed = 1\ncalibration_days = 30\nmeasured_force = true"
    strict = Study.load(edited(tmp_path, "seed = 1", wanted))
    assert (strict.calibration_days, strict.measured_force) == (30.0, True)
    assert strict.sha256 != shipped.sha256
    assert Study.from_dict(strict.to_dict()) == strict
    usual = "seed = 1\ncalibration_days = 90\nmeasured_force = false"
    assert Study.load(edited(tmp_path, "seed = 1", usual)).sha256 == shipped.sha256


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("seed = 1", "sede = 1", "got sede"),
        ("seed = 1", "", "got no seed"),
        ("seed = 1", "seed = -1", "for seed, got -1"),
        ("seed = 1", "seed = 1.5", "for seed, got 1.5"),
        ("repeats = 3", "repeats = true", "for repeats, got True"),
        ("repeats = 3", "repeats = 0", "for repeats, got 0"),
        ("training_trials = 2", "training_trials = 8", "from 0 to 7 for training_trials"),
        ("participants = 24", "participants = 23", "even number of participants"),
        ("participants = 24", "subjects = 24", "got subjects"),
        ('schedule = "by-day"', 'schedule = "daily"', "got 'daily'"),
        ('"PVC", ', "", "got trays for"),
        ('"PVC", ', '"PVC", "PVC", ', "different textures"),
        ('PVC = "F"', 'PVC = "E"', "different trays"),
        ('PVC = "F"', 'PVC = "F\\tG"', "printable text for tray"),
        ('"canvas", ', '"can|vas", ', "printable text for texture"),
        ('"canvas", ', '"can\\nvas", ', "printable text for texture"),
        ("textures = [", 'textures = "PVC" #', "a list of textures"),
        ("[relative]", "[[relative]]", r"expected a table \[relative\]"),
        ("seed = 1", "seed = ", "expected TOML"),
        ("seed = 1", "seed = 1\ncalibration_days = 0", "for calibration_days, got 0"),
        ("seed = 1", "seed = 1\nmeasured_force = 1", "true or false for measured_force, got 1"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    path = edited(tmp_path, old, new)
    with pytest.raises(InputError, match=told) as refusal:
        Study.load(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a study file"):
        Study.load(tmp_path / "none.toml")
