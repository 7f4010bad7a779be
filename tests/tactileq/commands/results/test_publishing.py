"""Archives: what is listed and nothing else, marked as simulated, of days that clocks changed."""

from __future__ import annotations

import csv
import io
import json
import shutil
from dataclasses import replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from scipy.io import wavfile

from tactileq.commands.results.publishing import assemble
from tactileq.experiments.publishing.metadata import Publication, write_metadata
from tactileq.experiments.sessions.bids.validator import bids_issues
from tactileq.experiments.sessions.kept.program import program_facts
from tactileq.experiments.study.publication import AuthorSection, PublicationSection
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.experiments.verification.verifying import verify_data
from tactileq.modeling import InputError, RecordingSet
from tactileq.modeling.files.hashes import sha256_of_file
from tactileq.modeling.files.values import NameOrFile
from tactileq.modeling.models.loading import load_models
from tactileq.modeling.perception.verdicts import load_simplifications
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel, TrajectoryEntry
from tactileq.stimuli.sets.writing import write_set
from tests.experiments.verification.small_studies import (
    Person,
    Stopping,
    at_another_time,
    run_all,
    run_one,
    simplified_texture,
    small_models,
    small_study,
)
from tests.refusals import refused

TEXTURES = ("canvas", "PVC")
SECRET = b"Anna Secret"
STATED = PublicationSection(
    authors=(AuthorSection(family="Carberry", given="Josiah"),),
    description="What people said.",
    license="CC0-1.0",
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study that has ended: its models and data."""
    folder = tmp_path_factory.mktemp("finished")
    models = small_models(TEXTURES)
    for name, of_set in models.sets.items():
        for texture, model in of_set.items():
            model.save(folder / name / f"{texture}.json")
    for texture in TEXTURES:
        simplified_texture(texture).save(folder / f"simplified/{texture}_simplification.json")
    run_all(folder / "data", small_study(TEXTURES), models)
    return folder


@pytest.fixture
def here(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "here"))


def analysis(**options: Any) -> None:
    """What the report is to archives: files that its provenance lists."""
    out = options["out"]
    out.mkdir()
    (out / "report.html").write_text("report")
    (out / "provenance.json").write_text(json.dumps({"files": ["report.html"]}))


def publication(folder: Path, study: Study | None = None, **facts: Any) -> Publication:
    return Publication(
        study=replace(study or small_study(TEXTURES), publication=STATED),
        data=folder / "data",
        models={name: folder / name for name in ("full", "simplified")},
        textures=frozenset(TEXTURES),
        **facts,
    )


def published(folder: Path, **facts: Any) -> Path:
    archive = folder / "archive"
    assemble(archive, publication(folder, **facts), analyze=analysis)
    return archive


def files_in(folder: Path) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if not p.is_dir()}


# --- Only what is listed --------------------------------------------------------------------------


def chunk(name: bytes, content: bytes) -> bytes:
    return name + len(content).to_bytes(4, "little") + content + bytes(len(content) % 2)


def with_notes(wav: bytes) -> bytes:
    """The same sound, with what recorders note before and behind it."""
    before, behind = chunk(b"bext", SECRET * 20), chunk(b"LIST", b"INFOIART" + SECRET)
    body = b"WAVE" + before + wav[12:] + behind + chunk(b"iXML", SECRET)
    return b"RIFF" + len(body).to_bytes(4, "little") + body


def recordings_in(folder: Path) -> None:
    """WAV files of two channels, of which the other one is somebody's voice."""
    rng = np.random.default_rng(3)
    for texture in TEXTURES:
        own = folder / texture
        own.mkdir(parents=True)
        sound = rng.normal(0, 0.1, (400, 2)).astype(np.float32)
        sound[:4, 1] = np.frombuffer(SECRET.ljust(16), dtype=np.float32)
        buffer = io.BytesIO()
        wavfile.write(buffer, 4000, sound)
        (own / "1.wav").write_bytes(with_notes(buffer.getvalue()))
        (own / "notes.txt").write_bytes(SECRET)
        (own / "recordings.tsv").write_text(
            f"# by {SECRET.decode()}\nfile\ttexture\tspeed_mm_s\tforce_n\tg_per_fullscale\tchannel"
            f"\trecorded_by\n1.wav\t{texture}\t100\t1\t50\t1\t{SECRET.decode()}\n"
        )


def stimuli_in(folder: Path, models: Path) -> dict[str, bytes]:
    """A stimulus set into which notes and other files were put; its files as they were."""
    hand = folder.with_name("hand.csv")
    hand.write_bytes(b"# " + SECRET + b"\ntime_s,speed_mm_s,force_n\n0,100,1\n0.1,200,1.5\n")
    threshold = folder.with_name("own.tsv")
    threshold.write_bytes(
        b"# source: measured here\n# " + SECRET + b"\nfrequency_hz\tdisplacement_um\tby\n"
        b"40\t3\t" + SECRET + b"\n1000\t0.3\t" + SECRET + b"\n"
    )
    recipe = Recipe(
        name="Small",
        level=SetLevel(mode="loudness", threshold=NameOrFile(threshold.as_posix())),
        models=(ModelEntry(models, "full"),),
        trajectories=(
            TrajectoryEntry(name="steady", speed_mm_s=100.0, force_n=1.0),
            TrajectoryEntry(name="stroke", file=hand),
        ),
        rates_hz=(8000,),
        duration_s=0.1,
        settling_s=0.1,
    )
    write_set(folder, recipe)
    written = {name: (folder / name).read_bytes() for name in files_in(folder)}
    for name in ("notes.txt", ".hidden.wav", "sources/.notes", "spectra.png"):
        (folder / name).write_bytes(SECRET)
    (folder / "hostname.wav").symlink_to("/etc/hostname")
    for path in folder.glob("*.wav"):
        if not path.is_symlink() and not path.name.startswith("."):
            path.write_bytes(with_notes(path.read_bytes()))
    with (folder / "recipe.toml").open("ab") as file:
        file.write(b"# " + SECRET + b"\n")
    return written


def test_nothing_comes_along_with_what_is_listed(here: Path) -> None:
    recordings_in(here / "recordings")
    stimuli = stimuli_in(here / "stimuli", here / "full")
    for folder in ("full", "simplified"):
        for name in ("notes.txt", ".notes", "earlier/anna.json"):
            (here / folder / name).parent.mkdir(exist_ok=True)
            (here / folder / name).write_bytes(b'{"by": "' + SECRET + b'"}')
        (here / folder / "hostname").symlink_to("/etc/hostname")
    text = tomlkit.dumps(small_study(TEXTURES).to_dict())
    (here / "plan.toml").write_bytes(text.encode() + b"# " + SECRET + b"\n")
    options = {name: str(here / name) for name in ("recordings", "simplified")}
    options |= {"models": str(here / "full"), "plan": str(here / "plan.toml")}
    archive = published(here, options=options, stimuli=here / "stimuli")
    for name in files_in(archive):
        assert SECRET not in (archive / name).read_bytes(), name
    models = {f"{texture}.json" for texture in TEXTURES}
    reasons = {f"{texture}_simplification.json" for texture in TEXTURES}
    for place in ("models/full", "reported_models/models"):
        assert files_in(archive / place) == models
    for place in ("models/simplified", "reported_models/simplified"):
        assert files_in(archive / place) == models | reasons
        assert load_simplifications(archive / place) == load_simplifications(here / "simplified")
    assert load_models(archive / "models/full") == load_models(here / "full")
    for texture in TEXTURES:
        place = f"recordings/{texture}"
        assert RecordingSet.load(archive / place) == RecordingSet.load(here / place)
        assert files_in(archive / place) == {"recordings.tsv", "0001.csv"}
    assert files_in(archive / "stimuli") == stimuli.keys()
    for name in stimuli.keys() - {"sources/stroke.csv", "sources/own.tsv"}:
        assert (archive / "stimuli" / name).read_bytes() == stimuli[name], name
    again = Recipe.load(archive / "stimuli/recipe.toml")
    rows = write_set(here / "again", again)
    assert {r.file: r.sha256 for r in rows} == {
        path.name: sha256_of_file(path) for path in (archive / "stimuli").glob("*.wav")
    }
    assert Study.load(archive / "later_plan.toml").sha256 == small_study(TEXTURES).sha256


def test_models_that_nobody_presented_stay_where_they_are(here: Path) -> None:
    archive = here / "archive"
    of_one = replace(publication(here), textures=frozenset({"PVC"}))
    assemble(archive, of_one, analyze=analysis)
    assert files_in(archive / "models") == {
        "full/PVC.json",
        "simplified/PVC.json",
        "simplified/PVC_simplification.json",
    }


def test_a_link_to_a_stimulus_elsewhere_is_refused(here: Path) -> None:
    stimuli_in(here / "stimuli", here / "full")
    (here / "stimuli/sources/.notes").unlink()
    path = next(p for p in (here / "stimuli").glob("PVC*.wav"))
    elsewhere = path.rename(here / "elsewhere.wav")
    path.symlink_to(elsewhere)
    with refused(InputError, expected=path, got=elsewhere):
        published(here, stimuli=here / "stimuli")


@pytest.mark.parametrize("is_link", [False, True])
def test_a_file_that_nothing_lists_stops_it(here: Path, is_link: bool) -> None:
    def leaves_more(**options: Any) -> None:
        analysis(**options)
        more = options["out"] / ".notes"
        more.symlink_to("/etc/hostname") if is_link else more.write_text("more")

    facts = "/etc/hostname" if is_link else "report/.notes"
    with refused(InputError, names="report/.notes", got=facts):
        assemble(here / "archive", publication(here), analyze=leaves_more)


def test_a_name_of_a_file_names_nobody_either(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.node", lambda: "haptics-lab-7")
    path = here / "full/PVC.json"
    path.rename(path.with_name("haptics-lab-7.json"))
    with refused(InputError, got=["'haptics-lab-7'", "models/full/haptics-lab-7.json"]):
        published(here)


def test_csv_is_guarded_and_bids_is_not(tmp_path: Path) -> None:
    """CSV is what spreadsheets open."""
    table = tmp_path / "archive/data/sub-01/ses-01/beh/sub-01_ses-01_task-relative_beh.tsv"
    table.parent.mkdir(parents=True)
    table.write_text("texture\tvalue\n=foam\t-3.2\n-wool\tn/a\n")
    table.with_suffix(".json").write_text("{}")
    write_metadata(tmp_path / "archive", publication(tmp_path))
    (made,) = (tmp_path / "archive/psych-ds/data").glob("*.csv")
    rows = [line.split(",")[3:] for line in made.read_text().splitlines()]
    assert rows == [["texture", "value"], ["'=foam", "-3.2"], ["'-wool", ""]]


# --- Simulated ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("participants", "rig", "mark"),
    [
        (True, True, "Simulated participants and rig"),
        (True, False, "Simulated participants"),
        (False, True, "Simulated rig"),
        (False, False, ""),
    ],
)
def test_what_was_simulated_stands_first(
    here: Path, participants: bool, rig: bool, mark: str
) -> None:
    archive = published(here, simulated_participants=participants, simulated_rig=rig)
    cited = dict(
        line.split(": ", 1)
        for line in (archive / "CITATION.cff").read_text().splitlines()
        if line.startswith(("title", "abstract"))
    )
    datacite = json.loads((archive / "datacite.json").read_text())
    psych_ds = json.loads((archive / "psych-ds/dataset_description.json").read_text())
    (crate,) = (
        entity
        for entity in json.loads((archive / "ro-crate-metadata.json").read_text())["@graph"]
        if entity["@id"] == "./"
    )
    (heading, _, told) = (archive / "README.md").read_text().splitlines()[:3]
    titles = [json.loads(cited["title"]), datacite["titles"][0]["title"], psych_ds["name"]]
    bids = json.loads((archive / "data/dataset_description.json").read_text())
    titles += [crate["name"], heading.removeprefix("# "), bids["Name"]]
    texts = [json.loads(cited["abstract"]), datacite["descriptions"][0]["description"], told]
    texts += [psych_ds["description"], crate["description"]]
    for text, stated in [*((t, "Small") for t in titles), *((t, "What people") for t in texts)]:
        assert text.startswith(mark)
        assert stated in text
        assert text.startswith(stated) is not bool(mark)


def test_an_archive_names_what_wrote_it_and_keeps_its_source_data(here: Path) -> None:
    archive = published(here)
    facts = program_facts()
    readme = (archive / "README.md").read_text()
    assert f"tactileq {facts['versions']['tactileq']}" in readme
    assert facts["git_revision"] in readme
    of_copy, of_original = ((place / "data/README").read_text() for place in (archive, here))
    assert "leave it out" in of_original
    assert "leave it out" not in of_copy
    assert "tactileq verify" in of_copy
    assert verify_data(archive / "data").differences == ()


# --- Days and levels ------------------------------------------------------------------------------


class Asked(Person):
    """Gives the first level of each question."""

    def welcome(self, intake: Any) -> dict[str, str | int]:
        return {q.name: q.levels[0] if q.levels else 20 for q in intake.questions}


LEVELS = ("+", "=1+1", "@home", "-x", "-1", "'=1", 'a "b"')


@pytest.fixture
def study_of_years(tmp_path: Path) -> Study:
    """A person who comes again after a year, one whose clock fell back; answers as formulas."""
    texts = {"en": "?", "ja": "?"}
    asked = tuple(
        Question(name=f"q{n}", levels=(level, "none"), text=texts, levels_text={"ja": ("1", "2")})
        for n, level in enumerate(LEVELS)
    )
    study, models = small_study(TEXTURES), small_models(TEXTURES)
    tasks = {"absolute": replace(study.tasks["absolute"], schedule="by-day")}
    study = replace(study, questions=(*study.questions, *asked), tasks=tasks)
    for name, of_set in models.sets.items():
        for texture, model in of_set.items():
            model.save(tmp_path / name / f"{texture}.json")
    run = partial(run_one, tmp_path / "data", study, models)
    run(respondent=Asked(1))
    with at_another_time(timedelta(days=366)):
        run(session=2, respondent=Asked(1), override="a test")
    begun = Stopping(2, after=2)
    begun.welcome = Asked(2).welcome  # type: ignore[method-assign]
    run(subject=2, respondent=begun)
    with at_another_time(-timedelta(days=1)):
        run(subject=2, respondent=Asked(2), resume=True, override="a test")
    return study


def test_neither_years_nor_clocks_nor_levels_stop_it(study_of_years: Study, tmp_path: Path) -> None:
    archive = published(tmp_path, study=study_of_years)
    data = archive / "data"
    assert [i for i in bids_issues(data) if i["severity"] == "error"] == []
    assert verify_data(data).differences == ()
    sessions = (data / "sub-01/sub-01_sessions.tsv").read_text().splitlines()
    assert [line.split("\t")[:2] for line in sessions[1:]] == [["ses-01", "0"], ["ses-02", "366"]]
    with (data / "participants.tsv").open(newline="") as file:
        people = list(csv.DictReader(file, delimiter="\t"))
    assert [[row[f"q{n}"] for n in range(len(LEVELS))] for row in people] == [[*LEVELS]] * 2
    for table in [*tmp_path.glob("data/sub-*/*.tsv"), *tmp_path.glob("data/**/*_beh.tsv")]:
        assert (data / table.relative_to(tmp_path / "data")).read_bytes() == table.read_bytes()
