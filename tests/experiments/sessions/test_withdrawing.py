"""Somebody who withdraws leaves nothing; somebody who drops out leaves the slot."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from experiments.sessions import withdrawing
from experiments.sessions.bids import export_all
from experiments.sessions.manifest import SessionManifest
from experiments.sessions.roster import Roster
from experiments.sessions.store import SessionStore
from experiments.sessions.withdrawing import drop_out, files_of, withdraw
from modeling import InputError
from tests.experiments.sessions.enrolling import enrolled

PEOPLE = {"simulated_participant": False, "simulated_rig": False}


@pytest.fixture
def root(write_session) -> Path:
    """Two people; the first one's answers to the questions are like nobody else's."""
    files = write_session(answers={"age": 31, "hours_of_sleep": 6.125}, **PEOPLE)
    write_session("relative", answered=3, status=None, **PEOPLE)
    write_session(subject=2, answers={"age": 22, "hours_of_sleep": 7.5}, **PEOPLE)
    export_all(files.root)
    return files.root


def holding(root: Path, *texts: str) -> list[Path]:
    """Every file with one of these texts in its contents or its name."""
    return [
        path
        for path in root.rglob("*")
        if any(
            text in path.name or (path.is_file() and text.encode() in path.read_bytes())
            for text in texts
        )
    ]


def test_nothing_remains_of_somebody_who_withdraws(root):
    code = Roster(root).subjects()[1]["code"]
    assert holding(root, code)
    assert holding(root, "6.125")
    withdraw(root, 1)
    assert holding(root, code, "6.125", "sub-01") == []
    assert files_of(root, 1) == ()
    people = pd.read_csv(root / "participants.tsv", sep="\t")
    assert people["participant_id"].tolist() == ["sub-02"]
    assert len(files_of(root, 2)) > 10


def test_the_slot_goes_to_a_replacement_and_the_number_to_nobody(root, write_session):
    withdraw(root, 1)
    with pytest.raises(InputError, match="withdrew"):
        enrolled(Roster(root), 1, 2)
    assert enrolled(Roster(root), 3, 2).slot == 1
    write_session(subject=3, **PEOPLE)


def test_a_dropout_keeps_the_data(root):
    before = files_of(root, 1)
    drop_out(root, 1)
    assert files_of(root, 1) == before
    people = pd.read_csv(root / "participants.tsv", sep="\t")
    assert people["status"].tolist() == ["dropped", "enrolled"]
    assert enrolled(Roster(root), 3, 2).slot == 1
    withdraw(root, 1)
    assert files_of(root, 1) == ()


def test_the_last_one_leaves_an_empty_list(root):
    withdraw(root, 1)
    withdraw(root, 2)
    assert (root / "participants.tsv").read_text().count("\n") == 1
    assert export_all(root) == ()


@pytest.mark.parametrize("broken", ["sourcedata", "sub-01"])
def test_begun_again_it_goes_on_where_it_was_stopped(root, monkeypatch, broken):
    real = withdrawing.shutil.rmtree

    def failing(folder: Path) -> None:
        if broken in folder.parts:
            raise OSError(5, "a disk that fails", str(folder))
        real(folder)

    monkeypatch.setattr(withdrawing.shutil, "rmtree", failing)
    with pytest.raises(OSError, match="fails"):
        withdraw(root, 1)
    monkeypatch.undo()
    withdraw(root, 1)
    assert holding(root, "6.125", "sub-01") == []
    with pytest.raises(InputError, match="expected a subject who takes part"):
        withdraw(root, 1)


@pytest.mark.parametrize("leave", [withdraw, drop_out])
def test_a_running_session_and_a_stranger_are_refused(root, leave):
    (path,) = root.rglob("sub-01*relative_manifest.json")
    before = files_of(root, 1)
    with (
        SessionStore.resume(root, SessionManifest.load(path)),
        pytest.raises(InputError, match="expected no running session of subject 1"),
    ):
        leave(root, 1)
    assert files_of(root, 1) == before
    for number in (0, 9):
        with pytest.raises(InputError, match="expected a subject who takes part"):
            leave(root, number)
    with pytest.raises(InputError, match="expected a data folder"):
        leave(root / "elsewhere", 1)
