"""tactileq verify: data, models and results, each as it was stored."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tactileq.modeling.files.hashes import sha256_of_file
from tests.experiments.verification.small_studies import (
    run_all,
    run_one,
    small_models,
    small_study,
)

TEXTURES = ("canvas", "PVC")


@pytest.fixture(autouse=True)
def quick(undrawn: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without pictures, and with fewer simulated tables, of which no test here is."""
    monkeypatch.setattr("tactileq.analysis.chapters.confusions.similarity_choice.SIMULATIONS", 9)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("whole") / "data"
    run_all(root, small_study(TEXTURES), small_models(TEXTURES))
    return root


@pytest.fixture
def data(whole: Path, tmp_path: Path) -> Path:
    """A copy of a study of two people."""
    return Path(shutil.copytree(whole, tmp_path / "data"))


def test_results_are_verified_by_hashes_and_made_again(main, data: Path) -> None:
    assert main("analyze", "data", "--out", "results").returncode == 0
    page = (data.parent / "results/report.html").read_text(encoding="utf-8")
    done = main("verify", "data", "results")
    assert (done.returncode, done.stderr) == (0, "")
    about_data, *_, about_results = done.stdout.splitlines()
    assert about_data.startswith("4 of 4 sessions verified, seal ")
    assert f"{about_data}." in page  # the report says what verify says
    assert about_results.endswith("made again: the same")

    table = data.parent / "results/tables/claim_tests.tsv"
    text = table.read_text()
    table.write_text(text.replace("0.", "0.0", 1))
    assert table.read_text() != text
    changed = main("verify", "data", "results")
    assert changed.returncode == 1
    assert "tables/claim_tests.tsv: expected the file that was written, got another" in (
        changed.stderr
    )
    # Whoever puts the new hash into the provenance is found by the analysis.
    note = data.parent / "results/provenance.json"
    values = json.loads(note.read_text())
    values["sha256"]["tables/claim_tests.tsv"] = sha256_of_file(table)
    note.write_text(json.dumps(values))
    again = main("verify", "data", "results")
    assert again.returncode == 1
    assert "tables/claim_tests.tsv: expected what an analysis made again gives" in again.stderr

    (data / "notes.txt").write_text("added\n")
    other = main("verify", "data", "results")
    assert other.returncode == 1
    assert other.stderr.count("\n") == 1
    assert "results those of other data" in other.stderr
    none = main("verify", "data", "data")
    assert none.returncode == 1
    assert none.stderr.count("\n") == 1


def test_what_differs_stops_an_analysis_unless_there_is_a_reason(main, data: Path) -> None:
    (log,) = data.glob("sourcedata/sub-02/ses-01/*_task-absolute_log.jsonl")
    hand = log.with_name(log.name.replace("log.jsonl", "hand.tsv"))
    hand.write_text(hand.read_text() + "1\t1\t1\t0.0\t0.0\t0.0\tnone\t0\n")
    differs = main("verify", "data")
    assert differs.returncode == 1
    assert differs.stdout.startswith("3 of 4 sessions verified, seal ")
    assert f"{hand.name}: expected the file that its log names, got another" in differs.stderr
    refused = main("analyze", "data")
    assert refused.returncode == 1
    assert refused.stderr.count("\n") == 1
    assert "--unverified REASON" in refused.stderr
    assert "--exclude sub-02=REASON" in refused.stderr
    assert main("study", "status", "--data", "data").returncode == 0
    reason = "the stick was copied twice"
    done = main("analyze", "data", "--unverified", reason, "--out", "results")
    assert done.returncode == 0
    assert hand.name in done.stderr
    for name in ("report.html", "supplement.html"):
        page = (data.parent / "results" / name).read_text(encoding="utf-8")
        assert f"NOT VERIFIED: answers differ from what sessions stored ({reason})." in page


def test_a_study_of_an_earlier_version_is_verified_and_analyzed(main, tmp_path: Path) -> None:
    left = Path(__file__).parents[1] / "data" / "earlier_versions"
    for name in ("models", "simplified"):
        shutil.copytree(left / name, tmp_path / name)
    shutil.copytree(left / "e91fb878" / "data", tmp_path / "data")
    shutil.rmtree(tmp_path / "data/sourcedata/sub-02")  # killed before it had tables
    done = main("verify", "data")
    assert (done.returncode, done.stderr.count("\n")) == (0, 1)
    assert done.stdout.startswith("3 of 3 sessions verified, 3 without seals")
    assert done.stderr.startswith("note: ")
    assert "tactileq study status --data data" in done.stderr
    analyzed = main("analyze", "data", "--complete", "--out", "results")
    assert (analyzed.returncode, analyzed.stderr) == (0, done.stderr)
    assert main("study", "status", "--data", "data").returncode == 0
    renewed = main("verify", "data")
    assert (renewed.returncode, renewed.stderr) == (0, "")


def test_models_are_compared_with_those_that_were_presented(main, tmp_path: Path) -> None:
    models = small_models(TEXTURES)
    sources = {}
    for name, of_set in models.sets.items():
        folder = tmp_path / name
        folder.mkdir()
        sources[name] = name
        for texture, model in of_set.items():
            model.save(folder / f"{texture}.json")
    run_one(tmp_path / "data", small_study(TEXTURES), models, sources=sources)
    done = main("verify", "data")
    assert (done.returncode, done.stderr) == (0, "")
    assert "models verified: 2 sets of 2" in done.stdout
    shutil.copy(tmp_path / "full/PVC.json", tmp_path / "simplified/PVC.json")
    another = main("verify", "data")
    assert another.returncode == 1
    told = "simplified: expected the simplified model of PVC that sessions presented, got another"
    assert told in another.stderr
    shutil.rmtree(tmp_path / "simplified")
    done = main("verify", "data")
    assert done.returncode == 0
    assert "models verified: 1 set of 2 (not here, or a scene: simplified)" in done.stdout
