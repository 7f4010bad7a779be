"""tactileq analyze: claims of the study, later ones, incomplete pairs, who is left out."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tactileq.analysis.answers import loading
from tactileq.commands.results.analyze import _later_plan, read_answers
from tactileq.modeling.files.hashes import sha256_of_file, sha256_of_paths


@pytest.fixture(autouse=True)
def quick(undrawn: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without pictures, and with fewer simulated tables, of which no test here is."""
    monkeypatch.setattr("tactileq.analysis.chapters.confusions.similarity_choice.SIMULATIONS", 9)


LATER = """
name = "Three surfaces"
seed = 3
textures = ["leather", "MDF", "PVC"]
trays = {leather = "A", MDF = "B", PVC = "C"}
[absolute]
participants = 4
schedule = "interleaved"
[[plan.claims]]
name = "as strong"
task = "absolute"
measure = "magnitude_similarity"
models = ["full", "simplified"]
bounds = [-9, 9]
test = "equivalence"
"""


@pytest.fixture
def data(simulated: Path, tmp_path: Path) -> Path:
    """A copy of the simulated study."""
    return shutil.copytree(simulated, tmp_path / "data")


def claims(folder: Path) -> pd.DataFrame:
    return pd.read_csv(folder / "tables/claim_tests.tsv", sep="\t", na_values="n/a")


def test_claims_are_those_of_the_study_and_others_exploratory(
    main, data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = sha256_of_paths([data])[str(data)]
    real = loading.load_responses

    def edited_meanwhile(*given: Any, **named: Any) -> Any:
        responses = real(*given, **named)
        (data / "notes.txt").write_text("added while it was read\n")
        return responses

    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(loading, "load_responses", edited_meanwhile)
        assert main("analyze", "data", "--out", "first").returncode == 0
    note = json.loads((data.parent / "first/provenance.json").read_text())
    assert note["inputs_sha256"] == {"data": before}
    tests = claims(data.parent / "first")
    planned = tests.groupby("claim")["planned"].first().to_dict()
    assert planned == {
        "as strong": "yes",
        "rated similarity of frequency pattern": "no",
        "correct rate": "no",
    }
    of_plan = tests[tests["planned"] == "yes"]
    assert set(of_plan["bound_low"]) == {-7.5}
    assert tests[tests["planned"] == "no"]["bound_low"].isna().all()
    page = (data.parent / "first/report.html").read_text(encoding="utf-8")
    assert "Planned exclusion: Whoever presses nothing." in page
    manifests = list(data.rglob("*_manifest.json"))
    plan_sha256 = json.loads(manifests[0].read_text())["plan_sha256"]
    assert f"preregistration page: {plan_sha256[:12]}" in page

    later = data.parent / "later.toml"
    later.write_text(LATER)
    assert main("analyze", "data", "--plan", "later.toml", "--out", "second").returncode == 0
    tests = claims(data.parent / "second")
    assert set(tests["planned"]) == {"no"}  # other bounds than were registered
    assert set(tests[tests["claim"] == "as strong"]["bound_high"]) == {9.0}
    # The table says of a claim what the plan says.
    registered = read_answers({"": data}, ()).plan
    same = LATER.replace("[-9, 9]", "[-7.5, 7.5]")
    another_rule = same.replace("participants = 4", "participants = 8").replace(
        "[[plan.claims]]", '[plan]\nrule = "hierarchical"\n[[plan.claims]]'
    )
    for text, known in ((LATER, False), (same, True), (another_rule, False)):
        later.write_text(text)
        (claim,) = _later_plan(later, registered).claims
        assert (claim.name, claim.planned) == ("as strong", known)


def contents(folder: Path) -> dict[Path, tuple[bytes, int]]:
    """Every file, and when it was written."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files}


def test_tables_that_differ_from_their_log_are_named_and_only_status_changes_them(
    main, data: Path
) -> None:
    good = read_answers({"": data}, ())
    (table,) = data.glob("sub-02/ses-01/beh/*_task-absolute_beh.tsv")
    table.write_text(table.read_text().replace("\t1\tn/a\tfalse", "\t0\tn/a\tfalse", 1))
    physio = next(data.glob("sub-03/ses-01/beh/*_physio.tsv.gz"))
    physio.unlink()
    before = contents(data)
    refused = main("analyze", "data")
    assert refused.returncode == 1
    assert refused.stderr.count("\n") == 1
    name = table.relative_to(data)
    assert f"1 more difference; all: tactileq verify data): {name}: " in refused.stderr
    assert "tactileq study status --data data" in refused.stderr
    assert contents(data) == before
    status = main("study", "status", "--data", "data")
    assert f"corrected from the log: data/{name}\n" in status.stdout
    assert "written from the log: 1 new file in data/sub-03/ses-01/beh\n" in status.stdout
    assert contents(data).keys() - before.keys() == {physio}
    assert read_answers({"": data}, ()).answers["absolute"].equals(good.answers["absolute"])


def test_a_damaged_session_is_named_and_nobody_is_lost_without_a_word(main, data: Path) -> None:
    good = read_answers({"": data}, ())
    (log,) = data.glob("sourcedata/sub-03/ses-01/*_task-absolute_log.jsonl")
    log.write_bytes(log.read_bytes().replace(b'"event"', b'"evemt"', 5))
    before = contents(data)
    refused = main("analyze", "data")
    assert refused.returncode == 1
    assert refused.stderr.count("\n") == 1
    assert re.search(rf"line 1 of \S*{log.name}", refused.stderr)
    assert "leave the participant out with --exclude sub-03=REASON" in refused.stderr
    status = " ".join(main("study", "status", "--data", "data").stdout.split())
    assert "1: damaged" in status
    assert f"{log.name}, got no event" in status
    assert contents(data) == before
    without = ["sub-03=damaged on the stick"]
    found = read_answers({"": data}, without)
    wanted = good.answers["absolute"][
        good.answers["absolute"]["participant_id"] != "sub-03"
    ].reset_index(drop=True)
    assert found.answers["absolute"].equals(wanted)
    assert "sub-03 was left out by hand: damaged on the stick." in found.warnings
    # Nothing of theirs is read that cannot be, and they took part: nobody is missing.
    next(data.glob("sourcedata/sub-03/ses-01/*_manifest.json")).write_text("{")
    next(data.glob("sub-03/ses-01/beh/*absolute_beh.tsv")).unlink()
    found = read_answers({"": data}, without)
    assert found.answers["absolute"].equals(wanted)
    assert found.unfinished == ()


def test_several_set_ups_have_names_and_answers_of_their_own(main, data: Path) -> None:
    for words, told in (
        (("data", "data"), "expected a name of its own for each of several set-ups"),
        (("here=data", "there=data"), "expected answers of its own at the set-up 'there'"),
    ):
        refused = main("analyze", *words)
        assert refused.returncode == 1
        assert told in refused.stderr
        assert refused.stderr.count("\n") == 1


def test_incomplete_pairs_are_refused_and_complete_ones_offered(main, data: Path) -> None:
    (path,) = data.glob("sub-03/ses-01/beh/*_task-absolute_beh.tsv")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))
    shutil.rmtree(data / "sourcedata")  # as in data that are given to others
    sidecar = path.with_suffix(".json")
    described = json.loads(sidecar.read_text())
    described["Files"][path.name] = sha256_of_file(path)
    sidecar.write_text(json.dumps(described))
    refused = main("analyze", "data")
    assert refused.returncode == 1
    assert refused.stderr.count("\n") == 1
    assert "too few of sub-03 (absolute evaluation of " in refused.stderr
    assert "--complete" in refused.stderr
    assert not (data.parent / "analysis-results").exists()
    assert main("analyze", "data", "--complete", "--out", "complete").returncode == 0
    tests = claims(data.parent / "complete").set_index(["claim", "texture"])
    row = tests.loc[("as strong", "all textures")]
    assert (row["n"], row["excluded"]) == (3, "sub-03")
    assert main("analyze", "data", "--exclude", "sub-03=left", "--out", "without").returncode == 0
    page = (data.parent / "without/report.html").read_text(encoding="utf-8")
    assert "sub-03 was left out by hand: left." in page
    # Who was left out took part: nobody is missing.
    assert "interim, no verdict" not in set(claims(data.parent / "without")["verdict"])
    unknown = main("analyze", "data", "--exclude", "sub-77=left")
    assert unknown.returncode == 1
    assert "such as sub-01" in unknown.stderr
