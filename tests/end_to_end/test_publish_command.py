"""tactileq publish: an archive that stands alone, and what stops it."""

from __future__ import annotations

import contextlib
import csv
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from rocrate.rocrate import ROCrate

from tactileq.experiments.console.languages import Texts, texts_of_study
from tactileq.experiments.sessions.kept.stored_sessions import held_sessions
from tactileq.experiments.study.study import Study
from tactileq.modeling import RecordingSet
from tactileq.modeling.files.hashes import seal_over
from tactileq.stimuli.planted.textures import RECORDER_RATE_HZ, planted_texture, record_texture
from tests.experiments.verification.small_studies import (
    run_all,
    simplified_texture,
    small_models,
    small_study,
)
from tests.opened import compared_with_provenance

TEXTURES = ("canvas", "PVC")
PAGE = Path(__file__).parents[2] / "docs/method/publishing.md"
PUBLICATION = {
    "license": "CC-BY-4.0",
    "ethics": "Board 7, 2026-12",
    "funding": ["Grant 1"],
    "keywords": ["haptics"],
    "authors": [{"family": "Carberry", "given": "Josiah", "orcid": "0000-0002-1825-0097"}],
}


@pytest.fixture(autouse=True)
def quick(undrawn: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without pictures, and with fewer simulated tables, of which no test here is."""
    monkeypatch.setattr("tactileq.analysis.chapters.confusions.similarity_choice.SIMULATIONS", 9)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study that has ended: its file, models and data."""
    folder = tmp_path_factory.mktemp("whole")
    study, models = small_study(TEXTURES), small_models(TEXTURES)
    for name, of_set in models.sets.items():
        (folder / name).mkdir()
        for texture, model in of_set.items():
            model.save(folder / name / f"{texture}.json")
    for texture in TEXTURES:
        simplified_texture(texture).save(folder / f"simplified/{texture}_simplification.json")
    texts = {"en": {**Texts.load("en").by_key, "rest.title": "Put down the pen"}}
    sources = {name: name for name in models.sets}
    run_all(folder / "data", study, models, sources=sources, texts=texts)
    write_study(folder, PUBLICATION)
    return folder


def write_study(folder: Path, publication: dict[str, object]) -> None:
    values = small_study(TEXTURES).to_dict()
    stated = {"publication": publication} if publication else {}
    (folder / "study.toml").write_text(tomlkit.dumps({**values, **stated}))


@pytest.fixture
def here(whole: Path, tmp_path: Path) -> Path:
    """A copy of it, where commands run."""
    return Path(shutil.copytree(whole, tmp_path, dirs_exist_ok=True))


def test_an_archive_stands_alone(main, here: Path, tmp_path_factory, monkeypatch) -> None:
    assert main("analyze", "data", "--seed", "3", "--out", "results").returncode == 0
    words = ("publish", "data", "--study", "study.toml", "--results", "results", "--out", "arch")
    with compared_with_provenance(here, monkeypatch, "arch/provenance.json"):
        done = main(*words)
        assert done.returncode == 0, done.stderr
    note = json.loads((here / "arch/provenance.json").read_text())
    assert f"seal of the archive: {note['seal']}" in done.stdout
    assert note["seal"] == seal_over(note["sha256"])
    held, _ = held_sessions(here / "data")
    seals = {one.files.stem: one.state.events[-1]["seal"] for one in held}
    assert note["original_seals"] == seals

    alone = tmp_path_factory.mktemp("alone")
    shutil.move(here / "arch", alone / "arch")
    for name in ("data", "full", "simplified", "results", "study.toml"):
        path = here / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    archive = alone / "arch"
    verified = main("verify", archive)
    assert (verified.returncode, verified.stderr) == (0, "")
    told = verified.stdout.splitlines()
    assert told[0].startswith("4 of 4 sessions verified, seal ")
    assert told[1].endswith(f"as written, seal {note['seal']}")
    assert told[2] == "models verified: 2 sets of 2"
    assert told[3].endswith("made again: the same")
    study = Study.load(archive / "study.toml")
    assert study.sha256 == small_study(TEXTURES).sha256
    assert texts_of_study(study)["en"].of("rest.title") == "Put down the pen"

    (shown,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), flags=re.DOTALL)
    made: dict[str, Any] = {}
    with contextlib.chdir(archive):
        exec(shown, made)
    assert made["vibration_g"].size > 0

    crate = ROCrate(archive)  # which refuses what is no RO-Crate
    assert {part.id for part in crate.root_dataset["hasPart"]} >= {"data/", "models/", "report/"}
    assert [person["familyName"] for person in crate.root_dataset["author"]] == ["Carberry"]
    description = json.loads((archive / "data/dataset_description.json").read_text())
    assert description["Authors"] == ["Josiah Carberry"]
    assert description["License"] == "CC-BY-4.0"
    answers = sorted((archive / "psych-ds/data").glob("*_data.csv"))
    assert len(answers) == 4
    psych = json.loads((archive / "psych-ds/dataset_description.json").read_text())
    measured = {variable["name"] for variable in psych["variableMeasured"]}
    for path in answers:
        with path.open(newline="") as file:
            header, *rows = csv.reader(file)
        assert set(header) <= measured
        table = next((archive / "data").glob(f"*/*/beh/*{path.name.split('_')[2]}_beh.tsv"))
        assert len(rows) == len(table.read_text().splitlines()) - 1

    table = archive / "report/tables/claims.tsv"
    table.write_text("edited\n")
    changed = main("verify", archive)
    assert changed.returncode == 1
    assert "report/tables/claims.tsv: expected the file that was written" in changed.stderr


@pytest.mark.parametrize(
    ("publication", "words", "told"),
    [
        ({}, (), "[[publication.authors]]"),
        ({"license": None}, (), 'a licence of the data, got "not stated"'),
        ({"model_licenses": {"full": "No redistribution"}}, (), "--without full"),
        ({}, ("--models", "full=simplified"), "the full model of "),
    ],
)
def test_what_is_not_to_be_published_stops_it(
    main, here: Path, publication: dict[str, object], words: tuple[str, ...], told: str
) -> None:
    stated = {**PUBLICATION, **publication} if publication or words else {}
    write_study(here, {name: value for name, value in stated.items() if value is not None})
    refused = main("publish", "data", "--study", "study.toml", "--out", "arch", *words)
    assert refused.returncode == 1
    assert refused.stderr.count("\n") == 1
    assert told in refused.stderr
    assert not (here / "arch").exists()


def test_models_that_may_not_be_given_on_are_left_out(main, here: Path) -> None:
    write_study(here, {**PUBLICATION, "model_licenses": {"full": "All rights reserved"}})
    words = ("--study", "study.toml", "--without", "full", "--out", "arch")
    done = main("publish", "data", *words)
    assert done.returncode == 0, done.stderr
    kept = {path.name for path in (here / "full").iterdir()}
    found = [path.relative_to(here / "arch") for path in (here / "arch").rglob("*.json")]
    assert {path.parts[:2] for path in found if path.name in kept} == {("models", "simplified")}
    verified = main("verify", "arch")
    assert (verified.returncode, verified.stderr) == (0, "")
    assert "models verified: 1 set of 1" in verified.stdout


def test_what_names_a_person_or_a_machine_stops_it(main, here: Path, monkeypatch) -> None:
    monkeypatch.setattr("platform.node", lambda: "haptics-lab-7")
    write_study(here, {**PUBLICATION, "ethics": "asked for at haptics-lab-7"})
    refused = main("publish", "data", "--study", "study.toml", "--out", "arch")
    assert refused.returncode == 1
    assert "got 'haptics-lab-7' in " in refused.stderr
    assert not (here / "arch").exists()


def test_data_that_differ_are_not_published(main, here: Path) -> None:
    hand = next((here / "data/sourcedata").rglob("*_hand.tsv"))
    hand.write_text(hand.read_text() + hand.read_text().splitlines()[-1] + "\n")
    refused = main("publish", "data", "--study", "study.toml", "--out", "arch")
    assert refused.returncode == 1
    assert hand.name in refused.stderr
    another = (here / "study.toml").read_text().replace("seed = 11", "seed = 12")
    (here / "study.toml").write_text(another)
    shutil.rmtree(here / "data")
    assert main("publish", "data", "--study", "study.toml", "--out", "arch").returncode == 1


def test_validate_counts_errors(main, here: Path) -> None:
    good = main("study", "validate", "data")
    assert (good.returncode, good.stderr) == (0, "")
    assert good.stdout.startswith("BIDS: 0 errors, ")
    description = here / "data/dataset_description.json"
    values = json.loads(description.read_text())
    values.pop("Name")
    description.write_text(json.dumps(values))
    bad = main("study", "validate", "data")
    assert bad.returncode == 1
    assert "dataset_description.json" in bad.stderr


# --- What systems put beside files ----------------------------------------------------------------

TWIN = b"\0\5\x16\7\0\2\0\0Mac OS X        \xb0\xff"
COMMANDS = (
    ("verify", "data"),
    ("study", "status", "--study", "study.toml", "--data", "data"),
    ("study", "check", "checked.toml"),
    ("stimuli", "full", "--speed", "150", "--force", "1", "--out", "set"),
    ("simplify", "full/canvas.json", "--threshold", "codec", "--out", "again"),
    ("model", "recordings", "--layers", "1", "--out", "fitted"),
    ("analyze", "data", "--seed", "3", "--out", "results"),
    ("verify", "data", "results"),
    ("publish", "data", "--study", "study.toml", "--results", "results", "--out", "arch"),
    ("verify", "arch"),
)


def contents(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


def put_beside_files(here: Path) -> None:
    for folder in {path.parent for path in here.rglob("*")}:
        for path in [path for path in folder.glob("[!.]*") if path.is_file()]:
            path.with_name(f"._{path.name}").write_bytes(TWIN)
        for name in (".DS_Store", "Thumbs.db", "desktop.ini"):
            (folder / name).write_bytes(b"\0\0\0\1Bud1")


def test_twins_of_files_and_views_of_folders_change_nothing(main, here: Path) -> None:
    """macOS puts them on disks of other systems and network shares."""
    for texture in TEXTURES:
        truth = planted_texture(texture, rate_hz=RECORDER_RATE_HZ)
        few = record_texture(truth, duration_s=0.5).recordings[:4]
        RecordingSet(few).save(here / "recordings" / texture)

    places = {"models": {"full": "full", "simplified": "simplified"}}
    checked = {**small_study(TEXTURES).to_dict(), **places}
    (here / "checked.toml").write_text(tomlkit.dumps(checked))

    def told() -> list[tuple[int, str, str]]:
        done = [main(*words) for words in COMMANDS]
        return [(one.returncode, one.stdout, one.stderr) for one in done]

    plain = told()
    assert [one for one in plain if one[0]] == []
    archived = contents(here / "arch")
    put_beside_files(here)  # beside what is read, and in results that are replaced
    assert told() == plain
    assert contents(here / "arch") == archived
