"""Several processes at one place, and what killed ones leave."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from tactileq.modeling.files import places
from tactileq.modeling.files.folders import check_replaceable, replace_folder
from tactileq.modeling.files.places import (
    clear_unfinished,
    locked,
    unfinished_file,
    unfinished_folder,
)
from tactileq.modeling.files.writing import write_bytes, write_files, write_text

fork = multiprocessing.get_context("fork")
FileSizeLimit = Callable[[int], AbstractContextManager[None]]


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def in_a_process(work: Callable[[], None]) -> int:
    """Run this in a process of its own; its exit code."""
    process = fork.Process(target=work)
    process.start()
    process.join(500)
    assert process.exitcode is not None
    return process.exitcode


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def killed_while_replacing(target: Path) -> None:
    """A process dies with its fresh folder half full."""

    def work() -> None:
        with replace_folder(target) as fresh:
            (fresh / "half").write_text("x")
            die()

    assert in_a_process(work) == -signal.SIGKILL


def killed_between_renames(target: Path) -> None:
    """A process dies when the old folder is away and the new one not yet there."""
    rename = Path.rename

    def die_for_the_new_one(self: Path, place: Path) -> Path:
        if place == target:
            die()
        return rename(self, place)

    def work() -> None:
        Path.rename = die_for_the_new_one  # type: ignore[method-assign]
        with replace_folder(target) as fresh:
            (fresh / "new").write_text("x")

    assert in_a_process(work) == -signal.SIGKILL
    assert not target.exists()


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """A folder with one file."""
    with replace_folder(tmp_path / "set") as fresh:
        (fresh / "index.tsv").write_text("file\n")
    return tmp_path / "set"


def test_what_a_killed_process_left_goes_with_the_next_one(old: Path) -> None:
    killed_while_replacing(old)
    (left,) = {path.name for path in old.parent.iterdir()} - {"set"}
    assert left.startswith(".set.")
    write_text(old.parent / "another", "x")  # any result in the same folder
    assert names(old.parent) == ["another", "set", "set/index.tsv"]


def test_a_killed_write_of_a_file_leaves_nothing_for_good(old: Path) -> None:
    def work() -> None:
        os.replace = lambda *_: die()  # type: ignore[assignment]
        write_text(old / "provenance.json", "{}")

    assert in_a_process(work) == -signal.SIGKILL
    assert len(names(old)) == 3  # the lock of the folder, too
    check_replaceable(old, index_name="index.tsv", what="a set")
    assert names(old) == ["index.tsv"]


@pytest.mark.parametrize("how", ["check", "lock", "replace"])
def test_a_kill_between_two_renames_loses_nothing(old: Path, how: str) -> None:
    killed_between_renames(old)
    if how == "check":
        check_replaceable(old, index_name="index.tsv", what="a set")
    elif how == "lock":
        with locked(old):
            assert names(old) == ["index.tsv"]
    else:
        with pytest.raises(ZeroDivisionError), replace_folder(old):
            _ = 1 / 0
    assert names(old.parent) == ["set", "set/index.tsv"]


def test_what_is_still_in_use_and_what_others_hide_stays(tmp_path: Path) -> None:
    (tmp_path / ".set.backup12").mkdir()
    (tmp_path / ".set.backup12.unfinished").symlink_to(".set.backup12")
    with unfinished_folder(tmp_path / "set") as mine:
        assert in_a_process(lambda: write_text(tmp_path / "file", "x")) == 0
        clear_unfinished(tmp_path)
        assert mine.is_dir()
    assert names(tmp_path) == [".set.backup12", ".set.backup12.unfinished", "file"]


def test_processes_take_turns(tmp_path: Path) -> None:
    """Reading, adding and writing back is not broken into; nor are replacements of a folder."""
    counter, ready = tmp_path / "set/counter", fork.Barrier(6)

    def add() -> None:
        ready.wait()
        for _ in range(10):
            with locked(counter.parent):
                count = int(counter.read_text()) if counter.exists() else 0
                with replace_folder(counter.parent) as fresh:
                    write_text(fresh / "counter", str(count + 1))

    processes = [fork.Process(target=add) for _ in range(6)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(500)
    assert [process.exitcode for process in processes] == [0] * 6
    assert counter.read_text() == "60"
    assert names(tmp_path) == ["set", "set/counter"]


def test_a_fresh_folder_may_itself_be_replaced(tmp_path: Path) -> None:
    with replace_folder(tmp_path / "set") as outer, replace_folder(outer) as inner:
        (inner / "file").write_text("x")
    assert names(tmp_path) == ["set", "set/file"]


def test_files_of_a_group_are_written_all_or_none(
    tmp_path: Path, file_size_limit: FileSizeLimit
) -> None:
    first, second = tmp_path / "a.tsv", tmp_path / "b.json"
    write_files({first: b"old"})
    refused = None
    with file_size_limit(1000):
        try:
            write_files({first: b"new", second: bytes(2000)})
        except OSError as error:
            refused = error
    assert refused is not None
    assert refused.filename == str(second)
    assert names(tmp_path) == ["a.tsv"]
    second.mkdir()
    with pytest.raises(IsADirectoryError):
        write_files({first: b"new", second: b"new"})
    assert first.read_bytes() == b"old"
    assert names(tmp_path) == ["a.tsv", "b.json"]


@pytest.mark.parametrize("write", [write_bytes, Path.write_bytes])
def test_a_full_disk_is_told_of_the_place_that_was_asked_for(
    tmp_path: Path,
    write: Callable[[Path, bytes], object],
    file_size_limit: FileSizeLimit,
) -> None:
    refused = None
    with file_size_limit(1000):
        try:
            with replace_folder(tmp_path / "set") as fresh:
                write(fresh / "big", bytes(2000))
        except OSError as error:
            refused = error
    assert refused is not None
    wanted = tmp_path / "set/big" if write is write_bytes else tmp_path / "set"
    assert refused.filename == str(wanted)
    assert names(tmp_path) == []


def test_an_interruption_does_not_mix_old_and_new(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, done = os.replace, []

    def interrupted_once(hidden: Path, target: Path) -> None:
        replace(hidden, target)
        done.append(target)
        if len(done) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted_once)
    files = {tmp_path / name: name.encode() for name in ("a", "b", "c")}
    with pytest.raises(KeyboardInterrupt):
        write_files(files)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == files


@contextmanager
def raising_at_line(number: int) -> Iterator[None]:
    """A signal's handler raises at this line of `places`, counted from the first that runs."""

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal number
        if frame.f_code.co_filename != places.__file__:
            return None
        if event == "line":
            number -= 1
            if number == 0:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


@pytest.mark.parametrize(
    "make",
    [unfinished_folder, lambda target: unfinished_file(target, b"x")],
    ids=["folder", "file"],
)
def test_an_interruption_while_a_hidden_one_is_made_leaves_nothing(
    make: Callable[[Path], AbstractContextManager[Path]], tmp_path: Path
) -> None:
    for line in itertools.count(1):
        try:
            with raising_at_line(line), make(tmp_path / "place"):
                sys.settrace(None)  # not where it goes
                break
        except KeyboardInterrupt:
            pass
        # A lock's file may stay: the next one takes it over.
        assert not list(tmp_path.rglob("*.unfinished"))
    assert line > 10


def test_long_names_leave_room_for_hidden_ones(tmp_path: Path) -> None:
    write_bytes(tmp_path / ("n" * 250), b"x")
    with replace_folder(tmp_path / ("f" * 250)):
        pass
    assert [len(path.name) for path in tmp_path.iterdir()] == [250, 250]
