"""What others put into a folder while its successor is made, and a loss of power, cost nothing."""

from __future__ import annotations

import os
import shutil
import stat
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.modeling.files import folders, places
from tactileq.modeling.files.folders import contents_of, folder_behind, replace_folder
from tactileq.modeling.files.locks import Lock, is_held
from tactileq.modeling.files.places import LOCK_NAME, locked
from tactileq.modeling.files.writing import write_files
from tests.power_cut import Files, laid_out, watched
from tests.refusals import refused

OLD: Files = {"set": None, "set/figures": None, "set/a": b"old", "set/figures/b": b"old"}
NEW: Files = {"set": None, "set/a": b"new"}
Change = Callable[[Path], object]


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return laid_out(OLD, tmp_path / "place") / "set"


def files_in(folder: Path) -> Files:
    return {
        path.relative_to(folder).as_posix(): None if path.is_dir() else path.read_bytes()
        for path in folder.rglob("*")
    }


def another_run(target: Path) -> None:
    with replace_folder(target) as fresh:
        (fresh / "a").write_bytes(b"another's")


CHANGES: dict[str, Change] = {
    "a new file": lambda target: (target / "mine").write_bytes(b"mine"),
    "a new file below": lambda target: (target / "figures/mine").write_bytes(b"mine"),
    "a new folder": lambda target: (target / "mine").mkdir(),
    "a file changed": lambda target: (target / "a").write_bytes(b"Old"),
    "a file replaced": lambda target: write_files({target / "a": b"Old"}),
    "another run": another_run,
    "a file in its place": lambda target: (shutil.rmtree(target), target.write_bytes(b"mine")),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("when", ["after the check", "while it is filled"])
def test_what_others_changed_stays_and_the_new_is_beside(
    target: Path, change: Change, when: str
) -> None:
    seen = contents_of(folder_behind(target)) if when == "after the check" else None
    if seen is not None:
        change(target)
    refused = None
    try:
        with replace_folder(target, seen) as fresh:
            (fresh / "a").write_bytes(b"new")
            if seen is None:
                change(target)
            before = files_in(target.parent)
    except InputError as error:
        refused = str(error)
    assert refused is not None
    assert f"What was made is in {target}-2." in refused
    after = files_in(target.parent)
    assert after == {
        **{name: data for name, data in before.items() if "unfinished" not in name},
        "set-2": None,
        "set-2/a": b"new",
    }


def test_what_came_where_nothing_was_stays(tmp_path: Path) -> None:
    target = tmp_path / "set"

    def replaced() -> None:
        with replace_folder(target) as fresh:
            (fresh / "a").write_text("new")
            target.mkdir()
            (target / "a").write_text("mine")
            (tmp_path / "set-2").mkdir()

    with refused(InputError, expected=target, got=["a", tmp_path / "set-3"]):
        replaced()
    assert (target / "a").read_text() == "mine"


def test_what_comes_between_the_two_moves_stays(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared = folders._check_same

    def meanwhile(*given: object) -> None:
        compared(*given)  # type: ignore[arg-type]
        if not target.exists():
            target.mkdir()
            (target / "mine").write_bytes(b"mine")

    monkeypatch.setattr(folders, "_check_same", meanwhile)
    with refused(InputError, expected=target, got="mine"), replace_folder(target) as f:
        (f / "a").write_bytes(b"new")
    kept = {(path.name, (path / "a").exists()) for path in target.parent.iterdir()}
    assert kept == {("set", False), ("set-2", True), ("set-3", True)}
    assert (target / "mine").read_bytes() == b"mine"


def test_behind_a_lock_that_nobody_gives_back_the_new_is_kept(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(places, "WAIT_S", 0.1)
    lock = Lock(target.parent / places.LOCK_NAME)

    def replaced() -> None:
        with replace_folder(target) as fresh:
            (fresh / "a").write_bytes(b"new")
            lock.acquire(0)

    with refused(
        InputError,
        expected=target.parent,
        got=[f"process {os.getpid()}", target.with_name("set-2")],
    ):
        replaced()
    lock.release()
    assert files_in(target.parent) == {**OLD, "set-2": None, "set-2/a": b"new"}


@pytest.mark.parametrize("there", [True, False])
def test_without_power_the_folder_is_the_old_or_the_new_one(tmp_path: Path, there: bool) -> None:
    disk_folder = laid_out(OLD if there else {}, tmp_path / "disk")
    with watched(disk_folder) as disk:
        with replace_folder(disk_folder / "set") as fresh:
            (fresh / "a").write_bytes(b"new")
        disk.told = 1
    old: Files = OLD if there else {}
    for number, (files, told) in enumerate(disk.cuts):
        left = laid_out(files, tmp_path / f"cut-{number}")
        folder_behind(left / "set")
        assert files_in(left) in ((NEW,) if told else (old, NEW))
    assert len(disk.cuts) > 10


def test_without_power_files_of_a_group_are_whole_and_the_last_names_the_first(
    tmp_path: Path,
) -> None:
    old: Files = {"a": b"old", "index": b""}
    disk_folder = laid_out(old, tmp_path / "disk")
    with watched(disk_folder) as disk:
        write_files({disk_folder / "a": b"new", disk_folder / "index": b"a"})
        disk.told = 1
    for number, (files, told) in enumerate(disk.cuts):
        left = laid_out(files, tmp_path / f"cut-{number}")
        folder_behind(left / "set")
        found = files_in(left)
        assert found in (old, {**old, "a": b"new"}, {"a": b"new", "index": b"a"})
        if told or found["index"]:
            assert found == {"a": b"new", "index": b"a"}


def test_who_writes_into_it_meanwhile_ends_first_and_is_seen(target: Path) -> None:
    holds, goes_on = threading.Event(), threading.Event()

    def write() -> None:
        with locked(target / "mine"):
            holds.set()
            assert goes_on.wait(500)
            (target / "mine").write_bytes(b"mine")

    def replace() -> None:
        with replace_folder(target) as fresh:
            (fresh / "a").write_bytes(b"new")
            writer.start()
            assert holds.wait(500)
            threading.Timer(0.1, goes_on.set).start()

    writer = threading.Thread(target=write)
    with refused(InputError, expected=target, got="mine"):
        replace()
    writer.join()
    assert files_in(target.parent) == {
        **{name: data for name, data in OLD.items() if name},
        "set/mine": b"mine",
        "set-2": None,
        "set-2/a": b"new",
    }


def test_what_was_there_is_deleted_once_others_may_go_on(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: dict[str, bool] = {}
    real = shutil.rmtree

    def slow(path: Path, **options: bool) -> None:
        held[Path(path).name] = is_held(target.parent / LOCK_NAME)
        real(path, **options)

    monkeypatch.setattr(shutil, "rmtree", slow)
    with replace_folder(target) as fresh:
        (fresh / "a").write_bytes(b"new")
    assert held["set.old"] is False
    assert files_in(target.parent) == NEW


def test_a_dot_file_that_is_no_lock_of_ours_is_somebody_elses(target: Path) -> None:
    for name in (".renv.lock", ".mine", "tactileq.lock", f".log{LOCK_NAME}"):
        (target / name).write_bytes(b"mine")
    seen = contents_of(target).keys()
    assert {".renv.lock", ".mine", "tactileq.lock"} < seen
    assert f".log{LOCK_NAME}" not in seen


def test_a_caller_that_goes_elsewhere_meanwhile_moves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    home.mkdir()
    elsewhere.mkdir()
    monkeypatch.chdir(home)
    with replace_folder("made") as fresh:
        monkeypatch.chdir(elsewhere)
        (fresh / "a").write_text("1")
    assert (home / "made" / "a").read_text() == "1"
    assert list(elsewhere.iterdir()) == []


@pytest.mark.parametrize("mask", [0o002, 0o022, 0o077])
def test_the_mask_says_who_may_read_and_write(target: Path, mask: int) -> None:
    target.parent.chmod(0o2755)
    before = os.umask(mask)
    try:
        another_run(target)
        write_files({target / "b": b"beside"})
    finally:
        os.umask(before)
    assert stat.S_IMODE(target.stat().st_mode) == 0o2000 | 0o777 & ~mask  # its group is that above
    for path in (target / "a", target / "b"):
        assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask
