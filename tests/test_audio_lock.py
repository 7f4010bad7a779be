"""A process that keeps the lock of all audio servers is found, named and ended."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tests.audio_lock import SEM_GETVAL, SEM_SETVAL, LockWatch

IPC_CREAT, IPC_RMID = 0o1000, 0
# Take the lock and keep it; SEM_UNDO, as JACK has it, gives it back where the process ends.
KEEP = """
import ctypes, struct, sys, time
SEM_UNDO = 0x1000 if {undone} else 0
ctypes.CDLL(None).semop({lock}, struct.pack("Hhh", 0, -1, SEM_UNDO), 1)
print("kept", flush=True)
time.sleep(60 if {stays} else 0)
"""
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="expected Linux for its semaphores")


@pytest.fixture
def lock() -> Iterator[tuple[int, int]]:
    """Key and number of a lock of this test's own."""
    libc, key = ctypes.CDLL(None), 0x54510000 + os.getpid() % 0x10000
    number = libc.semget(key, 1, IPC_CREAT | 0o600)
    assert number >= 0
    libc.semctl(number, 0, SEM_SETVAL, 1)
    yield key, number
    libc.semctl(number, 0, IPC_RMID)


@pytest.mark.parametrize(("undone", "stays"), [(True, True), (False, False)])
def test_who_keeps_it_is_named_and_the_lock_is_free_again(
    lock: tuple[int, int], undone: bool, stays: bool
) -> None:
    """A process that hangs is killed; after one that is gone, the lock is set."""
    key, number = lock
    watch = LockWatch(key, patience_s=0.5)
    code = KEEP.format(lock=number, undone=undone, stays=stays)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as keeper:
        assert keeper.stdout is not None
        assert keeper.stdout.readline() == b"kept\n"
        assert ctypes.CDLL(None).semctl(number, 0, SEM_GETVAL) == 0
        watch.begin()
        end = time.monotonic() + 500
        while ctypes.CDLL(None).semctl(number, 0, SEM_GETVAL) == 0:
            assert time.monotonic() < end
            time.sleep(0.02)
    watch.close()
    (freed,) = watch.freed
    assert freed.startswith(f"process {keeper.pid} (")
    assert ("time.sleep" in freed) == stays


def test_a_lock_that_is_taken_and_given_back_is_left_alone(lock: tuple[int, int]) -> None:
    key, number = lock
    watch, libc = LockWatch(key, patience_s=0.2), ctypes.CDLL(None)
    watch.begin()
    end = time.monotonic() + 1
    while time.monotonic() < end:
        libc.semctl(number, 0, SEM_SETVAL, 0)
        time.sleep(0.001)
        libc.semctl(number, 0, SEM_SETVAL, 1)
        time.sleep(0.02)
    watch.close()
    assert watch.freed == []
