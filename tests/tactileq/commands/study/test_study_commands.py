"""What tactileq study status shows, and what withdraw and dropout ask."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner

from tactileq.commands.study.status import table_of
from tactileq.commands.study.withdraw import study_dropout, study_withdraw
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store.status import (
    PersonProgress,
    SessionProgress,
    StudyProgress,
    TaskProgress,
)
from tactileq.experiments.study.study import SHIPPED_STUDY, Study
from tactileq.modeling import InputError
from tests.experiments.sessions.store.enrolling import enrolled
from tests.refusals import refused


def test_every_person_and_session_has_its_place():
    session = SessionProgress(task="relative", session=2, status="aborted", answered=5, planned=14)
    people = (
        PersonProgress(subject=1, slot=1, code="TAKI-46", left="", sessions=(session,), due="x 2"),
        PersonProgress(subject=2, slot=2, code="", left="withdrawn", sessions=()),
    )
    tasks = (TaskProgress(task="relative", complete=0, planned=4),)
    screen = io.StringIO()
    Console(file=screen, width=120).print(table_of(StudyProgress(people=people, tasks=tasks)))
    told = [line.split() for line in screen.getvalue().splitlines()]
    shown = [" ".join(word for word in words if word.isprintable()) for words in told]
    (first,) = [line for line in shown if "TAKI-46" in line]
    assert "2: aborted, 5 of 14" in first
    assert first.strip("│ ").endswith("x 2")
    assert any("withdrawn, data deleted" in line for line in shown)


def test_on_a_narrow_terminal_no_word_is_cut_off():
    names = ("absolute", "relative", "oddity", "threshold")
    sessions = tuple(
        SessionProgress(task=name, session=1, status="complete", answered=16, planned=16)
        for name in names
    )
    person = PersonProgress(
        subject=1, slot=1, code="TAKI-46", left="", sessions=sessions, due="relative 2, not before"
    )
    tasks = tuple(TaskProgress(task=name, complete=1, planned=4) for name in names)
    screen = io.StringIO()
    table = table_of(StudyProgress(people=(person,), tasks=tasks))
    Console(file=screen, width=80).print(table)
    assert "…" not in screen.getvalue()


@pytest.fixture
def app() -> typer.Typer:
    app = typer.Typer()
    app.command("withdraw")(study_withdraw)
    app.command("dropout")(study_dropout)
    return app


@pytest.fixture
def data(tmp_path: Path) -> Path:
    enrolled(Roster(tmp_path), 1, 2)
    beh = tmp_path / "sub-01" / "ses-01" / "beh"
    beh.mkdir(parents=True)
    (beh / "answers.tsv").write_text("mine")
    return tmp_path


@pytest.mark.parametrize("command", ["withdraw", "dropout"])
def test_nothing_happens_without_a_yes(app, data, command):
    ended = CliRunner().invoke(app, [command, "1", "--data", str(data)], input="n\n")
    assert "nothing was changed" in str(ended.exception)
    assert Roster(data).subjects()[1]["left"] == ""
    assert (data / "sub-01" / "ses-01" / "beh" / "answers.tsv").read_text() == "mine"


@pytest.mark.parametrize(
    ("command", "left", "told"),
    [
        ("withdraw", "withdrawn", "1 file deleted, the slot is free"),
        ("dropout", "dropped", "the data stay, the slot is free"),
    ],
)
def test_with_a_yes_it_is_done(app, data, command, left, told):
    ended = CliRunner().invoke(app, [command, "1", "--data", str(data), "--yes"])
    assert ended.exit_code == 0, ended.output
    assert told in ended.output
    assert Roster(data).subjects()[1]["left"] == left
    assert (data / "sub-01").exists() is (command == "dropout")


@pytest.mark.parametrize("command", ["withdraw", "dropout"])
def test_the_data_of_another_study_are_refused(app, data, command):
    file = data.parent / "study.toml"
    file.write_text(SHIPPED_STUDY.read_text(encoding="utf-8"), encoding="utf-8")
    name = Study.load().name
    words = [command, "1", "--data", str(data), "--study", str(file), "--yes"]
    (data / "dataset_description.json").write_text(json.dumps({"Name": "Pebbles"}))
    with refused(InputError, expected=name, got="Pebbles"):
        raise CliRunner().invoke(app, words).exception
    assert Roster(data).subjects()[1]["left"] == ""
    (data / "dataset_description.json").write_text(json.dumps({"Name": name}))
    assert CliRunner().invoke(app, words).exit_code == 0
    assert Roster(data).subjects()[1]["left"] != ""
