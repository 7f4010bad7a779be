"""Locks: one holder at a time, who is named, and nothing is left, emptied or followed."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.modeling.files import places
from tactileq.modeling.files.locks import HeldError, Lock, is_held
from tactileq.modeling.files.places import LOCK_NAME, clear_unfinished, locked
from tactileq.modeling.files.writing import write_files, write_text
from tests.refusals import refused

fork = multiprocessing.get_context("fork")


@pytest.fixture
def lock(tmp_path: Path) -> Lock:
    return Lock(tmp_path / "one.lock")


@contextmanager
def holder_of(work: Callable[[], Lock]) -> Iterator[int]:
    """The number of a process that holds a lock; it is killed when the block ends."""
    begun = fork.Event()

    def hold() -> None:
        kept = work()
        begun.set()
        signal.pause()
        kept.release()

    process = fork.Process(target=hold)
    process.start()
    assert process.pid is not None
    try:
        assert begun.wait(500)
        yield process.pid
    finally:
        process.kill()
        process.join()


def taken(path: Path) -> Lock:
    lock = Lock(path)
    lock.acquire(5)
    return lock


def test_the_holder_is_named_and_a_killed_one_gives_way(lock: Lock) -> None:
    assert not is_held(lock.path)
    assert not lock.path.exists()
    with holder_of(lambda: taken(lock.path)) as number:
        for _ in range(2):  # asking changes nothing
            assert is_held(lock.path)
        with refused(HeldError, names=f"process {number}"):
            lock.acquire(0)
        assert not lock.is_held
    assert lock.path.exists()
    assert not is_held(lock.path)
    lock.acquire(0)
    with refused(HeldError, names=f"process {os.getpid()}"):
        Lock(lock.path).acquire(0)
    lock.release()
    lock.release()
    assert not lock.path.exists()


def test_a_stopped_process_is_named_after_a_while(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(places, "WAIT_S", 0.2)
    with holder_of(lambda: taken(tmp_path / LOCK_NAME)) as number:
        os.kill(number, signal.SIGSTOP)
        with refused(InputError, expected=tmp_path, got=f"process {number}"):
            write_text(tmp_path / "file", "x")
        assert not (tmp_path / "file").exists()
    write_text(tmp_path / "file", "x")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_there_are_never_two_holders(lock: Lock) -> None:
    """Though each removes the file when it is done."""
    inside, together = fork.Value("i", 0), fork.Value("i", 0)

    def work() -> None:
        for _ in range(40):
            mine = taken(lock.path)
            inside.value += 1
            together.value += inside.value > 1
            inside.value -= 1
            mine.release()

    processes = [fork.Process(target=work) for _ in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(500)
    assert [process.exitcode for process in processes] == [0] * 4
    assert together.value == 0
    assert not lock.path.exists()


def test_threads_wait_and_a_block_holds_it_again(tmp_path: Path) -> None:
    order = []

    def other() -> None:
        with locked(tmp_path / "a"):
            order.append("other")

    with locked(tmp_path / "a"), locked(tmp_path / "b"):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join(0.05)
        order.append("first")
    thread.join(500)
    assert order == ["first", "other"]
    assert not list(tmp_path.iterdir())


def test_children_do_not_hold_it(lock: Lock) -> None:
    lock.acquire(0)
    sleeping = [sys.executable, "-c", "import time; print(flush=True); time.sleep(60)"]
    with subprocess.Popen(sleeping, stdout=subprocess.PIPE, close_fds=False) as child:
        assert child.stdout is not None
        child.stdout.readline()
        held = fork.Value("i", 2)

        def ask() -> None:
            held.value = lock.is_held
            lock.release()

        process = fork.Process(target=ask)
        process.start()
        process.join(500)
        assert (held.value, is_held(lock.path)) == (0, True)
        lock.release()
        Lock(lock.path).acquire(0)
        child.kill()


def test_what_was_planted_in_its_place_is_neither_followed_nor_emptied(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("x")
    plants: dict[str, Callable[[Path], object]] = {
        "link": lambda path: path.symlink_to(precious),
        "hard": lambda path: path.hardlink_to(precious),
        "nowhere": lambda path: path.symlink_to(tmp_path / "new"),
        "folder": Path.mkdir,
    }
    for (name, plant), got in zip(plants.items(), ("link", "file", "link", "folder"), strict=True):
        plant(tmp_path / name)
        with refused(InputError, expected=tmp_path / name, got=got):
            Lock(tmp_path / name).acquire(0)
    assert precious.read_text() == "x"
    assert not (tmp_path / "new").exists()


def test_a_disk_without_locks_is_used_without(lock: Lock, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_: int) -> bool:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr("filelock._unix.lock_fd_nonblocking", none)
    (lock.path.parent / ".file.abcdefgh.unfinished").write_text("perhaps still in use")
    lock.acquire(0)
    assert not lock.is_held
    clear_unfinished(lock.path.parent)
    write_text(lock.path.parent / "file", "x")
    names = sorted(path.name for path in lock.path.parent.iterdir())
    assert names == [".file.abcdefgh.unfinished", "file"]


def test_a_folder_that_was_moved_keeps_anothers_lock(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    with locked(folder / "file"):
        folder.rename(tmp_path / "moved")
        folder.mkdir()
        other = taken(folder / LOCK_NAME)
    assert is_held(other.path)
    other.release()


def test_files_of_two_folders_are_written_in_any_order_by_two_processes(tmp_path: Path) -> None:
    places_of_both = [tmp_path / "a/file", tmp_path / "b/file"]

    def write(order: list[Path]) -> None:
        for _ in range(10):
            write_files(dict.fromkeys(order, b"x"))

    processes = [fork.Process(target=write, args=(places_of_both[::k],)) for k in (1, -1)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(500)
    assert [process.exitcode for process in processes] == [0, 0]


def test_a_folder_that_took_the_place_of_the_one_waited_for_is_held_under_its_own_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    lock = taken(folder / LOCK_NAME)
    wrote = threading.Event()

    def write() -> None:
        with locked(folder / "a"):
            write_text(folder / "a", "b")  # waits for itself where it does not know its lock
            wrote.set()

    monkeypatch.setattr(places, "WAIT_S", 5.0)
    waits = threading.Event()
    real = Lock.acquire

    def acquire(self: Lock, wait_s: float) -> None:
        waits.set()
        real(self, wait_s)

    monkeypatch.setattr(Lock, "acquire", acquire)
    writer = threading.Thread(target=write)
    writer.start()
    assert waits.wait(500)
    folder.rename(tmp_path / "old")
    folder.mkdir(exist_ok=True)  # the writer, which asks again meanwhile, may have made it
    lock.release()
    writer.join()
    assert wrote.is_set()
    assert (folder / "a").read_text() == "b"
