"""tactileq threshold: from answers to a table that tactileq simplify takes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tactileq.modeling import Simplification, Threshold
from tactileq.stimuli.planted.textures import planted_texture
from tests.experiments.tasks.planted_threshold import rows_of, write_answers
from tests.experiments.tasks.test_threshold_table import answers


@pytest.fixture
def data(tmp_path: Path) -> Path:
    for subject, shift_db in ((1, 0.0), (2, 2.0)):
        felt = [answers(f, db + shift_db) for f, db in ((20.0, -30.0), (250.0, -40.0))]
        weak = answers(1000.0, -20.0, highest_db=-20.0)  # at most by chance
        write_answers(tmp_path / "data", subject, rows_of([*felt[0], *felt[1], *weak]))
    return tmp_path / "data"


def test_its_table_goes_into_simplify(main, tmp_path: Path, data: Path) -> None:  # type: ignore[no-untyped-def]
    done = main("threshold", "--data", data, "--subject", 1, "--out", "mine.tsv")
    assert done.returncode == 0, done.stderr
    assert "1000 Hz: -20.0 dB re 1 g" in done.stdout
    assert "(above the highest amplitude: a lower bound)" in done.stdout
    assert "threshold of 1 person (simulated): mine.tsv" in done.stdout
    found = Threshold.load(tmp_path / "mine.tsv")
    assert found.frequency_hz.tolist() == [20.0, 250.0, 1000.0]
    planted_texture("polyester").save(tmp_path / "polyester.json")
    simplified = main("simplify", "polyester.json", "--threshold", "mine.tsv", "--out", "fewer")
    assert simplified.returncode == 0, simplified.stderr
    assert "threshold: mine (measured with a pen held still" in simplified.stdout
    saved = Simplification.load(tmp_path / "fewer/polyester_simplification.json")
    assert saved.threshold.sha256 == found.sha256
    note = json.loads((tmp_path / "mine.tsv_provenance.json").read_text())
    assert note["settings"] == {"subject": 1, "people": ["sub-01"]}
    (hashed,) = note["inputs_sha256"]
    assert hashed.endswith("sub-01_ses-01_task-threshold_beh.tsv")


def test_over_people_it_is_their_mean(main, tmp_path: Path, data: Path) -> None:  # type: ignore[no-untyped-def]
    outs = {}
    for name, options in (("one", ("--subject", 1)), ("two", ("--subject", 2)), ("all", ())):
        done = main("threshold", "--data", data, *options, "--out", f"{name}.tsv")
        assert done.returncode == 0, done.stderr
        outs[name] = Threshold.load(tmp_path / f"{name}.tsv").acceleration_g[:2]
    assert outs["all"] == pytest.approx((outs["one"] * outs["two"]) ** 0.5, rel=1e-4)


def test_bad_input_is_one_sentence_and_writes_nothing(main, tmp_path: Path, data: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "foreign.tsv").write_text("mine\n")
    for options, sentence in (
        (("--data", data, "--subject", 9), "expected answers of participant 9 to main trials"),
        (("--data", tmp_path / "nowhere"), "expected answers to main trials of the threshold"),
        (("--data", data, "--out", "table.csv"), "expected a file that ends with .tsv"),
        (("--data", data, "--out", "foreign.tsv"), "foreign.tsv"),
    ):
        refused = main("threshold", *options)
        assert refused.returncode == 1
        assert sentence in refused.stderr
        assert refused.stderr.count("\n") == 1
    assert not list(tmp_path.glob("*_provenance.json"))
    assert (tmp_path / "foreign.tsv").read_text() == "mine\n"
