"""tactileq session: in which language the participant's screen is, from the first day on."""

from __future__ import annotations

import hashlib
import shutil
import tomllib
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from tactileq.commands.study.session import session
from tactileq.experiments.console.languages import Texts
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.loop.people import SessionAborted
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.modeling import InputError
from tests.experiments.scripted import Ready, Scripted
from tests.refusals import refused
from tests.two_surfaces import save_two_surfaces


class Leaves(Scripted):
    def rate(self, trial: Any, surfaces: Surfaces) -> Any:
        raise SessionAborted("tired")


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    save_two_surfaces(tmp_path, 'languages = ["en", "ja"]')
    monkeypatch.setattr("tactileq.commands.study.experimenter.Terminal", Ready)
    return tmp_path


@pytest.fixture
def language_of(place: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs a session; in which language the console was opened."""
    app = typer.Typer()
    app.command()(session)

    def run(someone: Scripted, *words: str) -> str:
        opened: list[str] = []
        someone.simulated = False  # as whoever sits at a console

        def open_console(texts: Texts, **of: Any) -> Any:
            opened.append(texts.language)
            return nullcontext(someone)

        monkeypatch.setattr("tactileq.commands.study.session.open_console", open_console)
        given = ["--task", "absolute", "--study", place / "study.toml", "--data", place / "data"]
        ended = CliRunner().invoke(app, [*map(str, given), *words])
        (place / "printed.txt").write_text(ended.output)
        if ended.exception:
            raise ended.exception
        return opened[-1]

    return run


def manifest_in(place: Path) -> SessionManifest:
    (path,) = place.rglob("*_manifest.json")
    return SessionManifest.load(path)


def test_a_session_goes_on_in_its_language_unless_another_one_is_named(
    place: Path, language_of: Any
) -> None:
    assert language_of(Leaves(), "--language", "ja") == "ja"
    assert language_of(Leaves(), "--resume") == "ja"
    assert language_of(Scripted(), "--resume", "--language", "en") == "en"
    assert manifest_in(place).language == "ja"
    (log,) = place.rglob("*_log.jsonl")
    opened = [event for event in read_log(log).events if event["event"] == "opened"]
    assert [event.get("changed", {}).get("language") for event in opened] == [None, None, "en"]


def test_a_session_begins_in_the_studys_first_language(place: Path, language_of: Any) -> None:
    assert language_of(Leaves()) == "en"
    assert manifest_in(place).language == "en"


def test_a_language_that_the_study_lost_is_refused_until_one_is_named(
    place: Path, language_of: Any
) -> None:
    language_of(Leaves(), "--language", "ja")
    file = place / "study.toml"
    file.write_text(file.read_text().replace('"en", "ja"', '"en"'))
    words = ("--resume", "--override", "nobody reads Japanese")
    with refused(InputError, expected=["language", "en"], got="'ja'"):
        language_of(Scripted(), *words)
    assert language_of(Scripted(), *words, "--language", "en") == "en"


@pytest.fixture
def own(place: Path) -> Path:
    """A file of the study's own English texts."""
    study = place / "study.toml"
    study.write_text(study.read_text().replace("[trays]", 'texts = "en.toml"\n[trays]', 1))
    file = place / "en.toml"
    file.write_text('rest.title = "Put down the pen"')
    return file


def texts_in(place: Path) -> dict[str, Path]:
    """The files of texts in the data, by their hashes."""
    files = place.glob("data/sourcedata/texts_*.toml")
    return {hashlib.sha256(file.read_bytes()).hexdigest(): file for file in files}


def test_what_a_participant_reads_is_in_the_data(place: Path, own: Path, language_of: Any) -> None:
    language_of(Leaves())
    stated = manifest_in(place).texts_sha256
    assert stated is not None
    assert sorted(stated) == ["en", "ja"]
    kept = texts_in(place)
    assert sorted(kept) == sorted(stated.values())
    for language, file in (("en", own), ("ja", None)):
        stored = kept[stated[language]]
        assert f"_{language}_{stated[language][:16]}" in stored.name
        assert tomllib.loads(stored.read_text("utf-8")) == Texts.load(language, file).by_key
    # As it stands it is a study's own file, by which a session can be run again.
    own.write_bytes(kept[stated["en"]].read_bytes())
    language_of(Leaves(), "--subject", "2")
    assert texts_in(place) == kept


def test_other_texts_than_before_need_a_reason(place: Path, own: Path, language_of: Any) -> None:
    language_of(Leaves())
    before = texts_in(place)
    own.write_text('rest.title = "Rest your hand"')
    for words in (("--resume",), ("--subject", "2")):
        with refused(InputError, expected="read" if "--subject" in words else "texts", got="en"):
            language_of(Leaves(), *words)
    assert texts_in(place) == before
    reason = ("--override", "a spelling mistake")
    language_of(Scripted(), "--resume", *reason)
    (log,) = place.rglob("*_log.jsonl")
    *_, opened = (event for event in read_log(log).events if event["event"] == "opened")
    assert opened["overrides"] == [{"what": "texts", "reason": "a spelling mistake"}]
    after = texts_in(place)
    assert set(opened["changed"]["texts_sha256"].values()) <= set(after)
    assert len(after) == len(before) + 1
    language_of(Scripted(), "--subject", "2", *reason)
    assert texts_in(place) == after


def test_the_experimenter_is_not_told_which_models_are_identical(
    place: Path, language_of: Any
) -> None:
    shutil.copy(place / "models" / "MDF.json", place / "simplified" / "MDF.json")
    language_of(Scripted())
    printed = (place / "printed.txt").read_text()
    assert "completed" in printed
    assert "MDF" not in printed
    assert list(manifest_in(place).identical) == ["MDF"]


def test_what_was_never_begun_cannot_go_on(place: Path, language_of: Any) -> None:
    with refused(
        InputError,
        expected="session",
        got=["sub-01_ses-01_task-absolute_manifest.json", "--resume"],
    ):
        language_of(Scripted(), "--resume")
    assert not list(place.rglob("*_manifest.json"))
