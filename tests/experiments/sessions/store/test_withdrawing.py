"""Somebody who withdraws leaves nothing; somebody who drops out leaves the slot."""

from __future__ import annotations

import os
import shutil
import signal
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tactileq.experiments.sessions.bids.export import Exported, export_all
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store import withdrawing
from tactileq.experiments.sessions.store.session_store import SessionStore
from tactileq.experiments.sessions.store.withdrawing import drop_out, files_of, withdraw
from tactileq.modeling import InputError
from tests.experiments.sessions.store.enrolling import enrolled
from tests.refusals import refused

PEOPLE = {"simulated_participant": False, "simulated_rig": False}


@pytest.fixture
def root(write_session) -> Path:
    """Two people; the first one's answers to the questions are like nobody else's."""
    files = write_session(answers={"age": 31, "hours_of_sleep": 6.1258364}, **PEOPLE)
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
    assert holding(root, "6.1258364")
    withdraw(root, 1)
    assert holding(root, code, "6.1258364", "sub-01") == []
    assert files_of(root, 1) == ()
    people = pd.read_csv(root / "participants.tsv", sep="\t")
    assert people["participant_id"].tolist() == ["sub-02"]
    assert len(files_of(root, 2)) > 10


def test_the_slot_goes_to_a_replacement_and_the_number_to_nobody(root, write_session):
    withdraw(root, 1)
    with refused(InputError, got=["subject 1", "withdrew"]):
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


def test_somebody_whose_number_begins_alike_keeps_the_row(root, write_session):
    """Also where it could not be made again, since what it was made from is damaged."""
    for before, number in ((1, 10), (2, 100)):  # in the place of a dropout
        drop_out(root, before)
        write_session(subject=number, **PEOPLE)
    export_all(root)
    (log,) = root.glob("sourcedata/sub-100/ses-01/*_log.jsonl")
    log.write_bytes(log.read_bytes().replace(b'"trial": 4', b'"trial": "4"'))
    withdraw(root, 10)
    people = pd.read_csv(root / "participants.tsv", sep="\t")
    assert people["participant_id"].tolist() == ["sub-01", "sub-02", "sub-100"]


def test_the_last_one_leaves_an_empty_list(root):
    withdraw(root, 1)
    withdraw(root, 2)
    assert (root / "participants.tsv").read_text().count("\n") == 1
    assert export_all(root) == Exported()


@pytest.mark.parametrize("broken", ["sourcedata", "sub-01"])
def test_begun_again_it_goes_on_where_it_was_stopped(root, monkeypatch, broken):
    real = withdrawing.shutil.rmtree

    def failing(folder: Path, **given: bool) -> None:
        if broken in folder.parts:
            raise OSError(5, "a disk that fails", str(folder))
        real(folder, **given)

    monkeypatch.setattr(withdrawing.shutil, "rmtree", failing)
    with pytest.raises(OSError, match="fails"):
        withdraw(root, 1)
    monkeypatch.undo()
    withdraw(root, 1)
    assert holding(root, "6.1258364", "sub-01") == []
    with refused(InputError, expected="subject", got=1):
        withdraw(root, 1)


CALLS = ("write", "fsync", "replace", "rename", "unlink", "rmdir", "truncate", "mkdir")


def killed_at(call: int, work: Callable[[], object]) -> bool:
    """Do this in a process that kills itself before such a call that changes the disk."""
    child = os.fork()
    if child == 0:
        counted = Counter[str]()

        def wrapped(real: Callable[..., Any]) -> Callable[..., Any]:
            def counting(*given: Any, **named: Any) -> Any:
                counted["calls"] += 1
                if counted["calls"] == call:
                    os.kill(os.getpid(), signal.SIGKILL)
                return real(*given, **named)

            return counting

        for name in CALLS:
            setattr(os, name, wrapped(getattr(os, name)))
        try:
            work()
        finally:
            os._exit(0)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


def test_killed_anywhere_it_is_begun_again_and_the_others_can_go_on_meanwhile(root, tmp_path):
    code = Roster(root).subjects()[1]["code"]
    others = {path: path.read_bytes() for path in root.rglob("*sub-02*") if path.is_file()}
    killed = 0
    while True:
        data = tmp_path / f"killed-{killed}" / "data"
        shutil.copytree(root, data)
        if not killed_at(killed + 1, lambda data=data: withdraw(data, 1)):
            break
        killed += 1
        if killed % 2:  # another session ends meanwhile
            export_all(data)
        begun = Roster(data).subjects()[1]["left"] == "withdrawn"
        if begun and not files_of(data, 1) and not holding(data, "sub-01"):
            with refused(InputError, expected="subject", got=1):
                withdraw(data, 1)
            export_all(data)
        else:
            withdraw(data, 1)
        assert holding(data, code, "6.1258364", "sub-01") == []
        assert Roster(data).subjects()[1]["left"] == "withdrawn"
        for path, contents in others.items():
            assert (data / path.relative_to(root)).read_bytes() == contents
        people = pd.read_csv(data / "participants.tsv", sep="\t")
        assert people["participant_id"].tolist() == ["sub-02"]
        assert not [path for path in data.rglob(".*") if path.name != ".bidsignore"]
        shutil.rmtree(data)
    assert killed > 30


@pytest.mark.parametrize("leave", [withdraw, drop_out])
def test_a_running_session_and_a_stranger_are_refused(root, leave):
    (path,) = root.rglob("sub-01*relative_manifest.json")
    before = files_of(root, 1)
    with (
        SessionStore.resume(root, SessionManifest.load(path)),
        refused(InputError, expected="subject 1", got="sub-01_ses-01_task-relative"),
    ):
        leave(root, 1)
    assert files_of(root, 1) == before
    for number in (0, 9):
        with refused(InputError, expected="subject", got=number):
            leave(root, number)
    with refused(InputError, expected="folder", got=[root / "elsewhere", "--data"]):
        leave(root / "elsewhere", 1)
